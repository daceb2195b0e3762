#include "cairn/material/registry.hpp"

#include <array>

#include "cairn/core/error.hpp"

namespace cairn {
namespace {

template <class Variant>
struct Table;
template <class... Laws>
struct Table<std::variant<Laws...>> {
  inline static const std::array<LawInfo, sizeof...(Laws)> infos = {LawInfo{Laws::name, Laws::parameters}...};
  static Law make(std::string_view model, const ParameterValues& values) {
    std::optional<Law> law;
    ((Laws::name == model ? void(law.emplace(Laws(values))) : void()), ...);
    if (!law) throw InputError("unknown material model '" + std::string(model) + "'");
    return *law;
  }
};

}  // namespace

std::span<const LawInfo> law_infos() { return Table<Law>::infos; }

Law make_law(std::string_view model, const ParameterValues& parameters) { return Table<Law>::make(model, parameters); }

}  // namespace cairn
