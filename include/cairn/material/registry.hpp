#pragma once
/// The one list of constitutive laws. A new law is one header and one line here.

#include <variant>

#include "cairn/material/hypoelastic.hpp"
#include "cairn/material/neo_hookean.hpp"
#include "cairn/material/parameters.hpp"
#include "cairn/material/point_update.hpp"
#include "cairn/material/rigid.hpp"
#include "cairn/material/viscoelastic.hpp"
#include "cairn/material/von_mises.hpp"

namespace cairn {

using Law = std::variant<NeoHookean, Hypoelastic, VonMises, Viscoelastic<1>, Viscoelastic<2>, Viscoelastic<3>,
                         Viscoelastic<4>, Rigid>;

/// Name and parameter table of every model, in the order of the variant.
std::span<const LawInfo> law_infos();

/// The entry of a model; none if there is none of that name.
const LawInfo* find_law(std::string_view model);

/// Builds the law called `model`; `parameters` holds every key of its table.
Law make_law(std::string_view model, const ParameterValues& parameters, Plane plane = Plane::strain);

/// Stiffness of a law against longitudinal strain at the start, K + 4G/3 [Pa].
double longitudinal_modulus(const Law& law);

/// Room for the state variables of any law.
inline constexpr std::size_t state_capacity = []<class... Laws>(std::type_identity<std::variant<Laws...>>) {
  return std::max({Laws::state_names.size()...});
}(std::type_identity<Law>{});

}  // namespace cairn
