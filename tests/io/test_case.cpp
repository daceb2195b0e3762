#include "../support/case_file.hpp"
#include "cairn/io/case_folder.hpp"

namespace cairn {
namespace {

using namespace test;

TEST_F(CaseFile, FillsInTheDefaults) {
  const Case c = read(base);
  EXPECT_EQ(c.title, "");
  EXPECT_EQ(c.domain.dimension, 2);
  EXPECT_EQ(c.domain.lower, Vec3::Zero());
  EXPECT_EQ(c.domain.cells, (std::array{20, 10, 1}));
  EXPECT_EQ(c.domain.periodic, (std::array{false, false, false}));
  EXPECT_EQ(c.domain.patch_cells, 32);
  EXPECT_EQ(c.time.cfl, 0.4);
  EXPECT_EQ(c.time.dt, 0);
  EXPECT_EQ(c.time.steps, std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(c.solver.shape, ShapeFunction::gimp);
  EXPECT_EQ(c.solver.stress_update, StressUpdate::both);
  EXPECT_EQ(c.solver.points_per_cell, 4);
  EXPECT_EQ(c.contact.law, ContactLaw::friction);
  EXPECT_EQ(c.contact.release, Release::reaction);
  EXPECT_EQ(c.contact.friction, 0.3);
  EXPECT_EQ(c.contact.fill, 0.8);
  EXPECT_EQ(c.contact.normals, NormalSource::volume_gradient);
  EXPECT_TRUE(c.contact.pairs.empty());
  EXPECT_EQ(c.faces[0].type, FaceType::free);
  EXPECT_EQ(c.parallel.partition, Partition::metis);
  EXPECT_EQ(c.output.history.every, 10);
  EXPECT_FALSE(c.output.particles.active());
  EXPECT_EQ(c.output.particles.fields,
            (std::vector<std::string>{"velocity", "stress", "body", "id", "volume", "mass"}));
  EXPECT_EQ(c.output.checkpoint.keep, 2);
  EXPECT_EQ(c.bodies.at(0).source, (folder_ / "case.toml").string() + ":11");
  EXPECT_TRUE(c.warnings.empty());
}

TEST_F(CaseFile, ResolvedTextReadsBackToTheSameCase) {
  write("pack.csv", "x,y,r,group\n0.9,0.9,0.1,corner\n0.1,0.9,0.1,\n");
  const Case c = read(R"(title = "quotes \" and \\ and \n"
[domain]
lower = [-0.1, 0.0]
upper = [1.0, 1.0]
cell_size = [0.05, 0.1]
periodic = [false, true]
gravity = [0.0, -9.81]
patch_cells = 8
[time]
end = 0.1
steps = 12
dt = 1.0e-5
[solver]
shape = "linear"
stress_update = "modified_last"
flip = 0.95
points_per_cell = 9
[contact]
law = "stick"
release = "traction"
fill = 0.0
impulse_limit = 0.5
normals = "density"
normal_choice = "own"
gate = "body"
departing_friction = "printed"
passes = "after"
separation = 0.8
[[contact.pair]]
materials = ["wall", "z"]
friction = inf
[[contact.pair]]
materials = ["z", "a b"]
law = "frictionless"
[materials.z]
model = "von_mises"
density = 1900.0
youngs_modulus = 7.0e9
poissons_ratio = 0.3
yield_stress = 0.3e9
[materials."a b"]
model = "rigid"
density = 1.0
[[bodies]]
shape = { type = "difference", of = [ { type = "box", lower = [0.3, 0.2], upper = [0.7, 0.8], angle = 0.1 },
                                      { type = "ellipse", centre = [0.5, 0.5], radii = [0.1, 0.2] } ] }
material = "z"
velocity = [0.1, -0.2]
angular_velocity = 0.3
group = "g"
[[bodies]]
shape = { type = "polygon", points = [[0, 0.2], [0.3, 0.2], [0.1, 0.4]] }
material = "a b"
[[grains]]
file = "pack.csv"
material = "z"
velocity = [3.0, 4.0]
[[drive]]
ids = [1, 2]
velocity = [0.0, 1.0]
[[drive]]
bodies = { group = "corner" }
[[drive]]
group = "g"
[boundary]
left = { type = "fixed", velocity = [0.0, 1.0] }
right = { type = "wall", friction = inf }
[parallel]
partition = "round_robin"
[output]
particles = { every = 3, interval = 0.1, fields = ["position", "image"] }
history = {}
checkpoint = { interval_wall = 600, keep = 5 }
track = [2, 0]
)");
  fs::create_directory(folder_ / "results");
  ASSERT_EQ(write_case_files(c, folder_ / "results"), "");  // with a copy of the table
  const Case again = read_case(folder_ / "results" / "case.toml");
  EXPECT_EQ(c.resolved, again.resolved);
  // The text holds all of the case, so that it is enough to see that what was read is right.
  EXPECT_EQ(c.title, "quotes \" and \\ and \n");
  EXPECT_EQ(again.title, c.title);
  EXPECT_EQ(again.domain.cells, (std::array{22, 10, 1}));
  EXPECT_EQ(again.time.dt, 1.0e-5);
  EXPECT_EQ(again.contact.departing_friction, DepartingFriction::printed);
  ASSERT_EQ(again.contact.pairs.size(), 2u);
  EXPECT_EQ(again.contact.pairs[0].material_a, -1);
  EXPECT_EQ(again.contact.pairs[0].law, ContactLaw::friction);
  EXPECT_EQ(again.contact.pairs[0].friction, std::numeric_limits<double>::infinity());
  EXPECT_EQ(again.contact.pairs[1].law, ContactLaw::frictionless);
  EXPECT_EQ(again.contact.pairs[1].friction, 0.3);
  ASSERT_EQ(again.materials.size(), 2u);
  EXPECT_EQ(again.materials[0].name, "z") << "materials keep the order of the file";
  EXPECT_EQ(again.materials[0].parameters, c.materials[0].parameters);
  EXPECT_DOUBLE_EQ(again.materials[0].parameters.at("shear_modulus"), 7.0e9 / 2.6);
  EXPECT_DOUBLE_EQ(again.materials[0].parameters.at("bulk_modulus"), 7.0e9 / 1.2);
  EXPECT_EQ(again.materials[0].parameters.at("hardening_modulus"), 0.0);
  ASSERT_EQ(again.bodies.size(), 4u);
  EXPECT_EQ(std::get<BoxShape>(std::get<Compound>(again.bodies[0].shape).of[0]).angle, 0.1);
  EXPECT_EQ(again.bodies[0].angular_velocity, Vec3(0, 0, 0.3));
  EXPECT_EQ(again.bodies[1].material, 1);
  EXPECT_EQ(again.bodies[2].velocity, Vec3(3, 4, 0));
  EXPECT_EQ(again.bodies[2].group, "corner");
  EXPECT_EQ(again.bodies[3].source, (folder_ / "results" / "case_grains_0.csv").string() + ":4");
  ASSERT_EQ(again.drives.size(), 3u);
  EXPECT_EQ(again.drives[0].ids, (std::vector{1, 2}));
  EXPECT_EQ(again.drives[2].group, "g");
  EXPECT_EQ(again.faces[0].velocity.at(0), Vec3(0, 1, 0));
  EXPECT_EQ(again.faces[2].type, FaceType::periodic);
  EXPECT_EQ(again.parallel.partition, Partition::round_robin);
  EXPECT_FALSE(again.output.history.active());
  EXPECT_EQ(again.output.particles.fields, std::vector<std::string>{"image"});
  EXPECT_EQ(again.output.track, (std::vector{2, 0}));
}

TEST_F(CaseFile, ResolvedTextReadsBackIn3D) {
  const Case c = read(R"([domain]
dimension = 3
upper = [1.0, 1.0, 2.0]
cell_size = 0.1
[time]
steps = 5
[materials.m]
model = "hypoelastic"
density = 1
shear_modulus = 1
bulk_modulus = 1
[[bodies]]
shape = { type = "intersection", of = [ { type = "sphere", centre = [0.5, 0.5, 0.5], radius = 0.3 },
                                        { type = "half_space", point = [0.5, 0.5, 0.5], normal = [0, 0, 1] } ] }
material = "m"
angular_velocity = [1.0, 2.0, 3.0]
[[bodies]]
shape = { type = "union", of = [ { type = "cylinder", from = [0.5, 0.5, 1.0], to = [0.5, 0.5, 1.5], radius = 0.2 },
                                 { type = "ellipsoid", centre = [0.5, 0.5, 1.5], radii = [0.2, 0.2, 0.1] },
                                 { type = "box", lower = [0.1, 0.1, 1], upper = [0.3, 0.3, 1.2] } ] }
material = "m"
[[drive]]
ids = [1]
angular_velocity = [0, 0, 1]
)");
  EXPECT_EQ(c.domain.patch_cells, 16);
  EXPECT_EQ(c.solver.points_per_cell, 8);
  EXPECT_EQ(c.domain.cells, (std::array{10, 10, 20}));
  const Case again = read_case(write("again.toml", c.resolved));
  EXPECT_EQ(c.resolved, again.resolved);
  EXPECT_EQ(again.bodies[0].angular_velocity, Vec3(1, 2, 3));
  EXPECT_EQ(std::get<Cylinder>(std::get<Compound>(again.bodies[1].shape).of[0]).to, Vec3(0.5, 0.5, 1.5));
}

TEST_F(CaseFile, NumbersRoundTripBitForBit) {
  std::mt19937_64 random(7);
  std::string text = base;
  for (int i = 0; i < 200; ++i) {
    const double v =
        std::ldexp(std::uniform_real_distribution(-1.0, 1.0)(random), static_cast<int>(random() % 1200) - 600);
    text += fmt::format(
        "[[bodies]]\nshape = {{ type = \"disk\", centre = [0.5, 0.5], radius = 0.1 }}\nmaterial = \"soft\"\n"
        "velocity = [{:.25e}, -0.0]\n",
        v);
  }
  const Case c = read(text);
  const Case again = read_case(write("again.toml", c.resolved));
  for (std::size_t i = 0; i < c.bodies.size(); ++i) EXPECT_EQ(c.bodies[i].velocity.x(), again.bodies[i].velocity.x());
  EXPECT_TRUE(std::signbit(again.bodies.back().velocity.y()));
}

TEST_F(CaseFile, OverridesAreApplied) {
  const Case c = read(base, {{"contact.friction", "0.5"},
                             {"time.steps", "100"},
                             {"bodies.0.velocity", "[1.0, 2.0]"},
                             {"bodies.0.shape.radius", "0.1"},
                             {"domain.cell_size", "0.1"},
                             {"output.checkpoint", "{ every = 20 }"},
                             {"title", "\"a\""},
                             {"title", "\"b\""}});
  EXPECT_EQ(c.contact.friction, 0.5);
  EXPECT_EQ(c.time.steps, 100);
  EXPECT_EQ(c.bodies[0].velocity, Vec3(1, 2, 0));
  EXPECT_EQ(std::get<Ball>(c.bodies[0].shape).radius, 0.1);
  EXPECT_EQ(c.domain.cells, (std::array{10, 10, 1})) << "an override of cell_size wins over cells";
  EXPECT_EQ(c.output.checkpoint.every, 20);
  EXPECT_EQ(c.title, "b");
}

TEST_F(CaseFile, WordsOfOverridesNeedNoQuotes) {
  const Case c = read(base, {{"solver.shape", "linear"}, {"time.cfl", "0.25"}, {"title", "runs/number_5.a"}});
  EXPECT_EQ(c.solver.shape, ShapeFunction::linear);
  EXPECT_EQ(c.time.cfl, 0.25);
  EXPECT_EQ(c.title, "runs/number_5.a");
  EXPECT_EQ(read(base, {{"title", "../a"}}).title, "../a");
  // What is a value keeps its type; what is a number written wrongly is no word.
  expect_error(base, "--set title: is true or false", "string", {{"title", "true"}});
  expect_error(base, "--set title: is a number", "string", {{"title", "inf"}});
  expect_error(base, "--set title: is an integer", "string", {{"title", "12"}});
  expect_error(base, "--set contact.friction: is a string", "at least 0", {{"contact.friction", "half"}});
  for (const std::string text : {"0.5x", ".5", "-.5", "1,5", "", "..", "two words", "a\"b", "a\nb = 1", "[a]"})
    expect_error(base, "--set contact.friction: ", "is not a TOML value; strings need quotes",
                 {{"contact.friction", text}});
}

TEST_F(CaseFile, ErrorsOfOverridesNameThem) {
  expect_error(base, "--set time.end: -1 is out of range", "greater than 0", {{"time.end", "-1"}});
  expect_error(base, "--set bodies.0.velocity: has 3 entries", "2 numbers", {{"bodies.0.velocity", "[1, 2, 3]"}});
  expect_error(base, "--set bodies.1.velocity: '1' is not an entry", "1 entries", {{"bodies.1.velocity", "[1, 2]"}});
  expect_error(base, "--set contact.law: \"no slip\" is not a TOML value", "quotes", {{"contact.law", "no slip"}});
  expect_error(base, "--set contact.lw: unknown key", "'law'", {{"contact.lw", "\"stick\""}});
  expect_error(base, "--set time.end.x: 'x' is inside a plain value", "tables", {{"time.end.x", "1"}});
}

TEST_F(CaseFile, EveryErrorNamesLineKeyAndRemedy) {
  struct Wrong {
    std::string old, with, start, remedy;
  };
  const Wrong wrongs[] = {
      {"cells = [20, 10]", "cels = [20, 10]\ncells = [20, 10]", "case.toml:3: domain.cels: unknown key", "'cells'"},
      {"end = 0.1", "end = \"x\"", "case.toml:5: time.end: is a string", "greater than 0"},
      {"end = 0.1", "end = nan", "case.toml:5: time.end: nan", "greater than 0"},
      {"end = 0.1", "end = inf", "case.toml:5: time.end: inf", "greater than 0"},
      {"end = 0.1", "cfl = 0.1", "case.toml:4: time.end: is missing", "steps"},
      {"end = 0.1", "steps = 1.5", "case.toml:5: time.steps: is a number", "integer"},
      {"end = 0.1", "end = 0.1\nend = 0.2", "case.toml:6: not valid TOML", "end"},
      {"[20, 10]", "[20]", "case.toml:3: domain.cells: has 1 entries", "2 numbers"},
      {"cells = [20, 10]", "cell_size = 0.3", "case.toml:3: domain.cell_size: 0.3 does not divide", "0.333"},
      {"density = 1000.0", "density = 0", "case.toml:8: materials.soft.density: 0 is out of range", "greater than 0"},
      {"\"neo_hookean\"", "\"neo\"", "case.toml:7: materials.soft.model: \"neo\" is not a choice", "neo_hookean"},
      {"bulk_modulus = 2.0e5", "poissons_ratio = 0.3", "case.toml:10: materials.soft.poissons_ratio: is given beside",
       "one pair"},
      {"shear_modulus = 1.0e5\nbulk_modulus = 2.0e5", "poissons_ratio = 0.3",
       "case.toml:6: materials.soft.youngs_modulus: is missing", "greater than 0"},
      {"radius = 0.2", "radius = [1]", "case.toml:12: bodies.0.shape.radius: is an array", "greater than 0"},
      {"type = \"disk\", centre = [0.5, 0.5], radius = 0.2",
       "type = \"polygon\", points = [[0, 0], [0.1, 0.1], [0.2, 0.2]]",
       "case.toml:12: bodies.0.shape.points: enclose no area", "one line"},
      {"type = \"disk\", centre = [0.5, 0.5], radius = 0.2", "type = \"polygon\", points = [[0, 0], [0.1, 0.1], [0.2]]",
       "case.toml:12: bodies.0.shape.points: has 1 entries", "2 numbers"},
      {"\"disk\"", "\"cube\"", "case.toml:12: bodies.0.shape.type: \"cube\" is not a choice", "box"},
      {"radius = 0.2", "radius = 0.2, angle = 1", "case.toml:12: bodies.0.shape.angle: unknown key",
       "known here: type, centre, radius"},
      {"radius = 0.2", "radius = -1", "case.toml:12: bodies.0.shape.radius: -1 is out of range", "greater than 0"},
      {"[0.5, 0.5]", "[1.5, 0.5]", "case.toml:12: bodies.0.shape: the body lies outside", "[0, 1]"},
      {"material = \"soft\"", "material = \"sfot\"", "case.toml:13: bodies.0.material: \"sfot\" is not a material",
       "soft"},
      {"material = \"soft\"", "", "case.toml:11: bodies.0.material: is missing", "soft"},
      {"[[bodies]]", "[bodies]", "case.toml:11: bodies: is one table", "[[bodies]]"},
      {"[time]", "periodic = [true, 1]\n[time]", "case.toml:4: domain.periodic: must have 2 entries", "true or false"},
      {"[time]", "[contact]\nlaw = \"none\"\n[[contact.pair]]\nmaterials = [\"wall\", \"wall\"]\n[time]",
       "case.toml:7: contact.pair.0.materials: names two walls", "do not touch"},
      {"[time]", "[contact]\nnormals = \"mass\"\n[time]", "case.toml:5: contact.normals: \"mass\" is not a choice",
       "density, mass_gradient, volume_gradient"},
      {"[time]", "[solver]\npoints_per_cell = 8\n[time]", "case.toml:5: solver.points_per_cell: 8 is not a square",
       "4, 9"},
  };
  for (const auto& w : wrongs) expect_error(replaced(base, w.old, w.with), w.start, w.remedy);
}

TEST_F(CaseFile, AllErrorsComeAtOnceInOrder) {
  const auto lines = errors(
      replaced(replaced(replaced(base, "[20, 10]", "[0, 10]"), "end = 0.1", "end = -1"), "radius = 0.2", "radius = 0"),
      {{"solver.flip", "2"}});
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_TRUE(lines[0].starts_with("case.toml:3: domain.cells"));
  EXPECT_TRUE(lines[1].starts_with("case.toml:5: time.end"));
  EXPECT_TRUE(lines[2].starts_with("case.toml:12: bodies.0.shape.radius"));
  EXPECT_TRUE(lines[3].starts_with("--set solver.flip")) << lines[3];
}

TEST_F(CaseFile, PeriodicDirections) {
  const std::string periodic = replaced(base, "[time]", "periodic = [true, false]\n[time]");
  EXPECT_EQ(read(replaced(periodic, "[0.5, 0.5]", "[0.05, 0.5]")).faces[1].type, FaceType::periodic);
  expect_error(replaced(periodic, "[0.5, 0.5]", "[-0.05, 0.5]"), "case.toml:13: bodies.0.shape: the centre", "period");
  expect_error(replaced(periodic, "radius = 0.2", "radius = 0.6"), "case.toml:13: bodies.0.shape: the body is",
               "period");
  expect_error(periodic + "[boundary]\nleft = { type = \"wall\" }\n",
               "case.toml:16: boundary.left: direction x is periodic", "remove");
  expect_error(replaced(periodic, "[20, 10]", "[3, 10]"), "case.toml:4: domain.periodic: direction x has 3 cells",
               "at least 4");
}

TEST_F(CaseFile, UnreadableFilesAreRefused) {
  EXPECT_THROW(read_case(folder_ / "nothing.toml"), InputError);
  EXPECT_THROW(read_case(folder_), InputError);
  EXPECT_THROW(read(""), InputError);
  EXPECT_THROW(read(std::string("\0\1\2", 3)), InputError);
  EXPECT_THROW(read("\xff\xfe[domain]"), InputError);
  EXPECT_THROW(read(std::string(5000, '[')), InputError);
}

TEST_F(CaseFile, PackSpec) {
  const std::string spec =
      "[pack]\nupper = [1.0, 2.0]\nperiodic = [false, true]\nwalls = \"overlap\"\ncount = 9\nseed = 5\n"
      "[sizes]\ntype = \"list\"\ndiameters = [0.1, 0.2]\nweights = [2, 1]\n";
  const PackSpec read = read_pack_spec(write("spec.toml", spec));
  EXPECT_EQ(read.upper, Vec3(1, 2, 0));
  EXPECT_EQ(read.periodic, (std::array{false, true, false}));
  EXPECT_EQ(read.walls, PackWalls::overlap);
  EXPECT_EQ(read.count, 9);
  EXPECT_EQ(read.seed, 5u);
  EXPECT_EQ(read.sizes.type, SizeType::list);
  EXPECT_EQ(read.sizes.diameters, (std::vector{0.1, 0.2}));
  EXPECT_EQ(read.sizes.weights, (std::vector{2.0, 1.0}));
  try {
    read_pack_spec(
        write("spec.toml", replaced(replaced(spec, "seed", "sed"), "type = \"list\"", "type = \"list\"\nmin = 1.0")));
    FAIL();
  } catch (const InputError& error) {
    ASSERT_EQ(error.messages().size(), 2u) << error.what();
    EXPECT_NE(error.messages()[0].find("spec.toml:6: pack.sed: unknown key; the nearest known key is 'seed'"),
              std::string::npos);
    EXPECT_NE(error.messages()[1].find("spec.toml:9: sizes.min: does not belong to type \"list\""), std::string::npos);
  }
}

}  // namespace
}  // namespace cairn
