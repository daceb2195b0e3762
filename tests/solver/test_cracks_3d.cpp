// Bodies that explicit cracks cut in 3D, through whole steps.

#include <gtest/gtest.h>
#include <mpi.h>

#include <Eigen/Geometry>

#include "../support/crack_cases.hpp"
#include "../support/mpi_environment.hpp"

namespace cairn {
namespace {

using namespace test;

Case falling_block_3d() {
  Case c = block_at_rest_3d();
  c.domain.gravity = Vec3(0.3, -1, 0.2);
  c.bodies[0].angular_velocity = Vec3(0.3, -0.2, 0.5), c.bodies[0].velocity = Vec3(0.1, 0.05, -0.02);
  return c;
}

TEST(Cracks3D, StickingCracksAreNotThere) {
  Case whole = falling_block_3d();
  whole.solver.noise_filter = NoiseFilter::off;  // it sees the fields of the sides, sticking or not
  const auto without = run<3>(whole, 60);
  double largest = 0;
  for (const auto& [id, a] : without) largest = std::max(largest, a.v.norm());
  std::vector<Case> cases(5, whole);
  add_sheets(cases[0], crossing_cracks(), CrackLaw::stick);  // on grid planes
  Line wave;
  for (int i = 0; i <= 16; ++i) wave.push_back(Vec3(0.1 + 0.05 * i, 0.5031 + 0.05 * std::sin(i), 0.1));
  add_sheet(cases[1], wave, Vec3(0.05, 0, 0.8), CrackLaw::stick);
  add_disk(cases[2], Vec3(0.5, 0.47, 0.52), Vec3(0.3, 1, -0.2), 0.21, CrackLaw::stick);
  add_disk(cases[3], Vec3(0.5, 0.5, 0.5), Vec3(0, 0, 1), 0.25, CrackLaw::stick);  // on a grid plane
  add_disk(cases[3], Vec3(0.5, 0.5, 0.5), Vec3(1, 0, 0), 0.25, CrackLaw::stick);
  add_planes(cases[4], CrackLaw::stick);  // eight fields at a node
  for (std::size_t k = 0; k < cases.size(); ++k) {
    double off = 0;
    for (const auto& [id, b] : run<3>(cases[k], 60)) off = std::max(off, (b.v - without.at(id).v).norm() / largest);
    std::printf("sticking cracks, case %zu: off by %.2g\n", k, off);
    EXPECT_LE(off, 1e-12) << "case " << k;
  }
}

/// Frictionless cracks let go: thrown apart, every part keeps its velocity.
TEST(Cracks3D, PartsThrownApartKeepTheirVelocity) {
  std::vector<Case> cases(4, block_at_rest_3d());
  for (int n = 1; n <= 3; ++n) add_sheets(cases[n - 1], star_cracks(n), CrackLaw::frictionless);
  add_planes(cases[3], CrackLaw::frictionless);
  for (const Case& c : cases) {
    SCOPED_TRACE(c.cracks.size());
    Simulation<3> simulation(c, MPI_COMM_SELF);
    set_velocities(simulation, [&](const Vec<3>& x) -> Vec<3> {  // the same for a whole sector
      Vec<3> v = Vec<3>::Zero();
      for (const CrackSpec& crack : c.cracks) {
        const Vec3 n = crack.extrude.cross(crack.points[1] - crack.points[0]).normalized();
        v += ((x - crack.points[0]).dot(n) > 0 ? 0.1 : -0.1) * n;
      }
      return v;
    });
    const auto before = points_of(simulation);
    for (int i = 0; i < 20; ++i) simulation.step(1e300);
    for (const auto& [id, a] : points_of(simulation)) ASSERT_LE((a.v - before.at(id).v).norm(), 1e-13) << id;
    double opened = 0;
    for (const auto& patch : simulation.patches())
      for (const auto& point : patch.cracks)
        if (point.own) opened = std::max(opened, point.opening().norm());
    EXPECT_GT(opened, 0.19 * simulation.time());
  }
}

/// Thrown together, parts hit each other across cracks; momentum stays, and no energy is made.
TEST(Cracks3D, PartsThrownTogetherMakeNoEnergy) {
  for (const double friction : {0.0, 0.3, 1e300}) {
    Case c = block_at_rest_3d();
    add_sheets(c, star_cracks(2), CrackLaw::friction, friction);
    Simulation<3> simulation(c, MPI_COMM_SELF);
    set_velocities(simulation, [](const Vec<3>& x) -> Vec<3> {
      return {x.x() > 0.5 ? -0.2 : 0.2, x.y() > 0.5 ? -0.1 : 0.15, x.y() > 0.5 ? 0.05 : 0.0};
    });
    const Totals start = simulation.totals();
    for (int i = 0; i < 60; ++i) {
      simulation.step(1e300);
      if (i % 10) continue;
      const Totals now = simulation.totals();
      ASSERT_LE(now.kinetic + now.strain, 1.005 * start.kinetic) << "friction " << friction << " step " << i;
      ASSERT_LE((now.momentum - start.momentum).norm(), 1e-13 * start.mass * 0.3);
      ASSERT_NEAR(now.energy(), start.energy(), 0.01 * start.kinetic) << "friction " << friction << " step " << i;
    }
    EXPECT_LT(simulation.totals().kinetic, 0.999 * start.kinetic) << "the parts did not meet";
  }
}

/// A bar of 4 by 4 cells, 4 long, 20 cells a unit.
Case long_bar_3d() {
  Case c = soft_case(3, 20, 10);
  c.domain.upper = Vec3(4, 0.5, 0.5), c.domain.cells = {80, 10, 10};
  add_body(c, BoxShape{Vec3(0.1, 0.15, 0.15), Vec3(3.9, 0.35, 0.35)});
  return c;
}

/// A closed crack lets compression pass and no tension.
TEST(Cracks3D, TensionDoesNotPassACrackAndCompressionDoes) {
  for (const double sign : {-1.0, 1.0}) {
    Case whole = long_bar_3d(), c = long_bar_3d();
    add_sheet(c, {Vec3(2.013, 0.12, 0.12), Vec3(2.013, 0.38, 0.12)}, Vec3(0, 0, 0.26), CrackLaw::friction);
    Simulation<3> cut(c, MPI_COMM_SELF), bar(whole, MPI_COMM_SELF);
    const double v0 = 1e-3;
    for (auto* simulation : {&cut, &bar})
      set_velocities(*simulation, [&](const Vec<3>& x) -> Vec<3> { return {x.x() < 1 ? sign * v0 : 0, 0, 0}; });
    const double c0 = std::sqrt(cut.materials()[0].longitudinal_modulus / 1000);
    while (cut.time() < 1.6 / c0) cut.step(1e300), bar.step(1e300);  // past the crack, not at the end
    double behind = 0, difference = 0, reference = 0;
    const auto of_bar = points_of(bar);
    for (const auto& [id, a] : points_of(cut)) {
      if (a.x.x() > 2.02) behind = std::max(behind, a.v.norm());
      difference = std::max(difference, (a.v - of_bar.at(id).v).norm());
      if (of_bar.at(id).x.x() > 2.02) reference = std::max(reference, of_bar.at(id).v.norm());
    }
    ASSERT_GT(reference, 0.4 * v0) << "the wave is not there yet";
    std::printf("%s: behind the crack %.3g v0, off the bar without one %.3g v0\n", sign > 0 ? "pressed" : "pulled",
                behind / v0, difference / v0);
    if (sign > 0)
      EXPECT_LE(difference, 0.02 * v0);
    else
      EXPECT_LE(behind, 1e-6 * v0);
  }
}

/// A block on a crack plane of 30 degrees slides with x = g (sin - mu cos) t^2/2, and friction takes mu m g cos x.
TEST(SlowCracks3D, ABlockSlidesAlongACrack) {
  Case c = soft_case(3, 60, 10);
  c.domain.upper = Vec3(3, 1.2, 0.7), c.domain.cells = {30, 12, 7};
  const Shape base = BoxShape{Vec3(0.3, 0, 0.1), Vec3(2.4, 0.3, 0.6)},
              block = BoxShape{Vec3(0.6, 0.3, 0.2), Vec3(1.4, 0.7, 0.5)};
  add_body(c, Compound{CompoundOperation::union_of, {base, block}});
  add_sheet(c, {Vec3(0.2, 0.3, 0.05), Vec3(2.6, 0.3, 0.05)}, Vec3(0, 0, 0.6), CrackLaw::friction, 0.3);
  check_sliding<3>(c, 0.3, [](const Vec<3>& x) { return x.x() > 0.6 && x.x() < 1.4 && std::abs(x.z() - 0.35) < 0.15; });
}

/// As in 2D: under pressure from all sides.
TEST(Cracks3D, APressedCrackHasNoStressIntensity) {
  const double pressure = 1, radius = 0.27;
  for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(0.3, 0.5, 0.8), Vec3(1, 1, 0)}) {
    Case c = soft_case(3, 18, 6);
    add_body(c, BoxShape{Vec3(0, 0, 0), Vec3(1, 1, 1)});
    c.bodies[0].initial_pressure = pressure;
    for (auto& face : c.faces) face.type = FaceType::symmetry;
    add_disk(c, Vec3(0.511, 0.487, 0.493), normal, radius, CrackLaw::friction);
    c.cracks[0].friction = 0;
    Simulation<3> simulation(c, MPI_COMM_SELF);
    simulation.step(1e300);
    const double open = 2 * pressure * std::sqrt(radius / M_PI);
    const auto rim = simulation.tip_states();
    ASSERT_GT(rim.size(), 10u);
    for (const auto& tip : rim)
      for (const double K : {tip.K_opening, tip.K_sliding, tip.K_tearing})
        EXPECT_NEAR(K, 0, 0.1 * open) << normal.transpose() << ": " << tip.tip.end;
  }
}

TEST(Cracks3D, ACrackAlongPointsIsAnError) {
  Case c = block_at_rest_3d();
  add_disk(c, Vec3(0.5, 0.5 + 1.0 / 48, 0.5), Vec3(0, 1, 0), 0.3, CrackLaw::friction);
  try {
    Simulation<3> simulation(c, MPI_COMM_SELF);
    FAIL() << "was accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("goes along material points"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace cairn
