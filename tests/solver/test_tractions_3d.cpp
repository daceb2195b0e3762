// Interfaces and cohesive laws of cracks in 3D, through whole steps.

#include <gtest/gtest.h>
#include <mpi.h>

#include <Eigen/Geometry>

#include "../support/crack_cases.hpp"
#include "../support/mpi_environment.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr double width = 4, area = width * width;

/// A column `height` cells high and 4 by 4 wide between rollers, on a fixed floor, its top pulled (and shifted)
/// steadily; a crack from side to side in its middle.
Case column(int height, double pull, double shift, CrackLaw law) {
  Case c = soft_case(3, height, 8);
  c.domain.upper = Vec3(width, height, width), c.domain.cells = {4, height, 4};
  add_body(c, BoxShape{Vec3(0, 0, 0), c.domain.upper});
  c.faces[2].type = c.faces[3].type = FaceType::fixed;
  c.faces[3].velocity = Vec3(shift, pull, 0);
  for (const int face : {0, 1, 4, 5}) c.faces[face].type = FaceType::symmetry;
  if (shift != 0) c.domain.periodic = {true, false, false};
  const double at = 0.5 * height + 0.17;
  add_sheet(c, {Vec3(0, at, 0), Vec3(width, at, 0)}, Vec3(0, 0, width), law, 0);
  return c;
}

/// delta = s (L/M + 1/D) for a stress s, in shear.
TEST(SlowTractions3D, AnInterfaceGivesByItsStiffness) {
  const double M = 4e3, L = 10, D = M / 4;
  Case c = column(static_cast<int>(L), 0, 1e-4, CrackLaw::interface);
  c.cracks[0].interface.opening = c.cracks[0].interface.sliding = D;
  Simulation<3> simulation(c, MPI_COMM_SELF);
  while (simulation.time() < 40 * L / std::sqrt(M / 1000)) simulation.step(1e300);
  double stress = 0, volume = 0;
  for (const auto& [id, p] : points_of(simulation))
    stress += p.mass * p.stress.c[symmetric_index<3>(0, 1)], volume += p.mass;
  stress /= volume;
  const double delta = 1e-4 * simulation.time();
  std::printf("interface, shear: delta / (s (L/M + 1/D)) = %.4f\n", delta / (stress * (L / M + 1 / D)));
  EXPECT_NEAR(delta / (stress * (L / M + 1 / D)), 1, 0.01);
  const Totals t = simulation.totals();
  EXPECT_NEAR(t.crack_energy / (0.5 * stress * stress / D * area), 1, 0.05);
  EXPECT_NEAR(t.energy() / t.boundary_work, 0, 0.01) << "of the work of the grips";
  EXPECT_EQ(t.crack_dissipation, 0);
}

/// Halves pulled or shifted apart: what the crack took is G_c times its area, and the grips gave no more.
TEST(SlowTractions3D, HalvesPulledApartTakeTheEnergyOfTheLaw) {
  for (const bool shear : {false, true})
    for (const auto shape : {CohesiveShape::triangle, CohesiveShape::exponential}) {
      const double M = shear ? 4e3 : soft_bulk + 4.0 / 3 * 4e3, L = 8, speed = 4e-4;
      Case c = column(static_cast<int>(L), shear ? 0 : speed, shear ? speed : 0, CrackLaw::cohesive);
      CohesiveSpec& law = c.cracks[0].cohesive;
      set_pulled_law(law, shape, M);
      c.solver.noise_filter = NoiseFilter::off;
      Simulation<3> simulation(c, MPI_COMM_SELF);
      double before = 0, worst = 0;
      const double G = law.energy[0] * area, share = shape == CohesiveShape::exponential ? 1 - 9 * std::exp(-8.0) : 1;
      const double critical = shape == CohesiveShape::exponential ? 0.3 : 0.2;
      for (int step = 0; speed * simulation.time() < 2 * critical; ++step) {
        simulation.step(1e300);
        if (step % 10 != 0) continue;
        const Totals t = simulation.totals();
        EXPECT_GE(t.crack_dissipation, before - 1e-12 * G);
        before = t.crack_dissipation, worst = std::max(worst, std::abs(t.energy()));
      }
      const Totals t = simulation.totals();
      const double work = t.boundary_work - t.kinetic - t.strain;
      std::printf("%s, shape %d: crack's work %.4f of G_c A, grips' %.4f, book off by %.4f of G_c A\n",
                  shear ? "shear" : "tension", static_cast<int>(shape), t.crack_dissipation / G, work / G, worst / G);
      EXPECT_NEAR(t.crack_dissipation / G, share, 0.002);
      EXPECT_NEAR(work / G, 1, 0.03);
      EXPECT_LE(worst / G, 0.03);
    }
}

/// Every point of a surface stands for a third of its triangles; only what lies in the body counts.
TEST(Tractions3D, AreasAreThoseOfTheBodysCut) {
  Case c = block_at_rest_3d();
  add_sheet(c, {Vec3(0.05, 0.51, 0.05), Vec3(0.95, 0.51, 0.05)}, Vec3(0, 0, 0.9), CrackLaw::cohesive);
  add_disk(c, Vec3(0.5, 0.4, 0.5), Vec3(0, 1, 0), 0.2, CrackLaw::cohesive);
  for (auto& crack : c.cracks) crack.cohesive.strength = {300, 200}, crack.cohesive.energy = {1, 2};
  Simulation<3> simulation(c, MPI_COMM_SELF);
  std::array<double, 2> areas{};
  for (const auto& patch : simulation.patches())
    for (const auto& point : patch.cracks)
      if (point.own) areas[point.crack] += point.bond.length;
  EXPECT_NEAR(areas[0] / (4.0 / 9), 1, 0.01);
  EXPECT_NEAR(areas[1] / (M_PI * 0.04), 1, 0.02);
}

}  // namespace
}  // namespace cairn
