#pragma once
/// The one list of constitutive laws. A new law is one header and one line here.

#include <variant>

#include "cairn/material/hypoelastic.hpp"
#include "cairn/material/neo_hookean.hpp"
#include "cairn/material/parameters.hpp"
#include "cairn/material/rigid.hpp"
#include "cairn/material/von_mises.hpp"

namespace cairn {

using Law = std::variant<NeoHookean, Hypoelastic, VonMises, Rigid>;

/// Name and parameter table of every law, in the order of the variant.
std::span<const LawInfo> law_infos();

/// Builds the law called `model`; `parameters` holds every key of its table.
Law make_law(std::string_view model, const ParameterValues& parameters);

}  // namespace cairn
