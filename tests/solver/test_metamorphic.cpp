// What may not change a result: the same case mirrored, turned, shifted, in other units, among bystanders. For every
// setting of contact, in 2D and 3D.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "../support/cases.hpp"
#include "cairn/solver/body_states.hpp"

namespace cairn {
namespace {

using namespace test;

/// A setting under test.
struct Setting {
  const char* name;
  std::function<void(Case&)> set;
};

const std::vector<Setting>& settings() {
  static const std::vector<Setting> all = {
      {"defaults", [](Case&) {}},
      {"stick", [](Case& c) { c.contact.law = ContactLaw::stick; }},
      {"frictionless", [](Case& c) { c.contact.law = ContactLaw::frictionless; }},
      {"none", [](Case& c) { c.contact.law = ContactLaw::none; }},
      {"approach", [](Case& c) { c.contact.release = Release::approach; }},
      {"traction", [](Case& c) { c.contact.release = Release::traction; }},
      {"fill", [](Case& c) { c.contact.gap = GapRule::fill; }},
      {"impulse limit", [](Case& c) { c.contact.release = Release::traction, c.contact.impulse_limit = 0.5; }},
      {"density", [](Case& c) { c.contact.normals = NormalSource::density; }},
      {"mass gradient", [](Case& c) { c.contact.normals = NormalSource::mass_gradient; }},
      {"own normals", [](Case& c) { c.contact.normal_choice = NormalChoice::own; }},
      {"gate of bodies", [](Case& c) { c.contact.gate = Gate::body; }},
      {"departing", [](Case& c) { c.contact.departing_friction = DepartingFriction::coulomb; }},
      {"before", [](Case& c) { c.contact.passes = Passes::before; }},
      {"after", [](Case& c) { c.contact.passes = Passes::after; }},
      {"separation", [](Case& c) { c.contact.separation = 0.5; }},
      {"last", [](Case& c) { c.solver.stress_update = StressUpdate::last; }},
      {"first", [](Case& c) { c.solver.stress_update = StressUpdate::first; }},
      {"modified last", [](Case& c) { c.solver.stress_update = StressUpdate::modified_last; }},
      {"linear", [](Case& c) { c.solver.shape = ShapeFunction::linear, c.solver.spin = false; }},
      {"CPDI", [](Case& c) { c.solver.shape = ShapeFunction::cpdi, c.solver.motion = Motion::projected; }},
      {"B-splines", [](Case& c) { c.solver.shape = ShapeFunction::bspline2; }},
      {"strong filter", [](Case& c) { c.solver.noise_filter = NoiseFilter::strong; }},
  };
  return all;
}

/// Two soft balls, one four times as dense, and a rigid box that pushes one of them into the other, on a wall.
Case base_case(int dimension) {
  Case c = soft_case(dimension, 16, 4);
  Material heavy = c.materials[0];
  heavy.name = "heavy", heavy.density = 4000;
  c.materials.push_back(heavy);
  c.materials.push_back({"stone", "rigid", 2000, {}});
  const double z = dimension == 3 ? 1 : 0;
  add_body(c, Ball{Vec3(0.3512, 0.2437, 0.4631 * z), 0.1723}, Vec3(0.45, -0.35, 0.1 * z), Vec3(0, 0, 1));
  add_body(c, Ball{Vec3(0.7011, 0.2981, 0.5237 * z), 0.1691}, Vec3(-0.6, -0.4, 0), Vec3(0.5 * z, 0, 0.3));
  add_body(c, BoxShape{Vec3(0.2617, 0.4493, 0.2713 * z), Vec3(0.6319, 0.5707, 0.7121 * z)}, Vec3(0, -0.3, 0));
  c.bodies[1].material = 1, c.bodies[2].material = 2;
  c.faces[2].type = FaceType::wall, c.faces[2].friction = 0.4;
  c.domain.gravity = Vec3(0, -0.7, 0);
  return c;
}

/// Of one body: mass, centre, velocity, angular momentum and mean stress.
template <int Dim>
std::vector<BodyState> states_after(const Case& c, int steps, Totals* totals = nullptr) {
  Simulation<Dim> simulation(c, MPI_COMM_SELF);
  for (int i = 0; i < steps; ++i) simulation.step(1e300);
  simulation.step_state();
  if (totals) *totals = simulation.totals();
  return body_states(simulation);
}

/// How a transformation maps vectors; axial ones also change sign with the handedness.
struct Map {
  Mat3 turn = Mat3::Identity();
  Vec3 shift = Vec3::Zero();
  Vec3 of_vector(const Vec3& v) const { return turn * v; }
  Vec3 of_position(const Vec3& x) const { return turn * x + shift; }
  Vec3 of_axial(const Vec3& w) const { return turn.determinant() * (turn * w); }
};

/// The case as the map has it: faces, bodies and gravity. Permutations and reflections of the axes about the domain's
/// middle alone.
Case mapped(Case c, const Map& map) {
  const Case from = c;
  for (auto& body : c.bodies) {
    if (auto* ball = std::get_if<Ball>(&body.shape)) {
      ball->centre = map.of_position(ball->centre);
    } else {
      auto& box = std::get<BoxShape>(body.shape);
      const Vec3 a = map.of_position(box.lower), b = map.of_position(box.upper);
      box.lower = a.cwiseMin(b), box.upper = a.cwiseMax(b);
    }
    body.velocity = map.of_vector(body.velocity);
    body.angular_velocity = map.of_axial(body.angular_velocity);
  }
  c.domain.gravity = Vec3(map.of_vector(c.domain.gravity.at(0)));
  for (int face = 0; face < 2 * c.domain.dimension; ++face) {
    Vec3 outward = Vec3::Zero();
    outward[face / 2] = face % 2 ? 1 : -1;
    outward = map.of_vector(outward);
    for (int d = 0; d < 3; ++d)
      if (outward[d] != 0) c.faces[2 * d + (outward[d] > 0)] = from.faces[face];
  }
  return c;
}

/// States of `there` are those of `here` under the map, to `tolerance` of the case's own scales; `order[b]` is the
/// number there of body b.
void expect_same(const std::vector<BodyState>& here, const std::vector<BodyState>& there, const Map& map,
                 double tolerance, const std::vector<int>& order = {}) {
  ASSERT_GE(there.size(), here.size());
  for (const BodyState& a : here) {
    const std::size_t number = order.empty() ? a.body : order[a.body];
    const BodyState& b = there[number];
    EXPECT_LE(std::abs(a.mass - b.mass), tolerance * a.mass) << "body " << a.body;
    EXPECT_LE((map.of_position(a.centre) - b.centre).norm(), tolerance) << "body " << a.body;
    EXPECT_LE((map.of_vector(a.velocity) - b.velocity).norm(), tolerance) << "body " << a.body;
    EXPECT_LE((map.of_axial(a.angular_momentum) - b.angular_momentum).norm(), tolerance * a.mass * 0.17)
        << "body " << a.body;
    double trace_a = 0, trace_b = 0;
    for (int i = 0; i < 3; ++i) trace_a += a.mean_stress[i], trace_b += b.mean_stress[i];
    EXPECT_LE(std::abs(trace_a - trace_b), tolerance * soft_bulk) << "body " << a.body;
  }
}

template <int Dim>
constexpr int steps = Dim == 2 ? 60 : 30;

/// Calls check(case) for every setting.
template <int Dim, class F>
void for_settings(F&& check) {
  for (const auto& setting : settings()) {
    SCOPED_TRACE(setting.name);
    Case c = base_case(Dim);
    setting.set(c);
    check(c);
  }
}

constexpr double rounding = 1e-9;  // what rounding errors grow to in so many steps

template <int Dim>
void check_maps(const std::vector<Map>& maps) {
  for_settings<Dim>([&](const Case& c) {
    const auto here = states_after<Dim>(c, steps<Dim>);
    double moved = 0;  // the bodies meet: the fall alone would leave this velocity
    for (int b = 0; b < 2; ++b) moved = std::max(moved, std::abs(here[b].velocity[0] - c.bodies[b].velocity[0]));
    EXPECT_GT(moved, 0.01);
    for (const Map& map : maps) expect_same(here, states_after<Dim>(mapped(c, map), steps<Dim>), map, rounding);
  });
}

Map reflection(int d) {
  Map map;
  map.turn(d, d) = -1, map.shift[d] = 1;
  return map;
}
Map exchange(int a, int b) {
  Map map;
  map.turn.col(a).swap(map.turn.col(b));
  return map;
}
Map quarter_turn() {
  Map map;
  map.turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  map.shift[0] = 1;
  return map;
}
TEST(Metamorphic, MirroredExchangedAndTurned2D) {
  check_maps<2>({reflection(0), reflection(1), exchange(0, 1), quarter_turn()});
}
TEST(Metamorphic, MirroredExchangedAndTurned3D) {
  check_maps<3>({reflection(0), reflection(2), exchange(0, 2), exchange(1, 2), quarter_turn()});
}

/// By whole cells along the wall, across the end of the period.
template <int Dim>
void check_shifts() {
  for_settings<Dim>([&](Case c) {
    c.domain.periodic[0] = true, c.faces[0].type = c.faces[1].type = FaceType::periodic;
    const auto here = states_after<Dim>(c, steps<Dim>);
    for (const int cells : {3, 9}) {
      Map map;
      map.shift[0] = cells / 16.0;
      Case there = mapped(c, map);
      std::vector<double> wrapped(there.bodies.size(), 0);
      for (std::size_t b = 0; b < there.bodies.size(); ++b) {
        auto& shape = there.bodies[b].shape;
        if (centre(shape)[0] < 1) continue;
        wrapped[b] = 1;
        if (auto* ball = std::get_if<Ball>(&shape)) ball->centre[0] -= 1;
        if (auto* box = std::get_if<BoxShape>(&shape)) box->lower[0] -= 1, box->upper[0] -= 1;
      }
      auto states = states_after<Dim>(there, steps<Dim>);
      for (std::size_t b = 0; b < states.size(); ++b) states[b].centre[0] += wrapped[b];
      expect_same(here, states, map, rounding);
    }
  });
}
TEST(Metamorphic, ShiftedAcrossAPeriod2D) { check_shifts<2>(); }
TEST(Metamorphic, ShiftedAcrossAPeriod3D) { check_shifts<3>(); }

/// Other units of length, time and mass, by powers of two: the same bits but for the scale.
template <int Dim>
void check_units() {
  for_settings<Dim>([&](const Case& c) {
    const auto here = states_after<Dim>(c, steps<Dim>);
    const double length = 0.25, time = 8, mass = 1024;
    Case there = c;
    there.domain.upper *= length, there.domain.gravity = Vec3(there.domain.gravity.at(0) * length / (time * time));
    const double density = mass / std::pow(length, Dim), pressure = density * length * length / (time * time);
    for (auto& material : there.materials) {
      material.density *= density;
      for (auto& [name, value] : material.parameters) value *= pressure;
    }
    for (auto& body : there.bodies) {
      if (auto* ball = std::get_if<Ball>(&body.shape)) ball->centre *= length, ball->radius *= length;
      if (auto* box = std::get_if<BoxShape>(&body.shape)) box->lower *= length, box->upper *= length;
      body.velocity *= length / time, body.angular_velocity /= time;
    }
    const auto scaled = states_after<Dim>(there, steps<Dim>);
    ASSERT_EQ(scaled.size(), here.size());
    for (std::size_t b = 0; b < here.size(); ++b) {
      EXPECT_EQ(scaled[b].mass, here[b].mass * mass);
      for (int d = 0; d < 3; ++d) {
        EXPECT_EQ(scaled[b].centre[d], here[b].centre[d] * length);
        EXPECT_EQ(scaled[b].velocity[d], here[b].velocity[d] * (length / time));
      }
      for (int i = 0; i < 6; ++i) EXPECT_EQ(scaled[b].mean_stress[i], here[b].mean_stress[i] * pressure);
    }
  });
}
TEST(Metamorphic, OtherUnits2D) { check_units<2>(); }
TEST(Metamorphic, OtherUnits3D) { check_units<3>(); }

void expect_bits(std::vector<BodyState> here, const std::vector<BodyState>& there) {
  if (here.size() > 2) here.pop_back();  // what is rigid moves as it must
  ASSERT_GE(there.size(), here.size());
  for (std::size_t b = 0; b < here.size(); ++b) {
    EXPECT_EQ(there[b].centre, here[b].centre) << "body " << b;
    EXPECT_EQ(there[b].velocity, here[b].velocity) << "body " << b << ", " << there[b].velocity - here[b].velocity;
    EXPECT_EQ(there[b].angular_momentum, here[b].angular_momentum) << "body " << b;
    EXPECT_EQ(there[b].mean_stress, here[b].mean_stress) << "body " << b;
  }
}

/// A body far away, a material that no body has, the density of what is rigid, and a larger domain: the same bits.
template <int Dim>
void check_bystanders() {
  for_settings<Dim>([&](Case c) {
    c.domain.upper = 2 * c.domain.upper;  // with room for a bystander; the patches at the bodies stay as they are
    for (int d = 0; d < Dim; ++d) c.domain.cells[d] *= 2;
    c.domain.gravity = Vec3(Vec3::Zero());
    c.time.dt = 0.004;  // a bystander may have the largest wave speed
    const auto here = states_after<Dim>(c, steps<Dim>);
    const auto check = [&](const char* what, const std::function<void(Case&)>& change) {
      SCOPED_TRACE(what);
      Case there = c;
      change(there);
      expect_bits(here, states_after<Dim>(there, steps<Dim>));
    };
    check("a bystander", [](Case& there) {
      add_body(there, Ball{Vec3(1.6, 1.6, Dim == 3 ? 1.6 : 0), 0.2}, Vec3(0.1, 0, 0));
    });
    check("a material without bodies", [](Case& there) {
      Material stiff = there.materials[0];
      stiff.name = "stiff", stiff.parameters = {{"shear_modulus", 4e9}, {"bulk_modulus", 8e9}};
      there.materials.push_back(stiff);
    });
    check("a heavier stone", [](Case& there) { there.materials[2].density *= 0x1p20; });
    check("a larger domain", [](Case& there) { there.domain.upper[0] = 4, there.domain.cells[0] = 64; });
  });
}
TEST(Metamorphic, BystandersChangeNothing2D) { check_bystanders<2>(); }
TEST(Metamorphic, BystandersChangeNothing3D) { check_bystanders<3>(); }

/// One body alone on a wall, and another far away.
TEST(Metamorphic, ABystanderOfABodyOnAWallChangesNothing) {
  for_settings<2>([&](Case c) {
    c.domain.upper *= 2, c.domain.cells = {32, 32, 1};
    c.bodies.resize(1);
    c.time.dt = 0.004;
    const auto here = states_after<2>(c, 80);
    add_body(c, Ball{Vec3(1.6, 1.6, 0), 0.2});
    expect_bits(here, states_after<2>(c, 80));
  });
}

/// Patches of another size, and bodies in another order.
template <int Dim>
void check_partition() {
  for_settings<Dim>([&](const Case& c) {
    const auto here = states_after<Dim>(c, steps<Dim>);
    const auto check = [&](const char* what, const std::vector<int>& order, const std::function<void(Case&)>& change) {
      SCOPED_TRACE(what);
      Case there = c;
      change(there);
      expect_same(here, states_after<Dim>(there, steps<Dim>), {}, rounding, order);
    };
    check("patches", {}, [](Case& there) { there.domain.patch_cells = 7; });
    check("exchanged", {1, 0, 2}, [](Case& there) { std::swap(there.bodies[0], there.bodies[1]); });
    check("rigid first", {1, 2, 0},
          [](Case& there) { std::rotate(there.bodies.begin(), there.bodies.begin() + 2, there.bodies.end()); });
  });
}
TEST(Metamorphic, OtherPatchesAndOrder2D) { check_partition<2>(); }
TEST(Metamorphic, OtherPatchesAndOrder3D) { check_partition<3>(); }

/// Seen from a frame that moves by a whole number of cells, momentum passes between the bodies as before, up to what
/// the grid that they cross in between does to it.
TEST(Metamorphic, AMovingFrame) {
  for_settings<2>([&](Case c) {
    c.faces[2].type = FaceType::free, c.domain.gravity = Vec3(Vec3::Zero());
    c.bodies.pop_back();
    c.domain.periodic = {true, true, false};
    for (int face = 0; face < 4; ++face) c.faces[face].type = FaceType::periodic;
    c.time.dt = 0.002;
    const auto here = states_after<2>(c, 125);
    const Vec3 frame(1, 0.5, 0);  // four and two cells in this time
    Case there = c;
    for (auto& body : there.bodies) body.velocity += frame;
    const auto states = states_after<2>(there, 125);
    const double passed = (here[0].velocity - c.bodies[0].velocity).norm();
    EXPECT_GT(passed, 0.1);
    EXPECT_LE((states[0].velocity - frame - here[0].velocity).norm(), 0.1 * passed);
  });
}

}  // namespace
}  // namespace cairn
