#include "cairn/material/registry.hpp"

#include <algorithm>
#include <vector>

#include "cairn/core/error.hpp"
#include "cairn/material/variables.hpp"

namespace cairn {
namespace {

template <class Variant>
struct Table;
template <class... Laws>
struct Table<std::variant<Laws...>> {
  /// Types that share a name differ in their number of state variables alone, and count once.
  static std::vector<LawInfo> infos() {
    std::vector<LawInfo> all = {{Laws::name, Laws::parameters, HasPlaneStress<Laws>, HasPressure<Laws>}...};
    // std::ranges::unique does not compile with Clang 14 and the library of GCC 12.
    const auto same = [](const LawInfo& a, const LawInfo& b) { return a.name == b.name; };
    all.erase(std::unique(all.begin(), all.end(), same), all.end());
    return all;
  }

  static std::vector<std::string_view> variables() {
    std::vector<std::string_view> names;
    const auto add = [&](std::string_view name) {
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    };
    (std::for_each(Laws::state_names.begin(), Laws::state_names.end(), add), ...);
    return names;
  }

  template <class ConcreteLaw>
  static bool fits(const ParameterValues& values) {
    if constexpr (requires { ConcreteLaw::fits(values); })
      return ConcreteLaw::fits(values);
    else
      return true;
  }

  static std::optional<Law> make(std::string_view model, const ParameterValues& values) {
    std::optional<Law> law;
    ((Laws::name == model && fits<Laws>(values) ? void(law.emplace(Laws(values))) : void()), ...);
    return law;
  }
};

}  // namespace

std::span<const LawInfo> law_infos() {
  static const std::vector<LawInfo> infos = Table<Law>::infos();
  return infos;
}

std::vector<std::string_view> law_variables() { return Table<Law>::variables(); }

const LawInfo* find_law(std::string_view model) {
  const auto found = std::ranges::find(law_infos(), model, &LawInfo::name);
  return found == law_infos().end() ? nullptr : &*found;
}

Law make_law(std::string_view model, const ParameterValues& parameters, Plane plane) {
  std::optional<Law> law = Table<Law>::make(model, parameters);
  if (!law) {
    if (!find_law(model)) throw InputError("unknown material model '" + std::string(model) + "'");
    throw InputError("the parameters do not fit the material model '" + std::string(model) + "'");
  }
  std::visit(
      [&](auto& concrete) {
        if constexpr (requires { concrete.plane; }) concrete.plane = plane;
      },
      *law);
  return *law;
}

double longitudinal_modulus(const Law& law) {
  return std::visit(
      [](const auto& concrete) {
        Symmetric<3, double> stress{};
        double state[state_capacity] = {};
        return concrete.update(Tensor<3, double>{}, Tensor<3, double>{{1, 0, 0, 0, 1, 0, 0, 0, 1}}, 1.0, stress, state);
      },
      law);
}

}  // namespace cairn
