#include "../support/case_file.hpp"

namespace cairn {
namespace {

using namespace test;

class GrainTable : public CaseFile {};

TEST_F(GrainTable, GrainTableColumnsAndComments) {
  write("pack.csv",
        "# made by hand\r\n\r\n r , group, y,x,material\r\n0.05,a,0.2,0.1,hard\r\n# more\r\n+5e-2,,0.4,0.3,\r\n");
  const std::string text = base +
                           "[materials.hard]\nmodel = \"rigid\"\ndensity = 1\n[[grains]]\nfile = "
                           "\"pack.csv\"\nmaterial = \"soft\"\ngroup = \"b\"\n";
  const Case c = read(text);
  ASSERT_EQ(c.bodies.size(), 3u);
  EXPECT_EQ(std::get<Ball>(c.bodies[1].shape).centre, Vec3(0.1, 0.2, 0));
  EXPECT_EQ(c.bodies[1].material, 1);
  EXPECT_EQ(c.bodies[1].group, "a");
  EXPECT_EQ(std::get<Ball>(c.bodies[2].shape).radius, 0.05);
  EXPECT_EQ(c.bodies[2].material, 0);
  EXPECT_EQ(c.bodies[2].group, "b");
  EXPECT_EQ(c.bodies[2].source, (folder_ / "pack.csv").string() + ":6");
}

TEST_F(GrainTable, GrainTableErrors) {
  const std::string text = base + "[[grains]]\nfile = \"pack.csv\"\n";
  const std::pair<std::string, std::string> wrongs[] = {
      {"x,y,r\n0.5,0.5,0.1\n", "pack.csv:2: material: is missing"},
      {"x,y,z,r,material\n0.5,0.5,0,0.1,soft\n", "pack.csv:1: z: this column belongs to 3D"},
      {"x,y,r,y\n", "pack.csv:1: y: this column is named twice"},
      {"x,y,rad\n", "pack.csv:1: \"rad\" is not a column"},
      {"x,y,r,material\n0.5,0.5,1e999,soft\n", "pack.csv:2: r: 1e999 is out of range"},
      {"x,y,r,material\n0.5,0.5,0.1\n", "pack.csv:2: has 3 values"},
      {"\n# nothing\n", "pack.csv:2: there is no header line"},
  };
  for (const auto& [csv, start] : wrongs) {
    write("pack.csv", csv);
    expect_error(text, start, "");
  }
  std::string many = "x,y,r,material\n";
  for (int i = 0; i < 30; ++i) many += "0.5,0.5,-1,soft\n";
  write("pack.csv", many);
  const auto lines = errors(text);
  ASSERT_EQ(lines.size(), 21u);
  EXPECT_TRUE(lines[19].starts_with("pack.csv:21: r: "));
  EXPECT_EQ(lines[20], "pack.csv: ... and 10 more");
}

TEST_F(GrainTable, GrainTableOfManyRowsIsFast) {
  std::string csv = "x,y,r\n";
  for (int i = 0; i < 65536; ++i) csv += fmt::format("{},{},0.001\n", (i % 256 + 0.5) / 256, (i / 256 + 0.5) / 256);
  write("pack.csv", csv);
  const std::string text =
      replaced(base.substr(0, base.find("[[bodies]]")), "cells = [20, 10]", "cells = [2000, 1000]") +
      "[[grains]]\nfile = \"pack.csv\"\nmaterial = \"soft\"\n";
  const auto start = std::chrono::steady_clock::now();
  const Case c = read(text);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  EXPECT_EQ(c.bodies.size(), 65536u);
  EXPECT_LT(elapsed.count(), 5.0);  // some tenths of a second in a release build
}

/// Overlapping pairs by comparing all with all and their periodic images.
std::int64_t count_overlaps(const Case& c) {
  std::int64_t count = 0;
  for (std::size_t i = 0; i < c.bodies.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const auto& a = std::get<Ball>(c.bodies[i].shape);
      const auto& b = std::get<Ball>(c.bodies[j].shape);
      for (int image = -1; image <= 1; ++image) {
        const double reach = a.radius + b.radius - 0.01 * std::min(a.radius, b.radius);
        count += (a.centre - b.centre + Vec3(image, 0, 0)).norm() < reach;
      }
    }
  return count;
}

TEST_F(GrainTable, OverlapWarningCountsEveryPairOnce) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  std::string csv = "x,y,r\n0.02,0.5,0.2\n";  // one large among many small: sizes over three decades
  for (int i = 0; i < 1500; ++i)
    csv += fmt::format("{},{},{}\n", unit(random), unit(random), 0.03 * std::pow(10, -3 * unit(random)));
  write("pack.csv", csv);
  const std::string text =
      replaced(replaced(base.substr(0, base.find("[[bodies]]")), "[time]", "periodic = [true, false]\n[time]"),
               "cells = [20, 10]", "cells = [24000, 12000]") +
      "[[grains]]\nfile = \"pack.csv\"\nmaterial = \"soft\"\n";
  const Case c = read(text);
  const std::int64_t expected = count_overlaps(c);
  ASSERT_GT(expected, 100);
  ASSERT_EQ(c.warnings.size(), 2u);  // the small ones are thin, too
  EXPECT_NE(c.warnings[1].find(fmt::format("; {} pairs", expected)), std::string::npos) << c.warnings[1] << expected;
}

TEST_F(GrainTable, ThinBodiesAreWarnedOfOnce) {
  const Case c = read(replaced(base, "radius = 0.2", "radius = 0.04"));
  ASSERT_EQ(c.warnings.size(), 1u);
  EXPECT_NE(c.warnings[0].find("case.toml:11: body 0 is 1.6 cells wide; 1 of 1 bodies"), std::string::npos)
      << c.warnings[0];
}

}  // namespace
}  // namespace cairn
