// Which bodies at a node count as in contact, by volume, mean positions, tractions and mass.

#include <gtest/gtest.h>

#include "../support/node_patch.hpp"

namespace cairn {
namespace {

using namespace test;
using V = Vec<2>;

bool acts(const std::vector<NodeBody<2>>& list, const ContactOptions& options, int at = 3,
          const std::array<FaceType, 6>& faces = {}) {
  NodePatch<2> node(list, at);
  node.first(node.settings(options, 1, faces));
  return node.momentum(0) != list[0].momentum;
}

TEST(ContactGates, FillAsksForEnoughVolumeAtTheNode) {
  ContactOptions options = options_of(ContactLaw::friction);
  options.fill = 0.8;
  auto list = meeting_pair();
  const auto with_volume = [&](double a, double b) {
    list[0].volume = a, list[1].volume = b;
    return list;
  };
  EXPECT_FALSE(acts(with_volume(0.40, 0.39), options));  // of a cell's volume, 1
  EXPECT_TRUE(acts(with_volume(0.40, 0.41), options));
  // On a wall half a cell is full (a quarter in the corner of two); a fixed face admits no contact at all.
  const FaceType w = FaceType::wall, f = FaceType::free;
  EXPECT_FALSE(acts(with_volume(0.20, 0.19), options, 0, {w, f, f, f}));
  EXPECT_TRUE(acts(with_volume(0.20, 0.21), options, 0, {w, f, f, f}));
  EXPECT_TRUE(acts(with_volume(0.10, 0.11), options, 0, {w, f, w, f}));
  EXPECT_FALSE(acts(with_volume(0.10, 0.11), options, 0, {f, w, f, w}));  // those walls are far away
  EXPECT_TRUE(acts(with_volume(0.10, 0.11), options, 8, {f, w, f, w}));
  EXPECT_FALSE(acts(with_volume(0.9, 0.9), options, 0, {FaceType::fixed, f, f, f}));
  // Only the predicted reaction asks; sticking joins whatever there is.
  options.release = Release::approach;
  EXPECT_TRUE(acts(with_volume(0.1, 0.1), options));
  options.release = Release::reaction, options.law = ContactLaw::stick;
  EXPECT_TRUE(acts(with_volume(0.1, 0.1), options));
}

TEST(ContactGates, SeparationComparesMeanPositions) {
  ContactOptions options = options_of(ContactLaw::friction, Release::approach);
  options.separation = 0.8;
  auto list = meeting_pair();
  const auto apart = [&](double gap) {
    list[0].position = V(-0.3, 0.7), list[1].position = V(gap - 0.3, -0.2);
    list[0].volume = 0.3, list[1].volume = 0.7;
    return list;
  };
  EXPECT_FALSE(acts(apart(0.81), options));
  EXPECT_TRUE(acts(apart(0.79), options));
  options.separation = 0;
  EXPECT_TRUE(acts(apart(0.81), options));
}

TEST(ContactGates, TractionIsThatOfTheNodeOrOfTheBody) {
  ContactOptions options = options_of(ContactLaw::friction, Release::traction);
  auto list = meeting_pair();
  list[0].momentum = V(-4, 0);  // departing
  const auto with_stress = [&](double a, double b) {
    list[0].stress_xx = a, list[1].stress_xx = b;
    return list;
  };
  EXPECT_TRUE(acts(with_stress(-3, 2), options));   // compressive together
  EXPECT_FALSE(acts(with_stress(-2, 3), options));  // in tension together
  // Below 1e-9 of the modulus times the volume, 2e-3, it counts as free of stress: departing bodies part.
  EXPECT_FALSE(acts(with_stress(-1e-3, 0), options));
  EXPECT_TRUE(acts(with_stress(-3e-3, 0), options));
  // Body by body: body 0 looks at its own.
  options.gate = Gate::body;
  EXPECT_TRUE(acts(with_stress(-2, 3), options));
  EXPECT_FALSE(acts(with_stress(2, -3), options));
  // Approaching and free of stress: in contact.
  list[0].momentum = V(4, 2);
  EXPECT_TRUE(acts(with_stress(0, 0), options));
  EXPECT_FALSE(acts(with_stress(1, 1), options));
}

TEST(ContactGates, TracesOfMassAreScreened) {
  auto list = meeting_pair();
  const ContactOptions options = options_of(ContactLaw::friction, Release::approach);
  list[0].mass = 2e-6, list[0].momentum *= list[0].mass;
  list[1].mass = 1;
  EXPECT_TRUE(acts(list, options));
  list[0].momentum *= 0.25, list[0].mass *= 0.25;
  EXPECT_FALSE(acts(list, options));
}

}  // namespace
}  // namespace cairn
