// Interfaces and cohesive laws of cracks, through whole steps.

#include <gtest/gtest.h>
#include <mpi.h>

#include "../support/crack_cases.hpp"
#include "../support/mpi_environment.hpp"

namespace cairn {
namespace {

using namespace test;

/// A column `height` cells high and 6 wide between rollers, on a fixed floor, its top pulled (and shifted) steadily; a
/// crack from side to side in its middle.
Case column(int height, double pull, double shift, CrackLaw law) {
  Case c = soft_case(2, height, 8);
  c.domain.upper = Vec3(6.0, height, 0), c.domain.cells = {6, height, 1};
  add_body(c, BoxShape{Vec3(0, 0, 0), c.domain.upper});
  if (shift == 0)
    c.faces[0].type = c.faces[1].type = FaceType::symmetry;
  else
    c.domain.periodic = {true, false, false};
  c.faces[2].type = c.faces[3].type = FaceType::fixed;
  c.faces[3].velocity = Vec3(shift, pull, 0);
  add_crack(c, {Vec3(0, 0.5 * height + 0.17, 0), Vec3(6, 0.5 * height + 0.17, 0)}, law, 0);
  return c;
}

/// delta = s (L/M + 1/D) for a stress s, in tension or in shear.
void check_stiffness(bool shear) {
  const double M = shear ? 4e3 : soft_bulk + 4.0 / 3 * 4e3, L = 20, D = M / 7;
  Case c = column(static_cast<int>(L), shear ? 0 : 1e-4, shear ? 1e-4 : 0, CrackLaw::interface);
  c.cracks[0].interface.opening = c.cracks[0].interface.sliding = D;
  Simulation<2> simulation(c, MPI_COMM_SELF);
  while (simulation.time() < 50 * L / std::sqrt(M / 1000)) simulation.step(1e300);
  double stress = 0, volume = 0;
  for (const auto& [id, p] : points_of(simulation)) stress += p.mass * p.stress.c[shear ? 3 : 1], volume += p.mass;
  stress /= volume;
  const double delta = 1e-4 * simulation.time();
  std::printf("interface, %s: delta / (s (L/M + 1/D)) = %.4f\n", shear ? "shear" : "tension",
              delta / (stress * (L / M + 1 / D)));
  EXPECT_NEAR(delta / (stress * (L / M + 1 / D)), 1, 0.01);
  const Totals t = simulation.totals();
  EXPECT_NEAR(t.crack_energy / (0.5 * stress * stress / D * 6), 1, 0.05);
  EXPECT_NEAR(t.energy() / t.boundary_work, 0, 0.01) << "of the work of the grips";
  EXPECT_EQ(t.crack_dissipation, 0);
}

TEST(Tractions, AnInterfaceGivesByItsStiffness) { check_stiffness(true); }
// In tension delta is 1.8 % too large (docs/cracks.md).
TEST(Tractions, DISABLED_AnInterfaceGivesByItsStiffnessInTension) { check_stiffness(false); }

/// A step of velocity v0 through an interface between like halves: v0 (1 - exp(-2 D t/Z)) passes.
TEST(Tractions, AWaveThroughAnInterface) {
  const double M = soft_bulk + 4.0 / 3 * 4e3, Z = std::sqrt(M * 1000), wave = std::sqrt(M / 1000), L = 80, v0 = 1e-3;
  Case c = column(static_cast<int>(L), 0, 0, CrackLaw::interface);
  c.faces[2].type = c.faces[3].type = FaceType::free;
  c.cracks[0].interface.opening = c.cracks[0].interface.closing = 12 * M / L;
  Simulation<2> simulation(c, MPI_COMM_SELF);
  const double at = 0.5 * L + 0.17;
  set_velocities(simulation, [&](const Vec<2>& x) -> Vec<2> { return {0, x.y() < 0.25 * L ? v0 : 0}; });
  while (simulation.time() < 0.6 * L / wave) simulation.step(1e300);
  double squares = 0;
  int n = 0;
  for (const auto& [id, p] : points_of(simulation)) {
    const double since = simulation.time() - (p.x.y() - 0.25 * L) / wave;  // of the front
    if (p.x.y() < at || p.x.y() > at + 0.3 * L) continue;
    const double exact = since > 0 ? 0.5 * v0 * (1 - std::exp(-2 * c.cracks[0].interface.opening * since / Z)) : 0;
    squares += std::pow(p.v.y() / (0.5 * v0) - exact / (0.5 * v0), 2), ++n;
  }
  std::printf("wave through an interface: rms %.4f of v0\n", std::sqrt(squares / n));
  EXPECT_LE(std::sqrt(squares / n), 0.07);
}

bool some_bond_holds(const Simulation<2>& simulation) {
  for (const auto& patch : simulation.patches())
    for (const auto& point : patch.cracks)
      if (point.bond.state == Bond::holds && point.bond.length > 0) return true;
  return false;
}

/// Halves pulled or shifted apart: what the crack took is G_c times its length, and the grips gave no more until it was
/// through.
void pull_halves_apart(std::initializer_list<CohesiveShape> shapes) {
  for (const bool shear : {false, true})
    for (const auto shape : shapes) {
      const double M = shear ? 4e3 : soft_bulk + 4.0 / 3 * 4e3, L = 10, speed = 4e-4;
      Case c = column(static_cast<int>(L), shear ? 0 : speed, shear ? speed : 0, CrackLaw::cohesive);
      CohesiveSpec& law = c.cracks[0].cohesive;
      set_pulled_law(law, shape, M);
      c.solver.noise_filter = NoiseFilter::off;
      Simulation<2> simulation(c, MPI_COMM_SELF);
      double peak = 0, before = 0, worst = 0, work = 0;
      bool holds = true;  // then the halves ring, their waves overshoot, and the grips take what reaches them
      const double critical = shape == CohesiveShape::exponential ? 0.3 : 0.2;
      while (speed * simulation.time() < 2 * critical) {
        simulation.step(1e300);
        double stress = 0, volume = 0;
        for (const auto& [id, p] : points_of(simulation)) {
          if (p.x.y() > 0.3 * L) continue;
          stress += p.mass * p.stress.c[shear ? 3 : 1], volume += p.mass;
        }
        const Totals t = simulation.totals();
        if (holds) peak = std::max(peak, stress / volume), work = t.boundary_work - t.kinetic - t.strain;
        holds = holds && some_bond_holds(simulation);
        EXPECT_GE(t.crack_dissipation, before - 1e-12 * 6 * law.energy[0]);
        before = t.crack_dissipation;
        worst = std::max(worst, std::abs(t.energy()));
      }
      const Totals t = simulation.totals();
      const double G = law.energy[0] * 6, share = shape == CohesiveShape::exponential ? 1 - 9 * std::exp(-8.0) : 1;
      std::printf(
          "%s, shape %d: crack's work %.4f of G_c A, grips' %.4f, peak stress %.4f, book off by %.4f of G_c A\n",
          shear ? "shear" : "tension", static_cast<int>(shape), t.crack_dissipation / G, work / G,
          peak / law.strength[0], worst / G);
      EXPECT_NEAR(t.crack_dissipation / G, share, 0.002);
      EXPECT_NEAR(work / G, 1, 0.03);
      EXPECT_NEAR(peak / law.strength[0], 1, 0.04);
      EXPECT_LE(worst / G, 0.03);
    }
}

TEST(Tractions, HalvesPulledApartTakeTheEnergyOfTheLaw) {
  pull_halves_apart({CohesiveShape::triangle, CohesiveShape::exponential, CohesiveShape::linear});
}

/// Two disks hit each other, one of them cut by an interface: slowly, and so fast that it goes to pieces. The law
/// stores what was given to it, and nothing where crack points have lost the material beside them.
TEST(Tractions, AnInterfaceInDebrisKeepsItsEnergy) {
  for (const double speed : {0.4, 4.0}) {  // of the disks against each other, over that of waves
    Case c = soft_case(2, 25, 5);
    c.time.cfl = 0.4;
    c.materials[0].parameters = {{"shear_modulus", 385}, {"bulk_modulus", 833}};
    add_body(c, Ball{Vec3(0.3537, 0.3613, 0), 0.2}, 0.5 * speed * Vec3(1, 0.6, 0));
    add_body(c, Ball{Vec3(0.6441, 0.6329, 0), 0.2}, -0.5 * speed * Vec3(1, 0.8, 0));
    add_crack(c, {Vec3(0.6441, 0.86, 0), Vec3(0.6441, 0.4, 0)}, CrackLaw::interface);
    c.cracks[0].interface.opening = 1e6, c.cracks[0].interface.sliding = 3e5;
    Simulation<2> simulation(c, MPI_COMM_SELF);
    const Totals start = simulation.totals();
    double worst = 0, stored = 0;
    for (int i = 0; i < 350; ++i) {
      simulation.step(1e300);
      const Totals t = simulation.totals();
      worst = std::max(worst, std::abs(t.energy() - start.energy())), stored = std::max(stored, t.crack_energy);
    }
    std::printf("disks at %.1f of the wave speed: stored at most %.4f, book off by %.4f of the kinetic energy\n", speed,
                stored / start.kinetic, worst / start.kinetic);
    EXPECT_GT(stored, 1e-4 * start.kinetic);
    EXPECT_LE(stored, 0.1 * start.kinetic);
    if (speed < 1) {
      EXPECT_LE(worst, 0.01 * start.kinetic);  // in debris the line of the crack turns at random: docs/cracks.md
    }
  }
}

/// Perfect in both directions it is no crack; perfect along the normal it slips without opening.
TEST(Tractions, PerfectDirectionsAreBound) {
  Case whole = falling_block();
  whole.solver.noise_filter = NoiseFilter::off;
  const auto without = run(whole, 150);
  double largest = 0;
  for (const auto& [id, a] : without) largest = std::max(largest, a.v.norm());
  Case c = whole;
  add_crack(c, inner_crack()[0], CrackLaw::interface);
  c.cracks[0].ends = {CrackEnd::tip, CrackEnd::tip};
  for (const auto& [id, a] : run(c, 150)) ASSERT_LE((a.v - without.at(id).v).norm(), 1e-12 * largest);
  for (const bool slip : {false, true}) {
    Case half = whole;
    add_crack(half, {Vec3(0.1, 0.503, 0), Vec3(0.9, 0.503, 0)}, CrackLaw::interface);
    (slip ? half.cracks[0].interface.sliding : half.cracks[0].interface.opening) = 100;
    half.domain.gravity = Vec3(Vec3::Zero()), half.bodies[0].angular_velocity = Vec3::Zero();
    Simulation<2> simulation(half, MPI_COMM_SELF);
    set_velocities(simulation,
                   [](const Vec<2>& x) -> Vec<2> { return x.y() > 0.503 ? Vec<2>(0.02, 0.02) : Vec<2>(-0.02, -0.02); });
    for (int i = 0; i < 100; ++i) simulation.step(1e300);
    double opening = 0, slipped = 0;
    for (const auto& patch : simulation.patches())
      for (const auto& point : patch.cracks)
        if (point.own && point.plane.x() > 0.25 && point.plane.x() < 0.75)
          opening = std::max(opening, std::abs(point.opening().y())),
          slipped = std::max(slipped, std::abs(point.opening().x()));
    const double most = 0.04 * simulation.time();
    EXPECT_LE(slip ? opening : slipped, 0.05 * most);
    EXPECT_GE(slip ? slipped : opening, 0.5 * most);
  }
}

}  // namespace
}  // namespace cairn
