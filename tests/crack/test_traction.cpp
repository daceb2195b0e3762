// Laws between the faces of cracks: closed forms, paths of loading and unloading, energies.

#include <gtest/gtest.h>

#include <cmath>

#include "cairn/crack/traction.hpp"

namespace cairn {
namespace {

CohesiveSpec cohesive(CohesiveShape shape, double exponent = 0) {
  CohesiveSpec spec;
  spec.shape = shape, spec.strength = {50e6, 30e6}, spec.energy = {200, 400}, spec.exponent = exponent;
  return spec;
}
Bond holding() {
  Bond bond;
  bond.state = Bond::holds;
  return bond;
}

/// Work per area along a path of openings, by small steps.
double work_along(const TractionLaw& law, Bond& bond, const std::vector<TractionLaw::Modes>& path) {
  constexpr int steps = 20000;
  double work = 0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i)
    for (int s = 0; s < steps; ++s) {
      const auto at = [&](double share) -> TractionLaw::Modes {
        return {path[i][0] + share * (path[i + 1][0] - path[i][0]), path[i][1] + share * (path[i + 1][1] - path[i][1])};
      };
      const auto a = at(static_cast<double>(s) / steps), b = at((s + 1.0) / steps);
      law.follow(a, bond);
      const auto Ta = law.traction(a, bond);
      law.follow(b, bond);
      const auto Tb = law.traction(b, bond);
      for (int m = 0; m < 2; ++m) work += 0.5 * (Ta[m] + Tb[m]) * (b[m] - a[m]);
    }
  return work;
}

TEST(Traction, StrengthAndEnergyOfEachShape) {
  for (const auto shape : {CohesiveShape::triangle, CohesiveShape::linear, CohesiveShape::exponential})
    for (const int mode : {0, 1}) {
      const CohesiveSpec spec = cohesive(shape);
      const TractionLaw law(spec);
      Bond bond = holding();
      const double d_c = 8 * spec.energy[mode] / spec.strength[mode];
      double largest = 0;
      for (int i = 0; i <= 4000; ++i) {
        TractionLaw::Modes d{};
        d[mode] = (mode == 1 ? -1 : 1) * d_c * i / 4000;  // slip either way
        law.follow(d, bond);
        const auto T = law.traction(d, bond);
        EXPECT_GE(T[mode] * d[mode], 0);
        EXPECT_EQ(T[1 - mode], 0);
        largest = std::max(largest, std::abs(T[mode]));
      }
      EXPECT_NEAR(largest / spec.strength[mode], 1, 0.01);
      EXPECT_EQ(bond.state, Bond::broken);
      const double share = shape == CohesiveShape::exponential ? 1 - 9 * std::exp(-8.0) : 1.0;
      EXPECT_NEAR(law.dissipated(bond) / spec.energy[mode], share, 1e-12);
    }
}

/// What the faces take is what is stored and what is dissipated, on any path; unloading goes back to the origin.
TEST(Traction, WorkIsStoredAndDissipated) {
  for (const auto shape : {CohesiveShape::triangle, CohesiveShape::linear, CohesiveShape::exponential})
    for (const double exponent : {0.0, 1.0, 2.0}) {
      const TractionLaw law(cohesive(shape, exponent));
      const double u = 200 / 50e6;
      Bond bond = holding();
      double work = 0, before = 0;
      const std::vector<TractionLaw::Modes> path = {{0, 0},          {0.5 * u, 0},        {0.1 * u, 0.2 * u},
                                                    {0.6 * u, -u},   {-0.1 * u, 0.3 * u}, {1.3 * u, 1.5 * u},
                                                    {9 * u, 1.5 * u}};
      for (std::size_t i = 0; i + 1 < path.size(); ++i) {
        work += work_along(law, bond, {path[i], path[i + 1]});
        const double held = law.stored(path[i + 1], bond) + law.dissipated(bond);
        EXPECT_NEAR(work / held, 1, 1e-3) << i << " exponent " << exponent;
        EXPECT_GE(law.dissipated(bond), before);
        before = law.dissipated(bond);
      }
      EXPECT_EQ(bond.state, Bond::broken);
    }
}

TEST(Traction, ModesTogetherBreakEarlier) {
  const TractionLaw alone(cohesive(CohesiveShape::triangle)), together(cohesive(CohesiveShape::triangle, 1));
  for (const TractionLaw* law : {&alone, &together}) {
    Bond bond = holding();
    const double n = 0.8 * 2 * 200 / 50e6, t = 0.8 * 2 * 400 / 30e6;  // .96 of G_c in the mean, in each mode
    law->follow({n, t}, bond);
    EXPECT_EQ(bond.state, law == &alone ? Bond::holds : Bond::broken);
  }
}

TEST(Traction, AnInterfaceIsElasticAndPerfectWhereItIsNotSoft) {
  InterfaceSpec spec;
  spec.opening = 2e12, spec.sliding = 1e12;
  Bond bond = holding();
  const TractionLaw law(spec);
  EXPECT_EQ(law.traction({1e-6, -2e-6}, bond), (TractionLaw::Modes{2e6, -2e6}));
  EXPECT_EQ(law.traction({-1e-6, 0}, bond), (TractionLaw::Modes{0, 0}));  // by contact
  spec.closing = 4e12;
  EXPECT_EQ(TractionLaw(spec).traction({-1e-6, 0}, bond), (TractionLaw::Modes{-4e6, 0}));
  EXPECT_DOUBLE_EQ(law.stored({1e-6, 2e-6}, bond), 3);
  EXPECT_EQ(law.dissipated(bond), 0);
  EXPECT_EQ(law.largest_stiffness(), 2e12);
}

}  // namespace
}  // namespace cairn
