// The laws of contact at a node: numbers worked out by hand, and what must hold for any numbers.

#include <gtest/gtest.h>

#include <limits>

#include "../support/random.hpp"
#include "cairn/contact/laws.hpp"

namespace cairn::contact {
namespace {

using test::Random;
using V = Vec<2>;

constexpr double infinity = std::numeric_limits<double>::infinity();
const V x(1, 0);

void expect_vector(const V& found, const V& expected) {
  EXPECT_NEAR(found[0], expected[0], 1e-14);
  EXPECT_NEAR(found[1], expected[1], 1e-14);
}

TEST(ApproachLaw, WorkedByHand) {
  expect_vector(approach_impulse<2>(V(3, 4), x, 0.5), V(-3, -1.5));
  expect_vector(approach_impulse<2>(V(3, 4), x, 0), V(-3, 0));
  expect_vector(approach_impulse<2>(V(3, 4), x, 2), V(-3, -4));  // sticks: 6 would be allowed
  expect_vector(approach_impulse<2>(V(3, 4), x, infinity), V(-3, -4));
  expect_vector(approach_impulse<2>(V(-3, 4), x, infinity), V(0, 0));
  expect_vector(approach_impulse<2>(V(0, 4), x, infinity), V(0, 0));  // no 0 x infinity
  expect_vector(approach_impulse<2>(V(3, 0), x, infinity), V(-3, 0));
  expect_vector(approach_impulse<2>(V(5, 0), V(0.6, 0.8), 0.25),
                V(-3, 0.0) * 0.6 + V(0, -3) * 0.8 - 0.75 * V(0.8, -0.6));
}

TEST(FrictionLimit, IsNeverNegativeNorUndefined) {
  EXPECT_EQ(friction_limit(0.5, 3), 1.5);
  EXPECT_EQ(friction_limit(0.5, -3), 0);
  EXPECT_EQ(friction_limit(infinity, 0), 0);
  EXPECT_EQ(friction_limit(infinity, -1), 0);
  EXPECT_EQ(friction_limit(infinity, 1), infinity);
  EXPECT_EQ(friction_limit(0, 1e300), 0);
}

/// Impulses that may only push: no pull, friction below mu N, against the sliding and never beyond rest.
template <int Dim>
void check_coulomb(const Vec<Dim>& P, const Vec<Dim>& n, double mu, const Vec<Dim>& impulse) {
  const double normal = -impulse.dot(n);
  const Vec<Dim> slip = tangential<Dim>(P, n), friction = tangential<Dim>(impulse, n);
  EXPECT_GE(normal, -1e-15 * P.norm());
  EXPECT_NEAR(normal, std::max(0.0, P.dot(n)), 1e-14 * P.norm());
  EXPECT_LE(friction.norm(), friction_limit(mu, normal) * (1 + 1e-13) + 1e-14 * P.norm());
  EXPECT_LE(friction.dot(slip), 1e-14 * P.squaredNorm());
  EXPECT_GE((slip + friction).dot(slip), -1e-14 * P.squaredNorm());
  EXPECT_LE((friction * slip.norm() + slip * friction.norm()).norm(), 1e-13 * P.squaredNorm());  // parallel
  if (P.dot(n) <= 0) {
    EXPECT_EQ(impulse.norm(), 0);
  } else if (mu == infinity) {
    EXPECT_LE((P + impulse).norm(), 1e-14 * P.norm());
  } else if ((slip + friction).norm() > 1e-13 * P.norm()) {  // what slides meets the whole friction
    EXPECT_NEAR(friction.norm(), mu * normal, 1e-13 * P.norm());
  }
}

template <int Dim>
void check_pushing_laws() {
  Random random;
  for (int k = 0; k < 2000; ++k) {
    const Vec<Dim> P = random.vector<Dim>(3), n = random.unit_vector<Dim>();
    for (double mu : {0.0, 0.3, 2.0, infinity}) {
      check_coulomb<Dim>(P, n, mu, approach_impulse<Dim>(P, n, mu));
      check_coulomb<Dim>(P, n, mu, reaction_impulse<Dim>(P, n, {true, false}, mu));
      check_coulomb<Dim>(P, n, mu, reaction_impulse<Dim>(P, n, {true, true}, mu));
      EXPECT_EQ(reaction_impulse<Dim>(P, n, {false, false}, mu).norm(), 0);
    }
  }
}
TEST(PushingLaws, ObeyCoulombAndNeverPull) {
  check_pushing_laws<2>();
  check_pushing_laws<3>();
}

TEST(ReactionLaw, DecidesFromThePredictedMomentum) {
  const double dt = 0.1;
  const auto decide = [&](const V& P, const V& F, double mu) { return decide_by_reaction<2>(P, F, x, mu, dt); };
  // Departing, but pressed together by the end of the step: (-1, 0) + 0.1 (30, 10) = (2, 1); friction can carry mu 3.
  EXPECT_TRUE(decide(V(-1, 0), V(30, 10), 0.3).hold);
  EXPECT_FALSE(decide(V(-1, 0), V(30, 10), 0.3).stick);
  EXPECT_TRUE(decide(V(-1, 0), V(30, 10), 0.34).stick);
  // Approaching, but thrown apart: (1, 0) + 0.1 (-30, 0) = (-2, 0).
  EXPECT_FALSE(decide(V(1, 0), V(-30, 0), 0.3).hold);
  EXPECT_FALSE(decide(V(1, 0), V(-30, 0), infinity).stick);
  // Held by its momentum against a pull: friction has nothing to stand on, whatever mu.
  EXPECT_TRUE(decide(V(3, 0.1), V(-10, 0), infinity).hold);
  EXPECT_FALSE(decide(V(3, 0.1), V(-10, 0), infinity).stick);
  // Just touching at rest is not held.
  EXPECT_FALSE(decide(V(0, 0), V(0, 0), 0.3).hold);
  EXPECT_FALSE(decide(V(0, 1), V(0, 0), 0.3).hold);
  // Without friction nothing that slides sticks; infinite friction under load does.
  EXPECT_FALSE(decide(V(1, 1), V(5, 0), 0.0).stick);
  EXPECT_TRUE(decide(V(1, 1), V(5, 0), infinity).stick);
}

TEST(ReactionLaw, HoldsWithoutAskingForTheDirection) {
  expect_vector(hold_impulse<2>(V(3, 4), x, {true, false}), V(-3, 0));
  expect_vector(hold_impulse<2>(V(-3, 4), x, {true, false}), V(3, 0));
  expect_vector(hold_impulse<2>(V(-3, 4), x, {true, true}), V(3, -4));
  expect_vector(hold_impulse<2>(V(3, 4), x, {false, false}), V(0, 0));
}

TEST(ReactionLaw, GivesThePointsWhatTheNodeReceives) {
  expect_vector(reaction_impulse<2>(V(3, 4), x, {true, false}, 0.5), V(-3, -1.5));
  expect_vector(reaction_impulse<2>(V(3, 1), x, {true, false}, 0.5), V(-3, -1));
  expect_vector(reaction_impulse<2>(V(-3, 4), x, {true, true}, 0.5), V(0, 0));
  expect_vector(reaction_impulse<2>(V(3, 4), x, {false, false}, 0.5), V(0, 0));
}

TEST(TractionLaw, ApproachingPairsRubLikeOthers) {
  for (DepartingFriction departing :
       {DepartingFriction::none, DepartingFriction::coulomb, DepartingFriction::printed}) {
    expect_vector(traction_impulse<2>(V(3, 4), x, 0.5, true, false, departing), V(-3, -1.5));
    expect_vector(traction_impulse<2>(V(3, 4), x, 0.5, false, true, departing), V(-3, -1.5));
    // In tension: let go, approaching or not. Free of stress and departing: let go.
    expect_vector(traction_impulse<2>(V(3, 4), x, 0.5, false, false, departing), V(0, 0));
    expect_vector(traction_impulse<2>(V(-3, 4), x, 0.5, false, false, departing), V(0, 0));
    expect_vector(traction_impulse<2>(V(-3, 4), x, 0.5, false, true, departing), V(0, 0));
  }
}

TEST(TractionLaw, DepartingPairsUnderPressureAreHeld) {
  const auto departing = [](DepartingFriction kind, double mu) {
    return traction_impulse<2>(V(-3, 4), x, mu, true, false, kind);
  };
  expect_vector(departing(DepartingFriction::none, 0.5), V(3, 0));
  expect_vector(departing(DepartingFriction::none, infinity), V(3, 0));
  expect_vector(departing(DepartingFriction::coulomb, 0.5), V(3, -1.5));
  expect_vector(departing(DepartingFriction::coulomb, infinity), V(3, -4));
  expect_vector(departing(DepartingFriction::printed, 0.5), V(3, -4));  // complete sticking at any mu
  expect_vector(departing(DepartingFriction::printed, 0.0), V(3, -4));
}

TEST(ImpulseLimit, WorkedByHand) {
  const V spacing(0.5, 0.25), impulse(-6, 2);  // of mass 2: 3 m/s over 0.5 m and 1 m/s over 0.25 m: 6 cells a second
  const auto scale = [&](double rest, double gamma) { return impulse_scale<2>(impulse, 2, rest, spacing, gamma, 0.1); };
  EXPECT_EQ(scale(8, 0), 1);
  EXPECT_EQ(scale(8, 0.7), 1);
  EXPECT_NEAR(scale(8, 0.3), 0.5, 1e-15);
  EXPECT_NEAR(scale(1, 0.3), 0.25, 1e-15);  // a partner of half the mass moves twice as fast
  EXPECT_NEAR(scale(infinity, 0.3), 0.5, 1e-15);
  EXPECT_EQ(impulse_scale<2>(V(0, 0), 2, 8, spacing, 0.3, 0.1), 1);
}

template <int Dim>
void check_scales_alike() {
  Random random;
  for (int k = 0; k < 500; ++k) {
    const Vec<Dim> impulse = random.vector<Dim>(3);
    const Vec<Dim> spacing = random.vector<Dim>(1).cwiseAbs() + Vec<Dim>::Constant(0.1);
    const double a = random(0.1, 5), b = random(0.1, 5), dt = 0.1, gamma = 0.2;
    const double mine = impulse_scale<Dim>(impulse, a, b, spacing, gamma, dt);
    EXPECT_NEAR(mine, impulse_scale<Dim>(-impulse, b, a, spacing, gamma, dt), 1e-14);
    EXPECT_GT(mine, 0);
    EXPECT_LE(mine, 1);
    for (double mass : {a, b})  // neither body crosses more than gamma cells a step
      EXPECT_LE((mine * impulse / mass).cwiseQuotient(spacing).cwiseAbs().maxCoeff() * dt, gamma * (1 + 1e-13));
  }
}
TEST(ImpulseLimit, TreatsBothPartnersAlike) {
  check_scales_alike<2>();
  check_scales_alike<3>();
}

}  // namespace
}  // namespace cairn::contact
