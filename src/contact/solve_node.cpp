// The impulses of a node's pairs.

#include <Eigen/Dense>

#include "cairn/contact/sweep.hpp"
#include "node_access.hpp"

namespace cairn {

template <int Dim>
double ContactSweep<Dim>::inverse_mass(const Node& node, int entry) const {
  if (entry == NodePair<Dim>::none) return 0.0;
  const auto& e = entries_[node.first + entry];
  return e.rigid ? 0.0 : 1.0 / e.mass;
}

template <int Dim>
double ContactSweep<Dim>::reduced_mass(const Node& node, const NodePair<Dim>& pair) const {
  return 1.0 / (inverse_mass(node, pair.a) + inverse_mass(node, pair.b));
}

/// Of a over its partner, with the impulses found so far.
template <int Dim>
Vec<Dim> ContactSweep<Dim>::relative_velocity(const Node& node, const NodePair<Dim>& pair) const {
  const auto velocity = [&](int i) -> Vec<Dim> {
    const auto& entry = entries_[node.first + i];
    return (entry.rigid ? momenta_[i] : Vec<Dim>(momenta_[i] + impulses_[i])) / entry.mass;
  };
  return velocity(pair.a) - (pair.b == pair.none ? wall_velocities_[pair.face] : velocity(pair.b));
}

template <int Dim>
Vec<Dim> ContactSweep<Dim>::relative_acceleration(const Node& node, const NodePair<Dim>& pair) const {
  const auto acceleration = [&](int i) -> Vec<Dim> { return forces_[i] / entries_[node.first + i].mass; };
  return pair.b == pair.none ? acceleration(pair.a) : Vec<Dim>(acceleration(pair.a) - acceleration(pair.b));
}

template <int Dim>
void ContactSweep<Dim>::solve(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                              const ContactSettings<Dim>& settings, double dt, Pass pass) {
  const auto& options = settings.options;
  for (int i = 0; i < node.count; ++i) impulses_[i].setZero();
  NodePair<Dim>* pairs = &pairs_[node.first_pair];
  for (int p = 0; p < node.pair_count; ++p) pairs[p].impulse.setZero();
  if (options.release != Release::reaction || options.normal_choice == NormalChoice::own) {
    solve_as_published(node, settings, dt, pass);
  } else {
    if (pass == Pass::first) decide(node, patch, settings, dt);
    node.pair_count == 1 ? solve_pair(node, pairs[0], pass) : solve_together(node, pass);
  }
  if (!(options.impulse_limit > 0)) return;
  double mass = 0;
  for (int i = 0; i < node.count; ++i) impulses_[i].setZero(), mass += entries_[node.first + i].mass;
  for (int p = 0; p < node.pair_count; ++p) {
    NodePair<Dim>& pair = pairs[p];
    const bool rigid = pair.face != pair.none || (pair.crack == pair.none && entries_[node.first + node.partner].rigid);
    const double own = entries_[node.first + pair.a].mass;
    const double rest = rigid ? std::numeric_limits<double>::infinity() : mass - own;
    pair.impulse *= contact::impulse_scale<Dim>(pair.impulse, own, rest, lattice.spacing(), options.impulse_limit, dt);
    give(pair, pair.impulse);
  }
}

/// Adds an impulse to the bodies of a pair.
template <int Dim>
void ContactSweep<Dim>::give(const NodePair<Dim>& pair, const Vec<Dim>& impulse) {
  impulses_[pair.a] += impulse;
  if (pair.b != pair.none) impulses_[pair.b] -= impulse;
}

/// Predicted reaction, once for each step: what holds, and what sticks.
template <int Dim>
void ContactSweep<Dim>::decide(const Node& node, const Patch<Dim>& patch, const ContactSettings<Dim>& settings,
                               double dt) {
  for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p) {
    NodePair<Dim>& pair = pairs_[p];
    if (!pair.open || pair.law.binds()) continue;
    const double mass = reduced_mass(node, pair);
    const Vec<Dim> P = mass * relative_velocity(node, pair), F = mass * relative_acceleration(node, pair);
    if (pair.crack != pair.none) {
      pair.decision = decide_across(pair, P, F, mass, dt);
      continue;
    }
    double pressing = F.dot(pair.normal);
    if (pair.face != pair.none) {
      const auto& piece = patch.pieces[entries_[node.first + pair.a].piece];
      pressing = contact::whole_force<Dim>(piece, pair.gap_node).dot(pair.normal);
    }
    const auto& gap = pair.face == pair.none ? settings.gap : settings.gap_at_wall;
    pair.decision = gap.touches(pair.gap, pair.yield * pressing)
                        ? contact::decide_by_reaction<Dim>(P, F, pair.normal, pair.law.friction, dt)
                        : contact::Decision{};
  }
}

template <int Dim>
void ContactSweep<Dim>::solve_pair(const Node& node, NodePair<Dim>& pair, Pass pass) {
  if (!pair.open) return;
  const Vec<Dim> P = reduced_mass(node, pair) * relative_velocity(node, pair);
  if (pair.law.binds())
    for (const Vec<Dim>& along : bound_directions(pair)) pair.impulse -= P.dot(along) * along;
  else if (pass == Pass::second)
    pair.impulse = contact::reaction_impulse<Dim>(P, pair.normal, pair.decision, pair.law.friction);
  else
    pair.impulse = contact::hold_impulse<Dim>(P, pair.normal, pair.decision);
  give(pair, pair.impulse);
}

/// Several pairs: their impulses one by one would not be a symmetric function of the momenta, and what the nodes take
/// and what the points get would not be adjoint: energy would be made.
template <int Dim>
void ContactSweep<Dim>::solve_together(const Node& node, Pass pass) {
  modes_.assign(node.pair_count, Mode::off);
  for (int p = 0; p < node.pair_count; ++p) {
    const NodePair<Dim>& pair = pairs_[node.first_pair + p];
    if (!pair.open) continue;
    if (pair.law.binds())
      modes_[p] = Mode::bound;
    else if (pair.decision.hold)
      modes_[p] = pair.decision.stick ? Mode::stick : Mode::slide;
  }
  bring_to_rest(node);
  if (pass != Pass::second) return;
  for (int round = 0; round < 2 * node.pair_count && release_pairs(node); ++round) bring_to_rest(node);
  add_friction(node);
}

/// Directions that span what a pair binds: all, or those of a tie across a crack.
template <int Dim>
std::vector<Vec<Dim>> ContactSweep<Dim>::bound_directions(const NodePair<Dim>& pair) const {
  using Tie = CrackContact::Tie;
  if (pair.tie == Tie::normal) return {pair.normal};
  std::vector<Vec<Dim>> directions;
  if (pair.tie == Tie::none) {
    for (int d = 0; d < Dim; ++d) directions.push_back(Vec<Dim>::Unit(d));
  } else if constexpr (Dim == 2) {
    directions.push_back(Vec<2>(-pair.normal.y(), pair.normal.x()));
  } else {
    directions.push_back(pair.normal.unitOrthogonal());
    directions.push_back(pair.normal.cross(directions[0]));
  }
  return directions;
}

/// The impulses that bring what holds to rest with the least change of kinetic energy. With rows c = n . (v_a - v_b),
/// of all components where it sticks, and K = J M^-1 J^T, they are -K^-1 c along the rows.
template <int Dim>
void ContactSweep<Dim>::bring_to_rest(const Node& node) {
  NodePair<Dim>* pairs = &pairs_[node.first_pair];
  for (int i = 0; i < node.count; ++i) impulses_[i].setZero();
  rows_.clear();
  for (int p = 0; p < node.pair_count; ++p) {
    pairs[p].impulse.setZero();
    if (modes_[p] == Mode::slide) rows_.push_back({p, pairs[p].normal});
    if (modes_[p] == Mode::stick || modes_[p] == Mode::bound)
      for (const Vec<Dim>& along : bound_directions(pairs[p])) rows_.push_back({p, along});
  }
  const int n = static_cast<int>(rows_.size());
  if (n == 0) return;
  matrix_.resize(n, n), right_.resize(n);
  const auto coupling = [&](const NodePair<Dim>& p, const NodePair<Dim>& q) {
    double sum = 0;
    for (const auto& [i, sign] : {std::pair(p.a, 1.0), std::pair(p.b, -1.0)}) {
      if (i == q.a) sum += sign * inverse_mass(node, i);
      if (i == q.b) sum -= sign * inverse_mass(node, i);
    }
    return sum;
  };
  for (int r = 0; r < n; ++r) {
    const NodePair<Dim>& pair = pairs[rows_[r].pair];
    right_[r] = rows_[r].along.dot(relative_velocity(node, pair));
    for (int c = 0; c <= r; ++c)
      matrix_(r, c) = rows_[r].along.dot(rows_[c].along) * coupling(pair, pairs[rows_[c].pair]);
  }
  if (crosses_cracks(node))
    solve_for_least();
  else
    right_ = matrix_.template selfadjointView<Eigen::Lower>().ldlt().solve(right_).eval();
  for (int r = 0; r < n; ++r) pairs[rows_[r].pair].impulse -= right_[r] * rows_[r].along;
  for (int p = 0; p < node.pair_count; ++p) give(pairs[p], pairs[p].impulse);
}

/// Lets go of pairs that would be pulled, and lets those slide that friction cannot hold. Whether there were any.
template <int Dim>
bool ContactSweep<Dim>::release_pairs(const Node& node) {
  bool changed = false;
  for (int p = 0; p < node.pair_count; ++p) {
    if (modes_[p] != Mode::slide && modes_[p] != Mode::stick) continue;
    const NodePair<Dim>& pair = pairs_[node.first_pair + p];
    const double pushed = -pair.impulse.dot(pair.normal);
    const double limit = (1 + 1e-12) * contact::friction_limit(pair.law.friction, pushed);
    if (!(pushed > 0))
      modes_[p] = Mode::off, changed = true;
    else if (modes_[p] == Mode::stick && contact::tangential<Dim>(pair.impulse, pair.normal).norm() > limit)
      modes_[p] = Mode::slide, changed = true;
  }
  return changed;
}

template <int Dim>
void ContactSweep<Dim>::add_friction(const Node& node) {
  NodePair<Dim>* pairs = &pairs_[node.first_pair];
  for (int p = 0; p < node.pair_count; ++p) {
    if (modes_[p] != Mode::slide) continue;
    NodePair<Dim>& pair = pairs[p];
    const Vec<Dim> P = reduced_mass(node, pair) * relative_velocity(node, pair);
    const double limit = contact::friction_limit(pair.law.friction, -pair.impulse.dot(pair.normal));
    pair.impulse += contact::limited_impulse<Dim>(P, pair.normal, 0.0, limit);
  }
  for (int i = 0; i < node.count; ++i) impulses_[i].setZero();
  for (int p = 0; p < node.pair_count; ++p) give(pairs[p], pairs[p].impulse);
}

/// Energy [J] that contact gives at a node beyond what walls and rigid bodies do, after the repeat pass where `again`.
template <int Dim>
double ContactSweep<Dim>::given(const Node& node, double dt, bool again) const {
  double sum = 0;
  for (int i = 0; i < node.count; ++i) {
    const auto& entry = entries_[node.first + i];
    if (entry.rigid) continue;
    sum += again ? entry.record.given(entry.mass, dt, momenta_[i], impulses_[i]) : entry.record.given(entry.mass, dt);
  }
  return sum - driven(node);
}

/// Work [J] of walls and rigid bodies at a node.
template <int Dim>
double ContactSweep<Dim>::driven(const Node& node) const {
  const auto& partner = entries_[node.first + node.partner];
  double sum = 0;
  for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p) {
    const NodePair<Dim>& pair = pairs_[p];
    if (pair.face != pair.none)
      sum += pair.second.dot(wall_velocities_[pair.face]);
    else if (partner.rigid && pair.crack == pair.none)
      sum += pair.second.dot(partner.record.projected) / partner.mass;
  }
  return sum;
}

/// Contact may not give energy. Where neighbouring nodes turn a body round under its friction, that would have worked
/// with the motion: the strains then see so much less of it that the forces take the energy back.
template <int Dim>
void ContactSweep<Dim>::take_back(const Node& node, double dt) {
  double gain = given(node, dt, true);
  if (!(gain > 0)) return;
  for (int i = 0; i < node.count; ++i) forces_[i] = entries_[node.first + i].record.force;
  const auto motion = [&](int i) {  // before the step and after
    const auto& entry = entries_[node.first + i];
    return (entry.record.projected.norm() + momenta_[i].norm()) / entry.mass;
  };
  std::vector<std::pair<double, int>> strongest;  // the order of the bodies decides nothing
  for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p) {
    const double size = relative_acceleration(node, pairs_[p]).norm();
    if (pairs_[p].decision.hold && size > 0) strongest.emplace_back(-size, p);
  }
  std::sort(strongest.begin(), strongest.end());
  for (const auto& [negative, p] : strongest) {
    if (!(gain > 0)) return;
    const NodePair<Dim>& pair = pairs_[p];
    const Vec<Dim> acceleration = relative_acceleration(node, pair);
    const double size = -negative;
    // Never more than turns the pair's own motion round.
    const double most = 2 * reduced_mass(node, pair) * (motion(pair.a) + (pair.b == pair.none ? 0.0 : motion(pair.b)));
    give(pair, std::min(2 * gain / (dt * size), most) / size * acceleration);
    gain = given(node, dt, true);
  }
}

/// The papers' forms: every body meets the common motion of the node, or a rigid body's, and then the walls.
template <int Dim>
void ContactSweep<Dim>::solve_as_published(const Node& node, const ContactSettings<Dim>& settings, double dt,
                                           Pass pass) {
  using namespace contact;
  const auto& partner = entries_[node.first + node.partner];
  double mass = 0;
  Vec<Dim> momentum = Vec<Dim>::Zero(), force = Vec<Dim>::Zero();
  for (int i = 0; i < node.count; ++i)
    mass += entries_[node.first + i].mass, momentum += momenta_[i], force += forces_[i];
  if (partner.rigid) mass = partner.mass, momentum = momenta_[node.partner], force = forces_[node.partner];
  for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p) {
    NodePair<Dim>& pair = pairs_[p];
    if (!pair.open) continue;
    const bool wall = pair.face != pair.none;
    const double own = entries_[node.first + pair.a].mass, mu = pair.law.friction;
    const Vec<Dim>& n = pair.normal;
    const Vec<Dim> P = wall ? Vec<Dim>(momenta_[pair.a] + impulses_[pair.a] - own * wall_velocities_[pair.face])
                            : Vec<Dim>(momenta_[pair.a] - own / mass * momentum);
    if (pair.law.binds()) {
      pair.impulse = -P;
    } else if (settings.options.release == Release::reaction) {
      const Vec<Dim> F = forces_[pair.a] - (wall ? Vec<Dim>(Vec<Dim>::Zero()) : Vec<Dim>(own / mass * force));
      const auto& gap = wall ? settings.gap_at_wall : settings.gap;
      if (pass == Pass::first)
        pair.decision =
            gap.touches(pair.gap, pair.yield * F.dot(n)) ? decide_by_reaction<Dim>(P, F, n, mu, dt) : Decision{};
      pair.impulse = pass == Pass::second ? reaction_impulse<Dim>(P, n, pair.decision, pair.law.friction)
                                          : hold_impulse<Dim>(P, n, pair.decision);
    } else if (wall || settings.options.release == Release::approach) {
      // Stress at a wall is one-sided, so that release by traction reduces to approach there.
      pair.impulse = approach_impulse<Dim>(P, n, mu);
    } else {
      pair.impulse =
          traction_impulse<Dim>(P, n, mu, pair.compressive, pair.stress_free, settings.options.departing_friction);
    }
    give(pair, pair.impulse);
  }
}

#define CAIRN_INSTANTIATE(Dim)                                                                \
  template void ContactSweep<Dim>::solve(const Node&, const Patch<Dim>&, const Lattice<Dim>&, \
                                         const ContactSettings<Dim>&, double, Pass);          \
  template double ContactSweep<Dim>::given(const Node&, double, bool) const;                  \
  template double ContactSweep<Dim>::driven(const Node&) const;                               \
  template void ContactSweep<Dim>::take_back(const Node&, double);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
