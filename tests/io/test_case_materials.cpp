// Materials and initial pressures of the case file: lists of parameters, plane stress, what cannot be.

#include "../support/case_file.hpp"
#include "cairn/io/case_folder.hpp"

namespace cairn {
namespace {

using namespace test;

const std::string gel = replaced(base, "model = \"neo_hookean\"", R"(model = "viscoelastic"
branch_moduli = [3.0e5, 2.0e5]
branch_times = [1.0e-3, 0.5]
plane = "stress")");

TEST_F(CaseFile, ViscoelasticBranchesAreLists) {
  const Case c = read(gel);
  const auto& values = c.materials.at(0).parameters;
  EXPECT_EQ(values.at("branch_moduli.0"), 3.0e5);
  EXPECT_EQ(values.at("branch_times.1"), 0.5);
  EXPECT_EQ(values.size(), 6u);
  EXPECT_EQ(c.materials[0].plane, Plane::stress);
  EXPECT_NE(c.resolved.find("branch_times = [0.001, 0.5]"), std::string::npos) << c.resolved;
  const Case again = read_case(write("again.toml", c.resolved));
  EXPECT_EQ(again.resolved, c.resolved);
  EXPECT_EQ(again.materials[0].parameters, values);
  EXPECT_EQ(again.materials[0].plane, Plane::stress);
}

TEST_F(CaseFile, WrongBranchesAreRefused) {
  const std::string key = "case.toml:9: materials.soft.branch_times: ";
  expect_error(replaced(gel, "[1.0e-3, 0.5]", "[0.5]"), key + "holds 1 numbers", "branch_moduli holds 2");
  expect_error(replaced(gel, "[1.0e-3, 0.5]", "[1.0e-3, 0.0]"), key + "0 is out of range", "greater than 0");
  expect_error(replaced(gel, "[1.0e-3, 0.5]", "0.5"), key, "numbers");
  expect_error(replaced(gel, "branch_times = [1.0e-3, 0.5]\n", ""),
               "case.toml:6: materials.soft.branch_times: is missing", "relaxation times");
  expect_error(replaced(gel, "[3.0e5, 2.0e5]", "[]"), "case.toml:8: materials.soft.branch_moduli: holds 0 numbers",
               "1 to 4");
  expect_error(replaced(gel, "[3.0e5, 2.0e5]", "[1, 1, 1, 1, 1]"), "case.toml:8: materials.soft.branch_moduli: holds 5",
               "1 to 4");
}

TEST_F(CaseFile, PlaneStressIsAChoiceOfTwoDimensions) {
  EXPECT_EQ(read(base).materials[0].plane, Plane::strain);
  const std::string stress = replaced(base, "density =", "plane = \"stress\"\ndensity =");
  EXPECT_EQ(read(stress).materials[0].plane, Plane::stress);
  const std::string key = "case.toml:8: materials.soft.plane: ";
  expect_error(replaced(stress, "\"stress\"", "\"stres\""), key + "\"stres\" is not a choice", "strain, stress");
  std::string solid =
      replaced(stress, "upper = [1.0, 1.0]\ncells = [20, 10]", "dimension = 3\nupper = [1, 1, 1]\ncells = 10");
  solid = replaced(solid, "\"disk\", centre = [0.5, 0.5]", "\"sphere\", centre = [0.5, 0.5, 0.5]");
  expect_error(solid, "case.toml:9: materials.soft.plane: is only for 2D", "dimension 3");
  std::string rigid = replaced(stress, "\"neo_hookean\"", "\"rigid\"");
  rigid = replaced(rigid, "shear_modulus = 1.0e5\nbulk_modulus = 2.0e5\n", "");
  expect_error(rigid, key + "the model \"rigid\"", "remove this key");
}

TEST_F(CaseFile, InitialPressureOfBodiesAndGrains) {
  write("pack.csv", "x,y,r\n0.1,0.1,0.05\n");
  const std::string text = base + "initial_pressure = 1.5e3\n[[grains]]\nfile = \"pack.csv\"\nmaterial = \"soft\"\n" +
                           "initial_pressure = -20.0\n";
  const Case c = read(text);
  EXPECT_EQ(c.bodies.at(0).initial_pressure, 1.5e3);
  EXPECT_EQ(c.bodies.at(1).initial_pressure, -20.0);
  fs::create_directory(folder_ / "results");
  ASSERT_EQ(write_case_files(c, folder_ / "results"), "");
  const Case again = read_case(folder_ / "results" / "case.toml");
  EXPECT_EQ(again.bodies.at(0).initial_pressure, 1.5e3);
  EXPECT_EQ(again.bodies.at(1).initial_pressure, -20.0);
}

TEST_F(CaseFile, InitialPressureWhereThereIsNoStress) {
  const std::string pressed = base + "initial_pressure = 1.0e3\n", key = "case.toml:12: initial_pressure: ";
  std::string rigid = replaced(pressed, "\"neo_hookean\"", "\"rigid\"");
  rigid = replaced(rigid, "shear_modulus = 1.0e5\nbulk_modulus = 2.0e5\n", "");
  expect_error(rigid, "case.toml:9: initial_pressure: the model \"rigid\"", "set it to 0");
  expect_error(replaced(pressed, "density =", "plane = \"stress\"\ndensity ="), key + "the body's material is in plane",
               "set it to 0");
  read(pressed + "[[drive]]\nids = [0]\n");  // a driven body may carry stress
}

}  // namespace
}  // namespace cairn
