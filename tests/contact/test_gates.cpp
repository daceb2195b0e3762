// Which bodies at a node count as in contact, by volume, mean positions, tractions and mass.

#include <gtest/gtest.h>

#include "../support/node_patch.hpp"
#include "../support/random.hpp"

namespace cairn {
namespace {

using namespace test;
using V = Vec<2>;

bool acts(const std::vector<NodeBody<2>>& list, const ContactOptions& options, int at = 3,
          const std::array<FaceType, 4>& types = {}) {
  NodePatch<2> node(list, at);
  FaceConditions<2> faces;
  for (int f = 0; f < 4; ++f) faces[f].type = types[f], faces[f].friction = {{ContactLaw::frictionless, 0}};
  node.first(node.settings(options, 1, faces));
  return node.momentum(0) != list[0].momentum;
}

/// A layer from s to s + t cells above the node, seen by a linear hat: volume and size of the gradient.
std::pair<double, double> layer(double s, double t) {
  const auto below = [](double x) {  // of the hat's volume, what lies below x
    x = std::clamp(x, -1.0, 1.0);
    return x < 0 ? 0.5 * (1 + x) * (1 + x) : 1 - 0.5 * (1 - x) * (1 - x);
  };
  const auto hat = [](double x) { return std::max(0.0, 1 - std::abs(x)); };
  return {below(s + t) - below(s), std::abs(hat(s) - hat(s + t))};
}

/// Gives a body the share |side| of a layer, with the outward normal along side times x.
void set_layer(NodeBody<2>& body, const std::pair<double, double>& layer, double side) {
  body.volume = std::abs(side) * layer.first, body.gradient = V(side * layer.second, 0);
}

TEST(ContactGates, PlaceOfASurfaceFromVolumeAndGradient) {
  Random random(5);
  for (int k = 0; k < 1000; ++k) {
    const double thickness = random(0.05, 1.5), s = random(std::max(-0.95, -0.5 * thickness), 0.95);  // s: near surface
    const auto [v, g] = layer(s, thickness);
    EXPECT_NEAR(contact::distance_to_surface(v, g), s, 1e-7) << thickness;
  }
  EXPECT_EQ(contact::distance_to_surface(1, 0), -1);  // deep inside
}

TEST(ContactGates, BodiesTouchAcrossSmallGapsHoweverThinTheyAre) {
  ContactOptions options = options_of(ContactLaw::friction);
  options.fill = 0.8;
  const double largest = contact::TouchingGap::make(options, false).most;
  EXPECT_NEAR(largest - largest * largest / 2, 0.2, 1e-15);  // what the gap leaves empty, the node on a surface
  auto list = meeting_pair();
  const auto apart = [&](double gap, double node, double thickness, double share = 1) {
    set_layer(list[0], layer(node, 3), share);
    set_layer(list[1], layer(gap - node, thickness), -share);
    return list;
  };
  for (double thickness : {0.2, 0.5, 3.0})
    for (double node : {-0.4, 0.0, 0.1}) {
      EXPECT_FALSE(acts(apart(largest + 1e-6, node, thickness), options)) << thickness << ' ' << node;
      EXPECT_TRUE(acts(apart(largest - 1e-6, node, thickness), options)) << thickness << ' ' << node;
    }
  // On a wall half a cell is full, a quarter in the corner of two; a fixed face admits no contact at all.
  const FaceType w = FaceType::wall, f = FaceType::free;
  EXPECT_FALSE(acts(apart(largest + 1e-6, 0.1, 0.5, 0.5), options, 0, {w, f, f, f}));
  EXPECT_TRUE(acts(apart(largest - 1e-6, 0.1, 0.5, 0.5), options, 0, {w, f, f, f}));
  EXPECT_TRUE(acts(apart(largest - 1e-6, 0.1, 0.5, 0.25), options, 8, {f, w, f, w}));
  EXPECT_FALSE(acts(apart(largest - 1e-6, 0.1, 0.5, 0.25), options, 0, {f, w, f, w}));  // those walls are far away
  EXPECT_FALSE(acts(apart(0, 0, 3), options, 0, {FaceType::fixed, f, f, f}));
  // Only the predicted reaction asks; sticking joins whatever there is; without `fill` so does contact.
  options.release = Release::approach;
  EXPECT_TRUE(acts(apart(0.9, 0.1, 3), options));
  options.release = Release::reaction, options.law = ContactLaw::stick;
  EXPECT_TRUE(acts(apart(0.9, 0.1, 3), options));
  options.law = ContactLaw::friction, options.fill = 0;
  EXPECT_TRUE(acts(apart(0.9, 0.1, 3), options));
}

TEST(ContactGates, TheNearestBodyDecides) {
  ContactOptions options = options_of(ContactLaw::friction);
  options.fill = 0.8;
  auto list = meeting_pair();  // a thin plate between two bodies: the left one touches the plate, not the other
  set_layer(list[0], layer(0, 3), 1);
  set_layer(list[1], layer(0.3, 3), -1);
  EXPECT_FALSE(acts(list, options));
  list.push_back(list[1]);
  set_layer(list[2], layer(0, 0.3), -1);
  list[2].mass = 0.5;
  EXPECT_TRUE(acts(list, options));
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
