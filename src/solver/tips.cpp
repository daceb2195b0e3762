// Tips of cracks: J-integrals and stress intensities.

#include <bit>
#include <map>

#include "cairn/body/deformation.hpp"
#include "cairn/crack/rim.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {
namespace {

constexpr double hat = 1.5;        // cells, of q along a rim to each side of a point
constexpr double rim_reach = 3.0;  // cells along a rim over which sums are averaged, to each side

/// Elastic constants at a tip where the law is linear for small strains; none else.
template <int Dim>
void set_moduli(CrackTip<Dim>& tip, const Material& material) {
  if (material.model != "hypoelastic" && material.model != "neo_hookean") return;
  const double mu = material.parameters.at("shear_modulus"), bulk = material.parameters.at("bulk_modulus");
  const double nu = (3 * bulk - 2 * mu) / (2 * (3 * bulk + mu)), E = 2 * mu * (1 + nu);
  const bool strain = Dim == 3 || material.plane == Plane::strain;
  tip.modulus = strain ? E / (1 - nu * nu) : E;
  tip.kappa = strain ? 3 - 4 * nu : (3 - nu) / (1 + nu);
  tip.shear_modulus = mu;
}

/// The image of a place that is nearest to the tip.
template <int Dim>
Vec<Dim> beside(const Lattice<Dim>& lattice, Vec<Dim> x, const Vec<Dim>& tip) {
  for (int d = 0; d < Dim; ++d) x[d] -= lattice.periods_between(d, x[d], tip[d]);
  return x;
}

/// Whether points of the patch with these cells can be nearer than `reach` [m] to the tip.
template <int Dim>
bool may_reach(const Lattice<Dim>& lattice, const Box<Dim>& cells, const Vec<Dim>& tip, double reach) {
  double squared = 0;
  for (int d = 0; d < Dim; ++d) {
    // Points may be half a cell outside the domain.
    const double lower = lattice.node_position(d, cells.lower[d] - 1);
    const double upper = lattice.node_position(d, cells.upper[d] + 1);
    const double x = tip[d] - lattice.periods_between(d, tip[d], 0.5 * (lower + upper));
    squared += std::pow(std::max({lower - x, x - upper, 0.0}), 2);
  }
  return squared < reach * reach;
}

/// Means of the sums along rims, weighted by hat functions of the distance, and of what they are divided by: each point
/// keeps its own axes. On a grid a curved rim is a staircase, whose steps have intensities of their own.
void average_along_rims(const Lattice<3>& lattice, double reach, std::vector<CrackTip<3>>& tips,
                        std::vector<TipSums>& sums) {
  const std::vector<TipSums> single = sums;
  const std::vector<CrackTip<3>> before = tips;
  for (std::size_t t = 0; t < tips.size(); ++t) {
    sums[t] = {}, tips[t].weight = 0;
    for (std::size_t u = 0; u < tips.size(); ++u) {
      if (tips[u].crack != tips[t].crack) continue;
      const double share = 1 - (beside(lattice, tips[u].position, tips[t].position) - tips[t].position).norm() / reach;
      if (!(share > 0)) continue;
      const TipSums& s = single[u];
      tips[t].weight += share * before[u].weight;
      sums[t].add({share * s.J, share * s.J_static, share * s.I_opening, share * s.I_sliding, share * s.I_tearing});
    }
  }
}

/// What a patch knows of the steps so far.
template <int Dim>
struct Remembered {
  PatchLedger ledger;
  double pressing;
  std::map<int, ToolSum> tools;

  explicit Remembered(Patch<Dim>& patch)
      : ledger(patch.ledger), pressing(patch.pressing), tools(std::move(patch.tools)) {}
  void give_back(Patch<Dim>& patch) {
    patch.ledger = ledger, patch.pressing = pressing, patch.tools = std::move(tools);
  }
};

}  // namespace

template <int Dim>
std::vector<CrackTip<Dim>> Simulation<Dim>::own_tips(const Patch<Dim>& patch) const {
  std::vector<CrackTip<Dim>> tips;
  if constexpr (Dim == 3) {
    const double h = lattice_.smallest_spacing();
    const CrackSegments<3> triangles(patch, lattice_, cracks_);
    return rim_of_patch(patch, triangles, hat * h, j_radius_[0] * h, j_radius_[1] * h);
  } else {
    for (std::size_t k = 0; k < patch.cracks.size(); ++k) {
      const auto& point = patch.cracks[k];
      for (int end = 0; end < 2; ++end) {
        const Crack& crack = cracks_[point.crack];
        if (!point.own || crack.open[end] || point.index != crack.ends[end]) continue;
        const auto& before = patch.cracks[end == 0 ? k + 1 : k - 1];
        CrackTip<Dim> tip;
        tip.crack = point.crack, tip.end = end, tip.position = point.plane, tip.normal.setZero();
        tip.ahead = (point.plane - before.plane).normalized();
        tips.push_back(tip);
      }
    }
    return tips;
  }
}

/// The tips, ascending in (crack, end), the same on every rank. Collective.
template <int Dim>
std::vector<CrackTip<Dim>> Simulation<Dim>::find_tips() const {
  std::vector<double> mine;
  for (const auto& patch : patches_)
    for (const auto& tip : own_tips(patch)) {
      mine.insert(mine.end(), {static_cast<double>(tip.crack), static_cast<double>(tip.end), tip.hat, tip.weight});
      for (const Vec<Dim>& v : {tip.position, tip.ahead, tip.normal}) mine.insert(mine.end(), v.data(), v.data() + Dim);
    }
  const std::vector<double> all = gather_on_all(mine, comm_);
  std::vector<CrackTip<Dim>> tips;
  for (std::size_t i = 0; i < all.size(); i += 4 + 3 * Dim) {
    using Map = Eigen::Map<const Vec<Dim>>;
    CrackTip<Dim> tip;
    tip.crack = static_cast<int>(all[i]), tip.end = static_cast<int>(all[i + 1]);
    tip.hat = all[i + 2], tip.weight = all[i + 3];
    tip.position = Map(&all[i + 4]), tip.ahead = Map(&all[i + 4 + Dim]), tip.normal = Map(&all[i + 4 + 2 * Dim]);
    tips.push_back(tip);
  }
  std::ranges::sort(tips, {}, [](const CrackTip<Dim>& tip) { return std::pair(tip.crack, tip.end); });
  return tips;
}

/// Accelerations and velocities of nodes as in a step from here, contact included, without changing anything that
/// stays. Returns the length of that step.
template <int Dim>
double Simulation<Dim>::find_motion() {
  ContactSettings<Dim> contact = contact_;
  contact.keep_contacts = contact.keep_tools = false;
  // Before the first step: that of a wave.
  const double dt = dt_ > 0 ? dt_ : limits_.cfl * lattice_.smallest_spacing() / maxima_[0];
  std::vector<Remembered<Dim>> remembered(patches_.begin(), patches_.end());
  exchange_->begin_sums(transfer_.extras);
  exchange_after([&](std::size_t p, Patch<Dim>& patch) { project_points(p, patch); });
  for_patches([&](std::size_t p, Patch<Dim>& patch) {
    exchange_->add(patch, p);
    mirror_sums(patch, lattice_, contact.faces);
    sweeps_[p].find(patch, lattice_, contact, bodies_);
    sweeps_[p].first_pass(patch, lattice_, contact, dt);
    find_tractions(p);
  });
  exchange_tractions();
  for_patches([&](std::size_t p, Patch<Dim>& patch) {
    add_row_forces(patch, surroundings_of(patch), row_forces_[p]);
    sweeps_[p].second_pass(patch, lattice_, contact, dt, true);
    for (auto& piece : patch.pieces) integrate(piece, dt), piece.projected = false;
    constrain_motion(patch, lattice_, contact.faces, bodies_, dt, true);
  });
  for (std::size_t p = 0; p < patches_.size(); ++p) remembered[p].give_back(patches_[p]), row_forces_[p].clear();
  return dt;
}

/// What contact forces between faces add to the integrals: those of the step that `find_motion` took.
template <int Dim>
void Simulation<Dim>::add_face_terms(std::size_t p, const std::vector<CrackTip<Dim>>& tips, double dt,
                                     std::vector<TipSums>& sums) const {
  const double h = lattice_.smallest_spacing(), weight = face_weight(j_radius_[0] * h, j_radius_[1] * h);
  sweeps_[p].for_forces_across(dt, [&](const Index<Dim>& place, int crack, const Vec<Dim>& force) {
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d) x[d] = lattice_.node_position(d, place[d]);
    for (std::size_t t = 0; t < tips.size(); ++t) {
      if (tips[t].crack != crack) continue;
      const Vec<Dim> near = beside(lattice_, x, tips[t].position);
      // In 2D above is left of the crack's direction, and of the tip's at its last end alone.
      const Vec<Dim> on_left = Dim == 3 || tips[t].end == 1 ? force : Vec<Dim>(-force);
      const TipSums add = face_terms(tips[t], near, on_left, h, weight);
      sums[t].I_opening += add.I_opening, sums[t].I_sliding += add.I_sliding, sums[t].I_tearing += add.I_tearing;
    }
  });
}

/// What a patch's points add to the tips' integrals.
template <int Dim>
void Simulation<Dim>::add_tip_terms(const Patch<Dim>& patch, const std::vector<CrackTip<Dim>>& tips,
                                    std::vector<TipSums>& sums) const {
  using C = PointColumns<Dim>;
  const double h = lattice_.smallest_spacing(), inner = j_radius_[0] * h, outer = j_radius_[1] * h;
  const double reach = Dim == 3 ? std::hypot(outer, hat * h) : outer;
  std::vector<std::size_t> reached;
  for (std::size_t t = 0; t < tips.size(); ++t)
    if (may_reach(lattice_, patch.cells, tips[t].position, reach)) reached.push_back(t);
  for (const auto& piece : patch.pieces) {
    if (reached.empty() || is_rigid(piece) || piece.points.size() == 0) continue;
    const Points<Dim>& points = piece.points;
    const SolverMaterial& material = material_of(piece);
    std::vector<std::array<double, Dim + Dim * Dim>> kinematics;  // where a tip is near
    std::visit(
        [&](const auto& law) {
          std::array<double, state_capacity> state{};
          for (const std::size_t t : reached)
            for (int p = 0; p < points.size(); ++p) {
              if (!cracks_[tips[t].crack].cuts(piece.body)) break;
              TipPoint<Dim> at;
              for (int d = 0; d < Dim; ++d) at.position[d] = points.column(d)[p];
              at.position = beside(lattice_, at.position, tips[t].position);
              if ((at.position - tips[t].position).squaredNorm() >= reach * reach) continue;
              if (kinematics.empty()) kinematics = point_kinematics(piece, lattice_, transfer_);
              const Tensor<Dim, double> F = deformation_of(points, p);
              for (int i = 0; i < Dim; ++i) {
                at.velocity[i] = points.column(C::velocity + i)[p], at.acceleration[i] = kinematics[p][i];
                for (int j = 0; j < Dim; ++j) {
                  at.stress(i, j) = points.column(C::stress + symmetric_index<Dim>(i, j))[p];
                  at.H(i, j) = F.c[tensor_index<Dim>(i, j)] - (i == j);
                  at.L(i, j) = kinematics[p][Dim + Dim * i + j];
                }
              }
              const double J = determinant(F);
              at.volume = J * points.column(C::volume)[p], at.density = material.density / J;
              for (int s = 0; s < points.columns() - C::state; ++s) state[s] = points.column(C::state + s)[p];
              at.energy = law.strain_energy(F, state.data()) / J;
              sums[t].add(tip_terms(tips[t], at, inner, outer));
            }
        },
        material.law);
  }
}

template <int Dim>
std::vector<TipState<Dim>> Simulation<Dim>::tip_states() {
  if (cracks_.empty()) return {};
  finish_speed_reduction();
  std::vector<CrackTip<Dim>> tips = find_tips();
  if (tips.empty()) return {};
  for (auto& tip : tips) {
    const auto& cut = cracks_[tip.crack];
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      if (cut.cuts(static_cast<int>(b)) && !bodies_[b].rigid) {
        set_moduli<Dim>(tip, specs_[bodies_[b].material]);
        break;
      }
  }
  const double dt = find_motion();
  std::vector<double> mine;  // tip, patch, sums
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    std::vector<TipSums> sums(tips.size());
    add_tip_terms(patches_[p], tips, sums);
    if (!patches_[p].pieces.empty()) add_face_terms(p, tips, dt, sums);
    for (std::size_t t = 0; t < tips.size(); ++t)
      if (sums[t] != TipSums{}) {
        mine.insert(mine.end(), {static_cast<double>(t), std::bit_cast<double>(patches_[p].id)});
        mine.insert(mine.end(), {sums[t].J, sums[t].J_static, sums[t].I_opening, sums[t].I_sliding, sums[t].I_tearing});
      }
  }
  const std::vector<double> all = gather_on_all(mine, comm_);
  std::map<std::pair<std::size_t, PatchId>, TipSums> ordered;
  for (std::size_t i = 0; i < all.size(); i += 2 + TipSums::size)
    ordered[{static_cast<std::size_t>(all[i]), std::bit_cast<PatchId>(all[i + 1])}] = {
        all[i + 2], all[i + 3], all[i + 4], all[i + 5], all[i + 6]};
  std::vector<TipSums> sums(tips.size());
  for (const auto& [of, part] : ordered) sums[of.first].add(part);
  if constexpr (Dim == 3) average_along_rims(lattice_, rim_reach * lattice_.smallest_spacing(), tips, sums);
  std::vector<TipState<Dim>> states;
  for (std::size_t t = 0; t < tips.size(); ++t) {
    const TipSums& sum = sums[t];
    const CrackTip<Dim>& tip = tips[t];
    const double none = std::numeric_limits<double>::quiet_NaN(), half = tip.modulus > 0 ? 0.5 * tip.modulus : none;
    TipState<Dim> state{tip, sum.J, sum.J_static, half * sum.I_opening, half * sum.I_sliding};
    if (Dim == 2) state.length = cracks_[tip.crack].grown[tip.end];
    if (Dim == 3) {
      state.K_tearing = tip.modulus > 0 ? tip.shear_modulus * sum.I_tearing : none;
      for (double* value : {&state.J, &state.J_static, &state.K_opening, &state.K_sliding, &state.K_tearing})
        *value /= tip.weight;
    }
    states.push_back(state);
  }
  return states;
}

#define CAIRN_INSTANTIATE(Dim)                                                                          \
  template std::vector<CrackTip<Dim>> Simulation<Dim>::own_tips(const Patch<Dim>&) const;               \
  template std::vector<CrackTip<Dim>> Simulation<Dim>::find_tips() const;                               \
  template double Simulation<Dim>::find_motion();                                                       \
  template void Simulation<Dim>::add_face_terms(std::size_t, const std::vector<CrackTip<Dim>>&, double, \
                                                std::vector<TipSums>&) const;                           \
  template void Simulation<Dim>::add_tip_terms(const Patch<Dim>&, const std::vector<CrackTip<Dim>>&,    \
                                               std::vector<TipSums>&) const;                            \
  template std::vector<TipState<Dim>> Simulation<Dim>::tip_states();
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
