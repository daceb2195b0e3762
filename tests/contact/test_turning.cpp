// A rigid body that turns, and what sticks to it at a node.

#include <gtest/gtest.h>

#include "../support/node_patch.hpp"

namespace cairn {
namespace {

using namespace test;

/// What sticks has the velocity that takes a point of the turning body from where it was a step ago to where it is, and
/// after the update that which takes it on.
template <int Dim>
void check_course(Release release, bool chords) {
  Random random(11);
  for (int k = 0; k < 20; ++k) {
    std::vector<NodeBody<Dim>> list = {random_body<Dim>(random), random_body<Dim>(random)};
    for (int b = 0; b < 2; ++b) list[b].gradient = (b == 0 ? 1 : -1) * Vec<Dim>::UnitX(), list[b].volume = 1;
    list[0].rigid = true;
    const Vec3 drift = Dim == 3 ? random.vector<3>(1) : Vec3(random(-1, 1), random(-1, 1), 0);
    const Vec3 spin = Dim == 3 ? random.vector<3>(40) : Vec3(0, 0, random(-40, 40));
    const Vec3 arm = Dim == 3 ? random.vector<3>(1) : Vec3(random(-1, 1), random(-1, 1), 0);
    list[0].momentum = list[0].mass * (drift + spin.cross(arm)).template head<Dim>();
    NodePatch<Dim> node(list);
    node.bodies[0].velocity = drift, node.bodies[0].angular_velocity = spin;
    ContactOptions options;
    options.law = ContactLaw::stick, options.release = release;
    auto settings = node.settings(options);
    settings.chords = chords;
    const Mat3 turn = Eigen::AngleAxisd(spin.norm() * node.dt, spin.normalized()).toRotationMatrix();
    const Vec<Dim> tangent = list[0].velocity();
    const Vec<Dim> before = chords ? (drift + (arm - turn.transpose() * arm) / node.dt).template head<Dim>() : tangent;
    const Vec<Dim> after = chords ? (drift + (turn * arm - arm) / node.dt).template head<Dim>() : tangent;
    node.first(settings);
    EXPECT_LE((node.momentum(1) / node.mass(1) - before).norm(), 1e-11);
    node.second(settings);
    EXPECT_LE((node.updated(1) / node.mass(1) - after).norm(), 1e-11);
    node.repeat(settings);
    EXPECT_LE((node.projected(1) / node.mass(1) - after).norm(), 1e-11);
    EXPECT_EQ(node.momentum(0), list[0].momentum);
    // The drive does the work of what reaches the body, along the mean of both.
    const Vec<Dim> impulse = node.dt * (node.force(1) - list[1].force);
    EXPECT_NEAR(node.patch.ledger.boundary_work, impulse.dot(0.5 * (before + after)), 1e-9 * impulse.norm());
  }
}

TEST(TurningBody, TakesWhatSticksToItAlongChords) {
  for (Release release : {Release::reaction, Release::approach})
    for (bool chords : {true, false}) {
      check_course<2>(release, chords);
      check_course<3>(release, chords);
    }
}

}  // namespace
}  // namespace cairn
