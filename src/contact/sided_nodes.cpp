// Nodes with fields of several sides of cracks: which of them meet, as bodies and across cracks (Nairn 2013, section
// 2).

#include <numeric>

#include "cairn/contact/crack_gap.hpp"
#include "cairn/contact/sweep.hpp"
#include "node_access.hpp"

namespace cairn {

/// Fields of less than this share of a pair's mass are not in contact across a crack (Nairn 2013, section 3.1).
constexpr double least_share_across = 1e-6;

template <int Dim>
bool ContactSweep<Dim>::has_sides(const Node& node) const {
  for (int i = 0; i < node.count; ++i)
    if (!entries_[node.first + i].sides.empty()) return true;
  return false;
}

/// The sums of whole bodies, over all of their fields at the node: normals and gaps between bodies come from them, or
/// the mouth of a crack would tilt them.
template <int Dim>
void ContactSweep<Dim>::sum_wholes(const Node& node, const Patch<Dim>& patch) {
  for (int i = 0; i < node.count; ++i) {
    auto& entry = entries_[node.first + i];
    const bool another = i == 0 || entries_[node.first + i - 1].piece != entry.piece;
    if (another) wholes_.emplace_back(), wholes_.back().fill(0);
    entry.whole = static_cast<int>(wholes_.size()) - 1;
    const double* sums = contact::sums_at(patch.pieces[entry.piece], entry.node);
    for (int c = 0; c < NodeSums<Dim>::width; ++c) wholes_.back()[c] += sums[c];
  }
}

/// Whether two fields lie on the same side of every crack that cuts the bodies of both.
template <int Dim>
bool ContactSweep<Dim>::on_one_side(const ContactEntry<Dim>& a, const ContactEntry<Dim>& b, const Patch<Dim>& patch,
                                    const ContactSettings<Dim>& settings) const {
  const auto seen_by = [&](const ContactEntry<Dim>& e, SideSet sides) {
    return sides.only([&](int c) { return settings.cracks[c].cuts_body(patch.pieces[e.piece].body); });
  };
  return seen_by(b, a.sides) == seen_by(a, b.sides);
}

template <int Dim>
void ContactSweep<Dim>::list_sided_pairs(Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                         const ContactSettings<Dim>& settings, bool fixed) {
  const ContactEntry<Dim>* entry = &entries_[node.first];
  sum_wholes(node, patch);
  const auto mass_of = [&](int i) { return wholes_[entry[i].whole][NodeSums<Dim>::mass]; };
  double deformable = 0;
  for (int i = 0; i < node.count; ++i) {
    if (!entry[i].rigid) deformable += entry[i].mass;
    const auto& best = entry[node.partner];
    if (entry[i].rigid != best.rigid ? entry[i].rigid : mass_of(i) > mass_of(node.partner)) node.partner = i;
  }
  const auto of_partner = [&](int i) { return entry[i].piece == entry[node.partner].piece; };
  for (int i = 0; i < node.count; ++i) {
    if (of_partner(i) || entry[i].rigid) continue;
    const PairLaw& law = settings.pair(entry[i].material, entry[node.partner].material);
    for (int j = 0; j < node.count; ++j) {
      if (!of_partner(j) || !on_one_side(entry[i], entry[j], patch, settings)) continue;
      NodePair<Dim> pair;
      pair.a = i, pair.b = j, pair.law = law;
      pair.open = !fixed && (law.binds() || std::min(entry[i].mass, entry[j].mass) >= least_share_across * deformable);
      pairs_.push_back(pair);
    }
  }
  node.pair_count = static_cast<int>(pairs_.size()) - node.first_pair;
  if (node.pair_count > 0) {
    set_normals(node, patch, lattice, settings);
    set_gaps(node, patch, lattice, settings);
  }
  if (!fixed) add_crack_pairs(node, patch, lattice, settings);
}

/// The sum that the fields of the crack's far side have of it at a node: N V sign of one of them, or N V normal of all.
template <int Dim>
const double* ContactSweep<Dim>::crossing(const ContactEntry<Dim>& entry, int crack, const Patch<Dim>& patch) const {
  const NodeBox<Dim>& nodes = patch.pieces[entry.piece].nodes;
  for (int n = 0; n < SideSet::most; ++n)
    if (entry.sides.crack(n) == crack)
      return nodes.further.crossings.data() + (entry.node - nodes.box.size()) * NodeCrossings<Dim>::width +
             n * NodeCrossings<Dim>::each;
  return nullptr;
}

template <int Dim>
Vec<Dim> ContactSweep<Dim>::crack_normal(const Node& node, int crack, const Patch<Dim>& patch) const {
  Vec<Dim> sum = Vec<Dim>::Zero();
  for (int i = 0; i < node.count; ++i)
    if (const double* there = crossing(entries_[node.first + i], crack, patch))
      sum += contact::ConstNode<Dim>(there + NodeCrossings<Dim>::normal);
  const double size = sum.norm();
  return size > 0 ? Vec<Dim>(sum / size) : sum;
}

/// Fields of one body whose sets differ by one crack alone meet across it, the lower one first.
template <int Dim>
void ContactSweep<Dim>::add_crack_pairs(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                        const ContactSettings<Dim>& settings) {
  const ContactEntry<Dim>* entry = &entries_[node.first];
  Vec<Dim> x;
  for (int d = 0; d < Dim; ++d) x[d] = lattice.node_position(d, node.place[d]);
  for (int far = 0; far < node.count; ++far)
    for (int n = 0; n < entry[far].sides.size(); ++n) {
      const int crack = entry[far].sides.crack(n);
      const CrackContact& contact = settings.cracks[crack];
      const bool tied = contact.tie != CrackContact::Tie::none;
      if (!contact.meets && !tied) continue;
      const double* there = crossing(entry[far], crack, patch);
      for (int near = 0; near < node.count; ++near) {
        if (entry[near].piece != entry[far].piece || !(entry[near].sides == entry[far].sides.without(crack))) continue;
        const bool far_is_above = there[NodeCrossings<Dim>::sign] > 0;
        NodePair<Dim> pair;
        pair.a = far_is_above ? near : far, pair.b = far_is_above ? far : near;
        pair.crack = crack, pair.law = contact.law;
        pair.normal = crack_normal(node, crack, patch);
        const double mass = entry[far].mass + entry[near].mass;
        pair.open = pair.law.binds() || (pair.normal.squaredNorm() > 0 &&
                                         std::min(entry[far].mass, entry[near].mass) >= least_share_across * mass);
        pair.gap = contact::crack_gap<Dim>(patch, lattice, crack, x, pair.normal);
        if (contact.meets) pairs_.push_back(pair);
        if (!tied || !(pair.normal.squaredNorm() > 0)) continue;
        pair.tie = contact.tie, pair.law.law = ContactLaw::stick, pair.open = true;
        pairs_.push_back(pair);
      }
    }
  bind_far_fields(node, settings);
}

/// Fields that only cracks which bind part are one, even where the fields between them have no material: those that no
/// chain of pairs connects yet are bound.
template <int Dim>
void ContactSweep<Dim>::bind_far_fields(const Node& node, const ContactSettings<Dim>& settings) {
  const ContactEntry<Dim>* entry = &entries_[node.first];
  const auto binds = [&](int c) { return settings.cracks[c].meets && settings.cracks[c].law.binds(); };
  std::vector<int> group(node.count);
  std::iota(group.begin(), group.end(), 0);
  const auto join = [&](int a, int b) { std::ranges::replace(group, int{group[a]}, int{group[b]}); };
  for (int p = node.first_pair; p < static_cast<int>(pairs_.size()); ++p)
    if (pairs_[p].crack != NodePair<Dim>::none && binds(pairs_[p].crack)) join(pairs_[p].a, pairs_[p].b);
  for (int i = 0; i < node.count; ++i)
    for (int j = i + 1; j < node.count; ++j) {
      const SideSet first = entry[i].sides, second = entry[j].sides;
      const auto parts = [&](int c) { return first.contains(c) != second.contains(c); };
      if (group[i] == group[j] || entry[i].piece != entry[j].piece) continue;
      if (!(first.only([&](int c) { return parts(c) && !binds(c); }).empty()) ||
          !(second.only([&](int c) { return parts(c) && !binds(c); }).empty()))
        continue;
      NodePair<Dim> pair;
      pair.a = i, pair.b = j, pair.open = true, pair.normal.setZero();
      pair.crack = first.only(parts).empty() ? second.only(parts).crack(0) : first.only(parts).crack(0);
      pair.law = settings.cracks[pair.crack].law;
      pairs_.push_back(pair), join(i, j);
    }
}

/// Faces of a crack are held where they would be pressed together by the end of the step and have met by then.
template <int Dim>
contact::Decision ContactSweep<Dim>::decide_across(const NodePair<Dim>& pair, const Vec<Dim>& P, const Vec<Dim>& F,
                                                   double mass, double dt) const {
  const double approach = (P + dt * F).dot(pair.normal);
  if (pair.gap - dt * approach / mass > 0) return {};
  return contact::decide_by_reaction<Dim>(P, F, pair.normal, pair.law.friction, dt);
}

template <int Dim>
bool ContactSweep<Dim>::crosses_cracks(const Node& node) const {
  for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p)
    if (pairs_[p].crack != NodePair<Dim>::none) return true;
  return false;
}

/// Pairs across cracks may close circles, along which impulses are not unique: the least ones.
template <int Dim>
void ContactSweep<Dim>::solve_for_least() {
  Eigen::MatrixXd whole = matrix_.template selfadjointView<Eigen::Lower>();
  if constexpr (Dim == 3) {
    // Where three planes cross fields may be lighter than others by any factor: with pairs of one size none of them is
    // taken for round-off of another.
    const Eigen::VectorXd size = whole.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    whole = (size.asDiagonal() * whole * size.asDiagonal()).eval();
    const auto factors = whole.completeOrthogonalDecomposition();
    const Eigen::VectorXd right = size.asDiagonal() * right_;
    Eigen::VectorXd solution = factors.solve(right);
    solution += factors.solve(right - whole * solution);
    right_ = size.asDiagonal() * solution;
    return;
  }
  right_ = whole.completeOrthogonalDecomposition().solve(right_).eval();
}

#define CAIRN_INSTANTIATE(Dim)                                                                                        \
  template bool ContactSweep<Dim>::has_sides(const Node&) const;                                                      \
  template void ContactSweep<Dim>::list_sided_pairs(Node&, const Patch<Dim>&, const Lattice<Dim>&,                    \
                                                    const ContactSettings<Dim>&, bool);                               \
  template contact::Decision ContactSweep<Dim>::decide_across(const NodePair<Dim>&, const Vec<Dim>&, const Vec<Dim>&, \
                                                              double, double) const;                                  \
  template bool ContactSweep<Dim>::crosses_cracks(const Node&) const;                                                 \
  template void ContactSweep<Dim>::solve_for_least();
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
