// Motions, stages, conditions, and bodies that come and go, as a case has them.

#include "../support/case_file.hpp"
#include "cairn/io/case_folder.hpp"

namespace cairn {
namespace {

using namespace test;

const std::string laboratory =
    replaced(base, "end = 0.1", "end = 0.1\nuntil = { packing = 0.5, falls = true, every = 3 }") + R"toml(
[[bodies]]
shape = { type = "box", lower = [0.3, 0.8], upper = [0.7, 0.9] }
material = "soft"
group = "lid"
[[insert]]
radius = [0.02, 0.05]
count = 4
material = "soft"
region = { lower = [0.1, 0.1], upper = [0.9, 0.4] }
seed = 9
[[insert]]
file = "more.csv"
start = 0.01
material = "soft"
[[remove]]
region = { type = "half_space", point = [0.0, 0.1], normal = [0.0, 1.0] }
end = 0.5
[[drive]]
bodies = { group = "lid" }
about = [0.5, 0.5]
velocity = ["0.1 * sin(pi * t)", -0.25]
angular_velocity = "2 * t"
rotor = { inertia = 2.0, moment = "0.5 * t", damping = 0.1 }
servo = { along = [0.0, -1.0], pressure = [[0.0, 0.0], [1.0, 5.0]], area = 0.4, repeat = true }
[boundary]
left = { type = "wall", position = 0.05, velocity = [[0.0, 0.1, 0.0], [0.5, 0.0, 0.0]], repeat = true }
top = { type = "wall", piston = { mass = 3.0, force = "5 + t", damping = 0.1 } }
[damping]
viscous = 3.0
[[stage]]
until = { force = 3.0, of = "lid" }
set.contact.friction = 0.1
[[stage]]
name = "last \"one\""
until = { rest = 0.01, strain = 0.1, of = "top" }
set.boundary.top.servo.force = 7.0
set.drive.0.servo.force = [[0.0, 1.0], [0.1, 2.0]]
set.output.forces = { interval = 0.5 }
set.damping.local = 0.5
)toml";

TEST_F(CaseFile, LaboratoriesReadBackToTheSameCase) {
  write("more.csv", "x,y,r\n0.2,0.6,0.05\n");
  const Case c = read(laboratory);
  fs::create_directory(folder_ / "results");
  ASSERT_EQ(write_case_files(c, folder_ / "results"), "");
  const Case again = read_case(folder_ / "results" / "case.toml");
  EXPECT_EQ(c.resolved, again.resolved);
  ASSERT_EQ(again.bodies.size(), 7u);
  for (int b = 0; b < 7; ++b) EXPECT_EQ(again.bodies[b].insert, b < 2 ? -1 : b < 6 ? 0 : 1);
  const double radius = std::get<Ball>(again.bodies[3].shape).radius;
  EXPECT_TRUE(radius >= 0.02 && radius <= 0.05);
  EXPECT_NE(radius, std::get<Ball>(again.bodies[2].shape).radius);
  EXPECT_EQ(radius, std::get<Ball>(c.bodies[3].shape).radius);
  const Drive& drive = again.drives[0];
  EXPECT_NEAR(drive.velocity.at(0.5)[0], 0.1, 1e-15);
  EXPECT_EQ(drive.velocity.at(0.5)[1], -0.25);
  EXPECT_EQ(drive.angular_velocity.at(0.5), Vec3(0, 0, 1));
  EXPECT_DOUBLE_EQ(drive.piston.force.at(1.25).x(), 1.25);
  EXPECT_TRUE(drive.piston.pressure);
  const double modulus = 2e5 + 4e5 / 3, impedance = std::sqrt(1000 * modulus) * 0.4;
  EXPECT_NEAR(drive.piston.gain, 30 / impedance, 1e-9 / impedance);
  EXPECT_NEAR(drive.piston.largest, 5 * 0.4 / impedance, 1e-9);
  EXPECT_TRUE(moves(again.faces[0], 0) && moves(again.faces[3], 3) && !moves(again.faces[2], 2));
  EXPECT_EQ(again.faces[3].piston.along, Vec3(0, -1, 0));
  EXPECT_EQ(again.time.until.packing, 0.5);
  ASSERT_EQ(again.stages.size(), 2u);
  EXPECT_EQ(again.stages[1].name, "last \"one\"");
  EXPECT_EQ(again.stages[0].changed->contact.friction, 0.1);
  const Case& last = *again.stages[1].changed;
  EXPECT_EQ(last.contact.friction, 0.1) << "changes stay";
  EXPECT_EQ(last.faces[3].piston.force.at(0).x(), 7);
  EXPECT_GT(last.faces[3].piston.gain, 0) << "a servo takes the place of a piston";
  EXPECT_FALSE(last.drives[0].piston.pressure);
  EXPECT_EQ(last.drives[0].rotor.mass, 2);
  EXPECT_EQ(last.drives[0].rotor.damping, 0.1);
  EXPECT_EQ(last.drives[0].rotor.force.at(0.5).x(), 0.25);
  EXPECT_EQ(last.drives[0].rotor.along, Vec3(0, 0, 1));
  EXPECT_EQ(last.drives[0].piston.force.at(0.05).x(), 1.5);
  EXPECT_EQ(last.damping.local, 0.5);
  EXPECT_EQ(last.damping.viscous, 3);
  EXPECT_EQ(last.output.forces.interval, 0.5);
}

const std::string deforming = replaced(
    base, "cells = [20, 10]",
    "cells = [20, 10]\nperiodic = [true, true]\n"
    "deform = { x = { strain_rate = \"-0.1 * t\" }, y = { stress = [[0.0, -5.0], [1.0, -9.0]], repeat = true } }");

TEST_F(CaseFile, DomainsThatDeformReadBack) {
  using By = AxisDeformation::By;
  const Case c = read(deforming +
                      "[[stage]]\nuntil = { strain = 0.1, of = \"domain\" }\n[[stage]]\n"
                      "set.domain.deform.x.stress = -3.0\nset.domain.deform.y.viscosity = 7.0\n");
  fs::create_directory(folder_ / "results");
  ASSERT_EQ(write_case_files(c, folder_ / "results"), "");
  const Case again = read_case(folder_ / "results" / "case.toml");
  EXPECT_EQ(c.resolved, again.resolved);
  const auto& axes = again.domain.deformation.axes;
  EXPECT_EQ(axes[0].by, By::strain_rate);
  EXPECT_DOUBLE_EQ(axes[0].target.at(2).x(), -0.2);
  EXPECT_EQ(axes[1].by, By::stress);
  EXPECT_DOUBLE_EQ(axes[1].target.at(1.5).x(), -7);
  // The hardest material: density 1000, modulus K + 4/3 G = 1e6 / 3.
  const double wave = std::sqrt(1e3 / 3), cell = 0.05;
  EXPECT_NEAR(axes[1].viscosity, 4 * 1000 * wave * cell, 1e-9);
  EXPECT_NEAR(axes[1].memory, 100 * cell / wave, 1e-12);
  EXPECT_NEAR(axes[1].largest_rate, 9 / (1000 * wave), 1e-12);
  EXPECT_FALSE(axes[2].active());
  const auto& then = again.stages[1].changed->domain.deformation.axes;
  EXPECT_EQ(then[0].by, By::stress);
  EXPECT_EQ(then[0].target.at(0).x(), -3);
  EXPECT_EQ(then[1].viscosity, 7);
}

TEST_F(CaseFile, DomainsThatCannotDeformAreRefused) {
  const auto refused = [&](const std::string& text, const std::string& what) {
    const auto lines = errors(text);
    ASSERT_FALSE(lines.empty()) << text;
    EXPECT_NE(lines[0].find(what), std::string::npos) << lines[0] << "\nexpected " << what;
  };
  const auto with = [&](const std::string& deform) {
    return replaced(base, "cells = [20, 10]", "cells = [20, 10]\nperiodic = [true, false]\ndeform = " + deform);
  };
  refused(with("{ y = { stress = 1.0 } }"), "direction y is not periodic");
  refused(with("{ x = { stress = 1.0, strain_rate = 2.0 } }"), "give one of the two");
  refused(with("{ x = { viscosity = 1.0 } }"), "strain_rate: is missing");
  refused(with("{ x = { strain_rate = 1.0, viscosity = 1.0 } }"), "viscosity");
  refused(with("{ z = { strain_rate = 1.0 } }"), "z");
  refused(with("{}"), "give x, y or z");
  refused(replaced(deforming, "[time]", "gravity = [0.0, -9.81]\n[time]"), "no bottom");
  refused(deforming + "[solver]\nshape = \"cpdi\"\n", "cpdi");
  refused(replaced(deforming, "material = \"soft\"", "material = \"hard\""), "hard");
  refused(deforming + "[[drive]]\nids = [0]\nvelocity = [1.0, 0.0]\n", "driven bodies");
  refused(deforming + "[[cracks]]\npoints = [[0.2, 0.5], [0.5, 0.5]]\n", "cracks");
  refused(base + "[[stage]]\nuntil = { strain = 0.1, of = \"domain\" }\n", "domain");
}

TEST_F(CaseFile, LaboratoriesThatCannotBeAreRefused) {
  write("more.csv", "x,y,r\n0.2,0.6,0.05\n");
  const auto refuse = [&](const std::string& key, const std::string& value, const std::string& start,
                          const std::string& remedy) {
    expect_error(laboratory, start, remedy, {{key, value}});
  };
  refuse("drive.0.velocity", "[\"0.1 *\", 0.0]", "--set drive.0.velocity", "is no formula of t");
  refuse("drive.0.velocity", "[\"ln(t - 1)\", 0.0]", "--set drive.0.velocity", "write one such as");
  refuse("drive.0.servo.gain", "0.0", "--set drive.0.servo.gain", "greater than 0");
  refuse("drive.0.rotor.inertia", "0.0", "--set drive.0.rotor.inertia", "greater than 0");
  refuse("drive.0.rotor.axis", "[0.0, 1.0]", "--set drive.0.rotor.axis", "unknown");
  refuse("time.until.packing", "-1.0", "--set time.until.packing", "greater than 0");
  refuse("stage.0.until.of", "\"roof\"", "--set stage.0.until.of", "choose one of left, top, lid");
  refuse("stage.0.set.domain.cells", "[4, 4]", "case.toml", "domain.cells cannot change in a run");
  refuse("stage.0.set.contact.friction", "-0.5", "case.toml", "contact.friction: -0.5");
  refuse("damping.viscous", "-1.0", "--set damping.viscous", "at least 0");
  refuse("insert.0.region.upper", "[0.15, 0.4]", "case.toml", "is too small");
  refuse("insert.0.count", "0", "--set insert.0.count", "in [1");
  refuse("remove.0.region.type", "\"hole\"", "--set remove.0.region.type", "choose one of");
}

}  // namespace
}  // namespace cairn
