// Contact gives no energy: not at nodes of two bodies, nor of several, nor on walls and in corners of them.

#include <gtest/gtest.h>

#include "../support/node_patch.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr int worlds = 2000;

/// Bodies at a node that all touch, with motions and forces at random.
template <int Dim>
std::vector<NodeBody<Dim>> crowd(Random& random, int count) {
  std::vector<NodeBody<Dim>> list;
  for (int b = 0; b < count; ++b) {
    list.push_back(random_body<Dim>(random));
    list.back().force = random.vector<Dim>(400);
  }
  return list;
}

template <int Dim>
FaceConditions<Dim> walls(double mu) {
  FaceConditions<Dim> faces;
  for (auto& face : faces) face.type = FaceType::wall, face.friction = {{ContactLaw::friction, mu}};
  return faces;
}

/// Sends a node through all passes. Points carry the share `returned` of what the nodes give them back to the node.
template <int Dim>
double gain_of(NodePatch<Dim>& node, const ContactSettings<Dim>& settings, double returned) {
  std::vector<Vec<Dim>> start;
  for (std::size_t b = 0; b < node.bodies.size(); ++b) start.push_back(node.momentum(static_cast<int>(b)));
  node.first(settings);
  node.second(settings);
  for (std::size_t b = 0; b < node.bodies.size(); ++b) {
    const Vec<Dim> again = start[b] + returned * node.dt * node.force(static_cast<int>(b));
    std::copy_n(again.data(), Dim, node.patch.pieces[b].nodes.velocity.data());
  }
  node.repeat(settings);
  return node.patch.ledger.contact_gain;
}

template <int Dim>
void check_gain(double mu) {
  Random random(8);
  double lost = 0;
  int touched = 0;
  for (int k = 0; k < worlds; ++k) {
    const int place = k % 2 == 0 ? 3 : 0;  // inside, or in the corner of all lower walls
    NodePatch<Dim> node(crowd<Dim>(random, 1 + k % 4), place);
    const auto settings = node.settings(options_of(ContactLaw::friction, Release::reaction, mu), 1, walls<Dim>(mu));
    const double gain = gain_of(node, settings, random(0, 1));
    EXPECT_LE(gain, 1e-12) << "node " << k;
    lost += node.patch.ledger.contact_dissipation, touched += node.patch.ledger.contact_nodes > 0;
  }
  EXPECT_GT(lost, 0);
  EXPECT_GT(touched, worlds / 4);
}
TEST(ContactGain, NoneAtAnyNodeWithoutFriction) {
  check_gain<2>(0);
  check_gain<3>(0);
}
TEST(ContactGain, NoneAtAnyNodeWithFriction) {
  for (double mu : {0.3, 1.0, std::numeric_limits<double>::infinity()}) {
    check_gain<2>(mu);
    check_gain<3>(mu);
  }
}

/// Where forces stay as they are, what several bodies take on the nodes and what their points get are adjoint: held
/// pairs exchange no energy at all, whatever is projected again.
template <int Dim>
void check_adjoint() {
  Random random(9);
  for (int k = 0; k < worlds; ++k) {
    auto list = crowd<Dim>(random, 2 + k % 3);
    for (std::size_t b = 1; b < list.size(); ++b) {  // the first is the partner; all others are pressed against it
      list[0].mass = 5;
      const Vec<Dim> n = random.vector<Dim>(1).normalized();
      list[b].gradient = 9 * n, list[0].gradient = 1e-3 * Vec<Dim>::UnitX();
      list[b].force = 1e5 * list[b].mass * n, list[b].momentum = list[b].mass * n;
    }
    list[0].force.setZero(), list[0].momentum.setZero();
    NodePatch<Dim> node(list);
    const auto settings = node.settings(options_of(ContactLaw::friction, Release::reaction, 1e9));
    node.first(settings);
    node.second(settings);
    double scale = 0;
    for (std::size_t b = 0; b < list.size(); ++b) {
      const Vec<Dim> again = random.vector<Dim>(3);
      std::copy_n(again.data(), Dim, node.patch.pieces[b].nodes.velocity.data());
      scale += node.dt * list[b].force.norm() * (1 + again.norm()) / list[b].mass;
    }
    const double before = node.patch.ledger.contact_dissipation;
    node.repeat(settings);
    EXPECT_LE(std::abs(node.patch.ledger.contact_dissipation - before), 1e-12 * scale) << "node " << k;
  }
}
TEST(ContactGain, NodesOfSeveralBodiesAreAdjoint) {
  check_adjoint<2>();
  check_adjoint<3>();
}

}  // namespace
}  // namespace cairn
