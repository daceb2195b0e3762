// J and stress intensities along the rims of cracks in 3D.

#include <gtest/gtest.h>
#include <mpi.h>

#include <Eigen/Geometry>

#include "../support/crack_cases.hpp"
#include "../support/mpi_environment.hpp"

namespace cairn {
namespace {

using namespace test;

/// A quarter of a disk around the origin of the plane z, its edges about half a cell of 1.
Triangles quarter_disk(double radius, double z) {
  Triangles t;
  const int rings = static_cast<int>(std::ceil(radius / 0.5));
  const auto first = [](int ring) { return ring * ring; };  // ring k has 2 k + 1 points
  for (int k = 0; k <= rings; ++k)
    for (int i = 0; i <= 2 * k; ++i) {
      const double angle = k == 0 ? 0 : 0.5 * M_PI * i / (2 * k), r = radius * k / rings;
      // Exactly on the planes of symmetry.
      t.points.emplace_back(i == 2 * k && k > 0 ? 0.0 : r * std::cos(angle), i == 0 ? 0.0 : r * std::sin(angle), z);
    }
  for (int k = 1; k <= rings; ++k)
    for (int half = 0; half < 2; ++half)
      for (int j = 0; j < k; ++j) {
        const int inner = first(k - 1) + half * (k - 1) + j, outer = first(k) + half * k + j;
        t.corners.push_back({inner, outer, outer + 1});
        if (j + 1 < k) t.corners.push_back({inner, outer + 1, inner + 1});
      }
  return t;
}

/// A penny-shaped crack, six cells in radius, in a block 15 wide and 24 high under tension at rest, a quarter of it:
/// K_I = 2 s sqrt(a/pi) in an infinite body (Sneddon, Proc. R. Soc. A 187, 1946).
struct PennyRim {
  double mean = 0, lowest = 1e300, highest = 0, others = 0;  // K_I, and the largest of other modes, over the exact K_I
};
PennyRim rim_of_penny() {
  const double radius = 6, height = 24, side = 15;
  Case c = soft_case(3, 15, 8);
  c.domain.upper = Vec3(side, side, height), c.domain.cells = {15, 15, 24};
  c.materials[0].model = "hypoelastic";
  add_body(c, BoxShape{Vec3(0, 0, 0), c.domain.upper});
  for (const int face : {0, 1, 2, 3}) c.faces[face].type = FaceType::symmetry;
  for (const int face : {4, 5}) c.faces[face].type = FaceType::fixed;
  const double z = 0.5 * height + 0.05;
  add_crack(c, {}, CrackLaw::friction);
  c.cracks[0].file.emplace().triangles = quarter_disk(radius, z);
  const double wave = std::sqrt((soft_bulk + 4.0 / 3 * 4e3) / 1000), stretched = height / wave;
  c.faces[5].velocity = Vec3(0, 0, 1e-4 * wave), c.damping.viscous = 1.5 * wave / height;
  Simulation<3> simulation(c, MPI_COMM_SELF);
  // Pulled for a while, and then left alone until it is at rest.
  while (simulation.time() < 2 * stretched) simulation.step(1e300);
  Case held = c;
  held.faces[5].velocity = Vec3(0, 0, 0), held.damping.viscous = 4 * wave / height;
  simulation.change(held);
  while (simulation.time() < 7 * stretched) simulation.step(1e300);

  double stress = 0, volume = 0;
  for (const auto& [id, p] : points_of(simulation))
    if (std::abs(p.x.z() - z) > 0.42 * height)
      stress += p.mass * p.stress.c[symmetric_index<3>(2, 2)], volume += p.mass;
  const double K = 2 * stress / volume * std::sqrt(radius / M_PI);
  const auto rim = simulation.tip_states();
  EXPECT_EQ(rim.size(), 25u);
  PennyRim found;
  double J = 0;
  for (const auto& tip : rim) {
    EXPECT_NEAR(tip.tip.position.head<2>().norm(), radius, 0.01 * radius);
    found.lowest = std::min(found.lowest, tip.K_opening / K),
    found.highest = std::max(found.highest, tip.K_opening / K);
    found.others = std::max({found.others, std::abs(tip.K_sliding / K), std::abs(tip.K_tearing / K)});
    found.mean += tip.K_opening / K / 25, J += tip.J / (K * K / tip.tip.modulus) / 25;
  }
  const Totals t = simulation.totals();
  EXPECT_LE(t.kinetic, 1e-3 * t.strain);
  std::printf("penny: K_I %.4f (%.4f to %.4f) of 2 s sqrt(a/pi), other modes below %.4f, J %.4f\n", found.mean,
              found.lowest, found.highest, found.others, J);
  return found;
}

TEST(SlowRims, StressIntensityOfAPennyShapedCrack) {
  const PennyRim found = rim_of_penny();
  EXPECT_NEAR(found.mean, 1, 0.06);
  EXPECT_LE(found.others, 0.05);
}
// Point by point it is .93 to 1.10: the rim is a staircase on the grid (docs/cracks.md).
TEST(SlowRims, DISABLED_StressIntensityOfAPennyShapedCrackAllRound) {
  const PennyRim found = rim_of_penny();
  EXPECT_NEAR(found.lowest, 1, 0.06);
  EXPECT_NEAR(found.highest, 1, 0.06);
  EXPECT_LE(found.highest - found.lowest, 0.05 * found.mean);
}

/// A double cantilever beam, 3 cells deep between rollers, is that of 2D in plane strain.
TEST(Rims, ACantileverBetweenRollersIsThatOf2D) {
  const double arm = 6, length = 40, crack = 20;
  const auto beam = [&](int dimension) {
    Case c = soft_case(dimension, 44, 8);
    c.domain.upper = Vec3(44, 16, dimension == 3 ? 3 : 0), c.domain.cells = {44, 16, dimension == 3 ? 3 : 1};
    c.materials[0].model = "hypoelastic";
    const double deep = dimension == 3 ? 3 : 0;
    add_body(c, BoxShape{Vec3(2, 8 - arm, 0), Vec3(2 + length, 8 + arm, deep)});
    const Line line = {Vec3(1.6, 8.05, 0), Vec3(2 + crack, 8.05, 0)};
    if (dimension == 3) {
      add_sheet(c, line, Vec3(0, 0, 3), CrackLaw::friction);
      c.faces[4].type = c.faces[5].type = FaceType::symmetry;
    } else {
      add_crack(c, line, CrackLaw::friction);
      c.cracks[0].ends[1] = CrackEnd::tip;
    }
    return c;
  };
  // The arms are thrown apart.
  const auto away = [&](const auto& x) {
    auto v = x;
    v.setZero();
    if (x.x() < 2 + crack) v.y() = (x.y() > 8.05 ? 1e-4 : -1e-4) * (2 + crack - x.x());
    return v;
  };
  Simulation<2> plane(beam(2), MPI_COMM_SELF);
  Simulation<3> deep(beam(3), MPI_COMM_SELF);
  set_velocities(plane, away), set_velocities(deep, away);
  double worst = 0, worst_K = 0, largest = 0;
  for (int step = 1; step <= 300; ++step) {
    plane.step(1e300), deep.step(plane.dt());
    if (step < 100 || step % 50 != 0) continue;
    ASSERT_NEAR(deep.time(), plane.time(), 1e-12 * plane.time());
    const auto tip = plane.tip_states().at(0);
    const auto rim = deep.tip_states();
    ASSERT_EQ(rim.size(), 7u);
    largest = std::max(largest, tip.J);
    for (const auto& at : rim) {
      worst = std::max(worst, std::abs(at.J / tip.J - 1));
      worst_K = std::max(worst_K, std::abs(at.K_opening / tip.K_opening - 1));
    }
  }
  std::printf("cantilever: J within %.2g of that in 2D, K_I within %.2g\n", worst, worst_K);
  EXPECT_GT(largest, 0);
  EXPECT_LE(worst, 0.06);
  EXPECT_LE(worst_K, 0.06);
}

/// Under tension across it a round crack grows round, in its plane, without holes.
TEST(SlowRims, APennyShapedCrackGrowsRound) {
  Case c = soft_case(3, 16, 8);
  c.domain.upper = Vec3(16, 16, 16);
  c.materials[0].model = "hypoelastic";
  add_body(c, BoxShape{Vec3(0, 0, 0), c.domain.upper});
  for (const int face : {0, 1, 2, 3}) c.faces[face].type = FaceType::symmetry;
  for (const int face : {4, 5}) c.faces[face].type = FaceType::fixed;
  const double wave = std::sqrt((soft_bulk + 4.0 / 3 * 4e3) / 1000);
  c.faces[4].velocity = Vec3(0, 0, -1e-4 * wave), c.faces[5].velocity = Vec3(0, 0, 1e-4 * wave);
  const Vec3 centre(8, 8, 8.05);
  add_disk(c, centre, Vec3(0, 0, 1), 3, CrackLaw::friction);
  GrowthSpec& growth = c.cracks[0].growth;
  growth.criterion = GrowthCriterion::energy, growth.energy = 2e-4, growth.length = 0.25;
  Simulation<3> simulation(c, MPI_COMM_SELF);
  const int before = simulation.cracks()[0].ends[1];
  double mean = 0;
  while (mean < 4.5 && simulation.time() < 60 / wave) {
    for (int i = 0; i < 10; ++i) simulation.step(1e300);
    double sum = 0;
    int count = 0;
    for (const auto& patch : simulation.patches())
      for (const auto& point : patch.cracks)
        if (point.own && point.tip) sum += (point.plane - centre).norm(), ++count;
    mean = sum / count;
  }
  std::map<int, Vec<3>> points;
  std::vector<std::array<int, 3>> triangles;
  double lowest = 1e300, highest = 0;
  int edges = 0;
  for (const auto& patch : simulation.patches())
    for (const auto& point : patch.cracks) {
      if (!point.own) continue;
      points[point.index] = point.plane;
      EXPECT_NEAR(point.plane.z(), 8.05, 0.02);
      const double r = (point.plane - centre).norm();
      if (point.tip) lowest = std::min(lowest, r), highest = std::max(highest, r);
      for (int t = 0; t < point.held; ++t) {
        triangles.push_back({point.index, point.triangles[t].second, point.triangles[t].third});
        for (int k = 0; k < 3; ++k) edges += point.triangles[t].edge(k) == CrackEdge::tip;
      }
    }
  EXPECT_EQ(std::ssize(points), simulation.cracks()[0].ends[1] + 1);
  EXPECT_GT(simulation.cracks()[0].ends[1], before + 40);
  double area = 0;
  std::map<std::pair<int, int>, int> sides;
  for (const auto& t : triangles) {
    const Vec3 across = 0.5 * (points.at(t[1]) - points.at(t[0])).cross(points.at(t[2]) - points.at(t[0]));
    EXPECT_GT(across.z(), 0);
    area += across.z();
    for (int k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}];
  }
  int open = 0;
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1);
    open += !sides.contains({side.second, side.first});
  }
  EXPECT_EQ(open, edges) << "the rim is not what has one triangle beside it";
  std::printf("penny grown to %.3f (%.3f to %.3f) from 3, area %.4f of the circle's\n", mean, lowest, highest,
              area / (M_PI * mean * mean));
  EXPECT_GT(mean, 4.4);
  EXPECT_LE(highest - lowest, 0.5);
  EXPECT_NEAR(area / (M_PI * mean * mean), 1, 0.03);
}

}  // namespace
}  // namespace cairn
