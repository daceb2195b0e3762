#pragma once
/// A patch made by hand: bodies known only by their sums at one node.

#include <limits>
#include <vector>

#include "cairn/contact/sweep.hpp"
#include "random.hpp"

namespace cairn::test {

/// What one body has at the node.
template <int Dim>
struct NodeBody {
  double mass = 1, volume = 1;
  Vec<Dim> momentum = Vec<Dim>::Zero(), gradient = Vec<Dim>::UnitX(), force = Vec<Dim>::Zero();
  double stress_xx = 0;                  // volume times stress [Pa m^Dim]
  Vec<Dim> position = Vec<Dim>::Zero();  // mean position relative to the node [m]
  int material = 0;
  bool rigid = false;
  Vec<Dim> velocity() const { return momentum / mass; }
};

template <int Dim>
struct NodePatch {
  static constexpr double dt = 0.01;
  static constexpr double modulus = 1e6, wave_speed = 30;  // [Pa], [m/s]
  Lattice<Dim> lattice;
  Patch<Dim> patch;
  std::vector<Body> bodies;
  Index<Dim> place;
  ContactSweep<Dim> sweep;

  explicit NodePatch(const std::vector<NodeBody<Dim>>& list, int at = 3)
      : lattice(Vec<Dim>::Zero(), Vec<Dim>::Constant(8), cells(), {}, 8), patch(0, lattice) {
    place.fill(at);
    for (const auto& body : list) add(body);
  }
  static Index<Dim> cells() {
    Index<Dim> n;
    n.fill(8);
    return n;
  }
  void add(const NodeBody<Dim>& from) {
    using N = NodeSums<Dim>;
    using E = NodeExtras<Dim>;
    const int id = static_cast<int>(bodies.size());
    Body body;
    body.material = from.material, body.rigid = from.rigid;
    bodies.push_back(body);
    auto& nodes = patch.piece_of(id, 0).nodes;
    nodes.box.lower = nodes.box.upper = place;
    for (auto& u : nodes.box.upper) ++u;
    nodes.own = nodes.box;
    nodes.sums.assign(N::width, 0.0), nodes.force.assign(vector_width, 0.0);
    nodes.velocity.assign(vector_width, 0.0), nodes.extras.assign(E::width, 0.0);
    nodes.sums[N::mass] = from.mass, nodes.sums[N::volume] = from.volume;
    nodes.extras[E::stress] = from.stress_xx;
    for (int d = 0; d < Dim; ++d) {
      nodes.sums[N::momentum + d] = nodes.velocity[d] = from.momentum[d];
      nodes.sums[N::gradient + d] = from.gradient[d];
      nodes.force[d] = from.force[d];
      nodes.extras[E::position + d] = from.volume * from.position[d];
    }
  }
  ContactSettings<Dim> settings(const ContactOptions& options, int materials = 1,
                                const FaceConditions<Dim>& faces = {}) const {
    return ContactSettings<Dim>::make(options, std::vector<ContactMaterial>(materials, {modulus, wave_speed}), faces);
  }
  double mass(int b) const { return patch.pieces[b].nodes.sums[NodeSums<Dim>::mass]; }
  Vec<Dim> momentum(int b) const {
    return Eigen::Map<const Vec<Dim>>(patch.pieces[b].nodes.sums.data() + NodeSums<Dim>::momentum);
  }
  Vec<Dim> force(int b) const { return Eigen::Map<const Vec<Dim>>(patch.pieces[b].nodes.force.data()); }
  Vec<Dim> projected(int b) const { return Eigen::Map<const Vec<Dim>>(patch.pieces[b].nodes.velocity.data()); }
  /// The points carry all of the updated momentum back to the node.
  void project_updated() {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const Vec<Dim> p = updated(static_cast<int>(b));
      std::copy_n(p.data(), Dim, patch.pieces[b].nodes.velocity.data());
    }
  }
  /// Momentum after the update.
  Vec<Dim> updated(int b) const { return momentum(b) + dt * force(b); }

  void first(const ContactSettings<Dim>& s) {
    sweep.find(patch, lattice, s, bodies);
    sweep.first_pass(patch, lattice, s, dt);
  }
  void second(const ContactSettings<Dim>& s) { sweep.second_pass(patch, lattice, s, dt, false); }
  void repeat(const ContactSettings<Dim>& s) { sweep.repeat_pass(patch, lattice, s, dt); }
};

template <int Dim>
NodeBody<Dim> random_body(Random& random) {
  NodeBody<Dim> body;
  body.mass = random(0.2, 3), body.volume = random(0.2, 1);
  body.momentum = random.vector<Dim>(2), body.gradient = random.vector<Dim>(1), body.force = random.vector<Dim>(100);
  body.stress_xx = random(-1e3, 1e3);
  return body;
}

/// A law that asks for no volume at the node.
inline ContactOptions options_of(ContactLaw law, Release release = Release::reaction, double mu = 0.3) {
  ContactOptions options;
  options.law = law, options.release = release, options.friction = mu;
  options.gap = GapRule::fill, options.fill = 0;
  return options;
}

/// Two bodies of mass 1 and 3 at the node: body 0 on the left comes to the right and rubs upwards.
inline std::vector<NodeBody<2>> meeting_pair() {
  NodeBody<2> left, right;
  left.mass = 1, left.momentum = Vec<2>(4, 2), left.gradient = Vec<2>(2, 0);
  right.mass = 3, right.momentum = Vec<2>(0, 0), right.gradient = Vec<2>(-1, 0);
  return {left, right};
}

}  // namespace cairn::test
