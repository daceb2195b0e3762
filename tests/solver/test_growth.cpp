// Cracks that grow, run into each other, and cut bodies in parts.

#include <gtest/gtest.h>
#include <mpi.h>

#include <set>

#include "../support/crack_cases.hpp"
#include "../support/mpi_environment.hpp"
#include "cairn/solver/body_states.hpp"

namespace cairn {
namespace {

using namespace test;

/// A disk whose halves are thrown apart, cracked from its edge along a line through its middle.
Case torn_disk(int cells, double angle) {
  Case c = soft_case(2, cells, 10);
  add_body(c, Ball{Vec3(0.5, 0.5, 0), 0.35});
  c.solver.surface = Surface::cut;
  const Vec3 e(std::cos(angle), std::sin(angle), 0), n(-e.y(), e.x(), 0), aside = 0.0013 * n;
  add_crack(c, {Vec3(0.5, 0.5, 0) - 0.37 * e + aside, Vec3(0.5, 0.5, 0) - 0.2 * e + aside}, CrackLaw::frictionless);
  CrackSpec& crack = c.cracks[0];
  crack.ends = {CrackEnd::open, CrackEnd::tip};
  crack.cohesive.strength = {500, 500}, crack.cohesive.energy = {2, 2}, crack.cohesive.peak = 0.3;
  crack.growth.criterion = GrowthCriterion::energy, crack.growth.energy = 2, crack.growth.cohesive = true;
  return c;
}

void tear(Simulation<2>& simulation, double angle, double speed) {
  const Vec<2> n(-std::sin(angle), std::cos(angle));
  set_velocities(simulation, [&](const Vec<2>& x) -> Vec<2> {
    return (x - Vec<2>(0.5, 0.5)).dot(n) > 0.0013 ? Vec<2>(speed * n) : Vec<2>(-speed * n);
  });
}

/// With a cohesive law behind the tip, growth takes G_c for each new area, on any grid and in any direction.
TEST(Growth, TakesTheEnergyOfItsArea) {
  for (const double angle : {0.0, M_PI / 4})
    for (const int cells : {20, 30, 40}) {
      Simulation<2> simulation(torn_disk(cells, angle), MPI_COMM_SELF);
      tear(simulation, angle, 0.2);
      const Totals start = simulation.totals();
      double before = 0, worst = 0;
      double after = 0;  // what is left of the law breaks after the crack has come through
      while (simulation.time() < 2 && after < 0.2) {
        simulation.step(1e300);
        const Totals t = simulation.totals();
        EXPECT_GE(t.crack_dissipation, before * (1 - 1e-12));
        if (simulation.cracks()[0].open[1]) after += simulation.dt();
        before = t.crack_dissipation, worst = std::max(worst, std::abs(t.energy() - start.energy()));
      }
      const Crack& crack = simulation.cracks()[0];
      const double taken = simulation.totals().crack_dissipation / (2 * 0.55);
      std::printf("angle %.2f, %d cells: grown %.4f of .55, dissipated %.4f of G_c times .55, book off by %.4f of it\n",
                  angle, cells, crack.grown[1], taken, worst / 1.1);
      EXPECT_TRUE(crack.open[1]) << "the crack did not come through";
      EXPECT_NEAR(taken, 1, 0.03);
      EXPECT_LE(worst, 0.01 * start.kinetic);
    }
}

TEST(Growth, ATipEndsAtAnotherCrack) {
  Case c = torn_disk(30, 0);
  add_crack(c, {Vec3(0.6213, 0.4, 0), Vec3(0.6213, 0.6, 0)}, CrackLaw::frictionless);
  c.cracks[1].ends = {CrackEnd::tip, CrackEnd::tip};
  Simulation<2> simulation(c, MPI_COMM_SELF);
  tear(simulation, 0, 0.2);
  while (simulation.time() < 1 && !simulation.cracks()[0].joined[1]) simulation.step(1e300);
  const Crack& crack = simulation.cracks()[0];
  EXPECT_TRUE(crack.joined[1]);
  EXPECT_NEAR(crack.grown[1], 0.6213 - 0.3, 0.02);
  const double grown = crack.grown[1];
  for (int i = 0; i < 50; ++i) simulation.step(1e300);
  EXPECT_EQ(simulation.cracks()[0].grown[1], grown);
}

TEST(Growth, SteadyGrowthHasItsSpeedAndEnd) {
  Case c = torn_disk(30, 0.3);
  GrowthSpec& growth = c.cracks[0].growth;
  growth.criterion = GrowthCriterion::steady, growth.energy = 0, growth.speed = 0.8, growth.start = 0.05,
  growth.most = 0.2;
  Simulation<2> simulation(c, MPI_COMM_SELF);
  double slowest = 1e300, fastest = 0;
  while (simulation.time() < 0.4) {
    simulation.step(1e300);
    const double due = 0.8 * (simulation.time() - 0.05), grown = simulation.cracks()[0].grown[1];
    if (due < 0) {
      EXPECT_EQ(grown, 0);
    }
    if (due > 0.05 && due < 0.18) slowest = std::min(slowest, grown - due), fastest = std::max(fastest, grown - due);
  }
  EXPECT_LE(fastest, 0.001);
  EXPECT_GE(slowest, -2.0 / 30);
  EXPECT_NEAR(simulation.cracks()[0].grown[1], 0.2, 0.6 / 30);
}

std::set<int> bodies_of(const Simulation<2>& simulation) {
  std::set<int> bodies;
  for (const auto& [id, p] : points_of(simulation)) bodies.insert(p.body);
  return bodies;
}

/// A disk cut in three becomes three bodies, which then meet as bodies do.
void check_parts(ShapeFunction shape) {
  SCOPED_TRACE(static_cast<int>(shape));
  Case c = soft_case(2, 30, 10);
  c.solver.shape = shape;
  add_body(c, Ball{Vec3(0.5, 0.5, 0), 0.3});
  add_crack(c, {Vec3(0.15, 0.403, 0), Vec3(0.85, 0.403, 0)}, CrackLaw::friction);
  add_crack(c, {Vec3(0.15, 0.597, 0), Vec3(0.85, 0.597, 0)}, CrackLaw::friction);
  c.crack.split = 10;
  Simulation<2> simulation(c, MPI_COMM_SELF);
  const auto part_of = [](const Vec<2>& x) { return x.y() < 0.403 ? 2 : x.y() < 0.597 ? 0 : 1; };
  const Vec<2> away[3] = {{0.0, 0.0}, {0.1, 0.2}, {0.0, -0.2}};
  set_velocities(simulation, [&](const Vec<2>& x) -> Vec<2> { return away[part_of(x)]; });
  const auto start = points_of(simulation);
  for (int i = 0; i < 25; ++i) simulation.step(1e300);
  EXPECT_EQ(bodies_of(simulation).size(), 3u);
  if (shape == ShapeFunction::cpdi) {
    EXPECT_EQ(simulation.transfer().stretch, std::vector<double>(3, 1.0));
  }
  std::map<int, std::set<int>> bodies;
  for (const auto& [id, p] : points_of(simulation)) {
    bodies[part_of(start.at(id).x)].insert(p.body);
    ASSERT_LE((p.v - away[part_of(start.at(id).x)]).norm(), 1e-13);
  }
  for (const auto& [part, numbers] : bodies) EXPECT_EQ(numbers.size(), 1u);
  EXPECT_EQ(*bodies[2].begin(), 0) << "the part with the smallest id keeps the number";
  for (const Crack& crack : simulation.cracks()) EXPECT_TRUE(crack.idle);
  // Thrown back at each other they bounce.
  for (auto& patch : simulation.patches())
    for (auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size(); ++p)
        for (int d = 0; d < 2; ++d) piece.points.column(PointColumns<2>::velocity + d)[p] *= -1;
  const Totals before = simulation.totals();
  for (int i = 0; i < 150; ++i) simulation.step(1e300);
  const Totals after = simulation.totals();
  EXPECT_LE((after.momentum - before.momentum).norm(), 1e-13 * before.mass);
  EXPECT_NEAR(after.energy(), before.energy(), 0.01 * before.kinetic);
  EXPECT_GT(after.contact_nodes + after.contact_dissipation, 0) << "the parts did not meet";
}
TEST(Split, PartsBecomeBodies) {
  // Linear hats have normals of other weights, which nothing needs where one body is alone; CPDI, one size for each.
  for (const auto shape : {ShapeFunction::gimp, ShapeFunction::linear, ShapeFunction::cpdi}) check_parts(shape);
}

/// Walls are numbered behind the bodies, however many these are.
TEST(Split, WallsKeepTheirContacts) {
  Case c = soft_case(2, 20, 5);
  add_body(c, BoxShape{Vec3(0.3, 0.001, 0), Vec3(0.7, 0.6, 0)});
  add_crack(c, {Vec3(0.2, 0.313, 0), Vec3(0.8, 0.313, 0)}, CrackLaw::frictionless);
  c.faces[2].type = FaceType::wall;
  c.output.contacts.every = 1;
  c.crack.split = 20;
  Simulation<2> simulation(c, MPI_COMM_SELF);
  set_velocities(simulation, [](const Vec<2>& x) { return Vec<2>(0, x.y() > 0.313 ? 0.5 : -0.5); });
  double before = 0;
  for (int i = 0; i < 21; ++i) {
    if (i == 20) before = contact_states(simulation, 1.0).at(0).force.norm();
    simulation.step(1e300);
  }
  ASSERT_EQ(bodies_of(simulation).size(), 2u);
  const auto contacts = contact_states(simulation, 1.0);
  ASSERT_EQ(contacts.size(), 1u) << "of the lower part and the bottom";
  EXPECT_EQ(contacts[0].body_a, 0);
  EXPECT_EQ(contacts[0].body_b, -3);
  EXPECT_GT(before, 0);
  EXPECT_GT(contacts[0].force.norm(), before);
}

/// What is bound stays one body: by its law, by crack points that hold, or ahead of a tip.
TEST(Split, BoundPartsStayOneBody) {
  for (const auto law : {CrackLaw::stick, CrackLaw::interface, CrackLaw::cohesive, CrackLaw::friction}) {
    Case c = block_at_rest();
    add_crack(c, {Vec3(0.1, 0.5031, 0), Vec3(law == CrackLaw::friction ? 0.7 : 0.9, 0.5031, 0)}, law);
    CrackSpec& crack = c.cracks[0];
    if (law == CrackLaw::friction) crack.ends[1] = CrackEnd::tip;
    crack.interface.opening = crack.interface.sliding = 1e5;
    crack.cohesive.strength = {300, 300}, crack.cohesive.energy = {1, 1};
    c.crack.split = 5;
    Simulation<2> simulation(c, MPI_COMM_SELF);
    for (int i = 0; i < 12; ++i) simulation.step(1e300);
    EXPECT_EQ(bodies_of(simulation).size(), 1u) << static_cast<int>(law);
    EXPECT_FALSE(simulation.cracks()[0].idle);
  }
}

/// Segments that the material stretches divide, and the crack stays whole.
TEST(Growth, LongSegmentsDivide) {
  Case c = block_at_rest();
  add_crack(c, inner_crack()[0], CrackLaw::frictionless);
  c.cracks[0].ends = {CrackEnd::tip, CrackEnd::tip};
  Simulation<2> simulation(c, MPI_COMM_SELF);
  set_velocities(simulation, [](const Vec<2>& x) -> Vec<2> { return {8 * (x.x() - 0.5), 0}; });
  while (simulation.time() < 0.1) simulation.step(1e300);
  std::map<int, CrackPoint<2>> points;
  for (const auto& patch : simulation.patches())
    for (const auto& point : patch.cracks)
      if (point.own) points.emplace(point.index, point);
  EXPECT_GT(points.size(), 16u) << "14 at the start";
  for (auto at = points.begin(); std::next(at) != points.end(); ++at) {
    const auto& [a, b] = std::pair(at->second, std::next(at)->second);
    EXPECT_TRUE(a.precedes(b));
    EXPECT_LE((b.plane - a.plane).norm(), 1.1 / 24);
  }
}

}  // namespace
}  // namespace cairn
