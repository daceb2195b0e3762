// The passes of contact over a patch, and its ledger.

#include "cairn/contact/sweep.hpp"

#include "node_access.hpp"

namespace cairn {

using contact::momentum_of;
using contact::vector_of;

template <int Dim>
void ContactSweep<Dim>::load_node(const Node& node, const Patch<Dim>& patch, Pass pass, double dt) {
  const std::size_t n = node.count;
  if (momenta_.size() < n) momenta_.resize(n), forces_.resize(n), impulses_.resize(n);
  for (int i = 0; i < node.count; ++i) {
    const auto& entry = entries_[node.first + i];
    const auto& nodes = patch.pieces[entry.piece].nodes;
    forces_[i] = vector_of<Dim>(nodes.force, entry.node);
    if (pass == Pass::repeat)
      momenta_[i] = vector_of<Dim>(nodes.velocity, entry.node);
    else
      momenta_[i] =
          contact::ConstNode<Dim>(contact::sums_at(patch.pieces[entry.piece], entry.node) + NodeSums<Dim>::momentum);
    if (entry.rigid) forces_[i].setZero();
    if (entry.turning >= 0) {
      const auto course = contact::course_of<Dim>(turning_[entry.turning], momenta_[i] / entry.mass, dt);
      momenta_[i] = entry.mass * course.velocity, forces_[i] = entry.mass / dt * course.change;
    }
    if (pass == Pass::second || (pass == Pass::repeat && entry.rigid)) momenta_[i] += dt * forces_[i];
  }
}

template <int Dim>
void ContactSweep<Dim>::first_pass(Patch<Dim>& patch, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings,
                                   double dt) {
  for (const auto& node : nodes_) {
    load_node(node, patch, Pass::first, dt);
    solve(node, patch, lattice, settings, dt, Pass::first);
    for (int i = 0; i < node.count; ++i) {
      auto& entry = entries_[node.first + i];
      entry.record.projected = momenta_[i];
      if (entry.rigid || settings.options.passes == Passes::after) continue;
      entry.record.first = impulses_[i];
      momentum_of(patch.pieces[entry.piece], entry.node) += impulses_[i];
    }
  }
}

template <int Dim>
void ContactSweep<Dim>::second_pass(Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                    const ContactSettings<Dim>& settings, double dt, bool last) {
  const bool only_first = settings.options.passes == Passes::before;
  patch.forget_last_step();
  for (const auto& node : nodes_) {
    load_node(node, patch, Pass::second, dt);
    if (!only_first) solve(node, patch, lattice, settings, dt, Pass::second);
    for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p) pairs_[p].second = pairs_[p].impulse;
    bool touched = false;
    for (int i = 0; i < node.count; ++i) {
      auto& entry = entries_[node.first + i];
      if (entry.rigid) {  // its work is counted with the mean over the step
        entry.record.projected += 0.5 * dt * forces_[i];
        continue;
      }
      auto& piece = patch.pieces[entry.piece];
      if (only_first) {  // its impulse goes to the points, and no longer to the nodes
        impulses_[i] = entry.record.first;
        momentum_of(piece, entry.node) -= impulses_[i];
      }
      entry.record.force = forces_[i];
      entry.record.second = impulses_[i];
      vector_of<Dim>(piece.nodes.force, entry.node) += impulses_[i] / dt;
      touched = touched || !impulses_[i].isZero(0);
    }
    patch.ledger.contact_nodes += touched && node.share > 0;
    for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p) {
      const NodePair<Dim>& pair = pairs_[p];
      const bool both = pair.b != pair.none && !entries_[node.first + pair.b].rigid;
      patch.pressing += node.share / dt * (both ? 2 : 1) * pair.second.norm();
    }
    if (node.share > 0 && settings.keep_contacts) keep_contacts(node, patch, lattice, settings, dt);
    if (node.share > 0 && settings.keep_tools) keep_tools(node, patch, lattice);
    if (last) keep_ledger(node, patch, dt, false);
  }
}

template <int Dim>
void ContactSweep<Dim>::repeat_pass(Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                    const ContactSettings<Dim>& settings, double dt) {
  for (const auto& node : nodes_) {
    load_node(node, patch, Pass::repeat, dt);
    solve(node, patch, lattice, settings, dt, Pass::repeat);
    if (settings.options.release == Release::reaction) take_back(node, dt);
    for (int i = 0; i < node.count; ++i) {
      const auto& entry = entries_[node.first + i];
      if (!entry.rigid) vector_of<Dim>(patch.pieces[entry.piece].nodes.velocity, entry.node) += impulses_[i];
    }
    keep_ledger(node, patch, dt, true);
  }
}

/// What the points got from a node, less the work of walls and rigid bodies there, is what contact made or lost.
template <int Dim>
void ContactSweep<Dim>::keep_ledger(const Node& node, Patch<Dim>& patch, double dt, bool projected_again) const {
  if (node.share == 0) return;
  const double gained = given(node, dt, projected_again), work = driven(node);
  patch.ledger.contact_dissipation -= node.share * gained;
  patch.ledger.contact_gain += node.share * std::max(0.0, gained);
  patch.ledger.boundary_work += node.share * work;
}

template <int Dim>
void ContactSweep<Dim>::keep_contacts(const Node& node, Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                      const ContactSettings<Dim>& settings, double dt) const {
  using S = ContactSum<Dim>;
  const auto body_of = [&](int i) { return patch.pieces[entries_[node.first + i].piece].body; };
  for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p) {
    const NodePair<Dim>& pair = pairs_[p];
    const bool wall = pair.face != pair.none;
    const double size = node.share * pair.second.norm();
    if (pair.crack != pair.none || (!wall && pair.a == node.partner) || !(size > 0)) continue;
    const int body = body_of(pair.a), other = wall ? settings.bodies + pair.face : body_of(node.partner);
    const double sign = body < other ? 1.0 : -1.0;  // impulse on the lower body, normal towards the higher
    Vec<Dim> sliding = Vec<Dim>::Zero();
    if (wall || pair.b != pair.none) sliding = contact::tangential<Dim>(relative_velocity(node, pair), pair.normal);
    double* sum = patch.contacts[std::minmax(body, other)].values.data();
    Vec<Dim> place;  // as seen from where the contact was so far: it may lie across a periodic boundary
    for (int d = 0; d < Dim; ++d) {
      place[d] = lattice.node_position(d, node.place[d]);
      if (sum[0] > 0) place[d] -= lattice.periods_between(d, place[d], sum[S::place + d] / sum[0]);
    }
    sum[0] += size;
    for (int d = 0; d < Dim; ++d) {
      const double impulse = sign * node.share * pair.second[d];
      sum[S::impulse + d] += impulse;
      sum[S::place + d] += size * place[d];
      sum[S::normal + d] += sign * size * pair.normal[d];
      for (int j = 0; j < Dim; ++j) sum[S::moment + d * Dim + j] += impulse * place[j];
    }
    sum[S::slip] += size * dt * sliding.norm();
    sum[S::friction] -= node.share * pair.second.dot(sliding);
    if (pair.law.binds() || pair.decision.stick) sum[S::stuck] += size;
  }
}

/// Walls and rigid bodies take the opposite of what they give.
template <int Dim>
void ContactSweep<Dim>::keep_tools(const Node& node, Patch<Dim>& patch, const Lattice<Dim>& lattice) const {
  const auto& partner = entries_[node.first + node.partner];
  Vec3 x = Vec3::Zero(), impulse = Vec3::Zero();
  for (int d = 0; d < Dim; ++d) x[d] = lattice.node_position(d, node.place[d]);
  for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p) {
    const NodePair<Dim>& pair = pairs_[p];
    const bool wall = pair.face != pair.none;
    if ((!wall && !partner.rigid) || pair.second.isZero(0)) continue;
    const Vec<Dim> velocity = wall ? wall_velocities_[pair.face] : Vec<Dim>(partner.record.projected / partner.mass);
    impulse.head<Dim>() = -node.share * pair.second;
    patch.tools[wall ? pair.face : partner.tool].add(impulse, x, node.share * pair.second.dot(velocity));
  }
}

template class ContactSweep<2>;
template class ContactSweep<3>;

}  // namespace cairn
