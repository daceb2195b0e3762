// Contact at a node shared by two, three and four bodies.

#include <gtest/gtest.h>

#include "../support/node_patch.hpp"

namespace cairn {
namespace {

using namespace test;
using V = Vec<2>;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Fails unless found and expected agree to round-off.
template <int Dim>
void expect_close(const Vec<Dim>& found, const Vec<Dim>& expected, double size = 1) {
  EXPECT_LE((found - expected).norm(), 1e-14 * size) << found.transpose() << " for " << expected.transpose();
}

template <class F>
void for_laws(F&& check) {
  for (ContactLaw law : {ContactLaw::stick, ContactLaw::frictionless, ContactLaw::friction})
    for (Release release : {Release::approach, Release::traction, Release::reaction})
      for (double limit : {0.0, 1e-3}) {
        SCOPED_TRACE(testing::Message() << "law " << static_cast<int>(law) << ", release " << static_cast<int>(release)
                                        << ", limit " << limit);
        ContactOptions options = options_of(law, release);
        options.impulse_limit = limit;
        check(options);
      }
}

/// Momentum of the node before and after every pass, for 2, 3 and 4 bodies of random properties.
template <int Dim>
void check_momentum(const ContactOptions& options) {
  Random random(3);
  int acted = 0;
  for (int k = 0; k < 300; ++k) {
    std::vector<NodeBody<Dim>> list;
    for (int b = 0; b < 2 + k % 3; ++b) list.push_back(random_body<Dim>(random));
    NodePatch<Dim> node(list);
    const auto settings = node.settings(options);
    const int n = static_cast<int>(list.size());
    const auto total = [&](auto&& of_body) {
      Vec<Dim> sum = Vec<Dim>::Zero();
      for (int b = 0; b < n; ++b) sum += of_body(b);
      return sum;
    };
    const Vec<Dim> p = total([&](int b) { return node.momentum(b); }), f = total([&](int b) { return node.force(b); });
    node.first(settings);
    for (int b = 0; b < n; ++b) acted += node.momentum(b) != list[b].momentum;
    expect_close<Dim>(total([&](int b) { return node.momentum(b); }), p, 10);
    node.second(settings);
    for (int b = 0; b < n; ++b) acted += node.force(b) != list[b].force;
    expect_close<Dim>(total([&](int b) { return node.force(b); }), f, 1000 / node.dt);
    node.repeat(settings);
    expect_close<Dim>(total([&](int b) { return node.projected(b); }), p, 10);
  }
  EXPECT_GT(acted, 300);
}
TEST(ContactSweep, ImpulsesSumToZero) {
  for_laws(check_momentum<2>);
  for_laws(check_momentum<3>);
}

template <int Dim>
void check_sticking(ContactLaw law) {
  Random random(4);
  for (int n = 2; n <= 4; ++n) {
    std::vector<NodeBody<Dim>> list;
    double M = 0;
    Vec<Dim> p = Vec<Dim>::Zero(), f = p;
    for (int b = 0; b < n; ++b) {
      list.push_back(random_body<Dim>(random));
      M += list[b].mass, p += list[b].momentum, f += list[b].force;
    }
    NodePatch<Dim> node(list);
    const auto settings = node.settings(options_of(law));
    node.first(settings);
    for (int b = 0; b < n; ++b) expect_close<Dim>(node.momentum(b) / node.mass(b), p / M, 100);
    node.second(settings);
    for (int b = 0; b < n; ++b) expect_close<Dim>(node.updated(b) / node.mass(b), (p + node.dt * f) / M, 100);
    node.repeat(settings);
    for (int b = 0; b < n; ++b) expect_close<Dim>(node.projected(b) / node.mass(b), p / M, 100);
  }
}
TEST(ContactSweep, StickingGivesTheCentreOfMassVelocity) {
  for (ContactLaw law : {ContactLaw::stick, ContactLaw::none}) {
    check_sticking<2>(law);
    check_sticking<3>(law);
  }
}

TEST(ContactSweep, FrictionOfAPairWorkedByHand) {
  // v_cm = (1, 0.5). Body 0: P = (4,2) - (1,0.5) = (3, 1.5); with mu = 0.3 it gets (-3, -0.9).
  NodePatch<2> node(meeting_pair());
  node.first(node.settings(options_of(ContactLaw::friction, Release::approach)));
  expect_close<2>(node.momentum(0), V(1, 1.1), 10);
  expect_close<2>(node.momentum(1), V(3, 0.9), 10);
  NodePatch<2> smooth(meeting_pair());
  smooth.first(smooth.settings(options_of(ContactLaw::frictionless, Release::approach)));
  expect_close<2>(smooth.momentum(0), V(1, 2), 10);
}

TEST(ContactSweep, ReactionDecidesOnceAndKeepsIt) {
  // P0 = (3, 1.5) as above; F0 = f_0 - f/4 = (-400, 0): thrown apart by the end of the step.
  auto list = meeting_pair();
  list[0].force = V(-400, 0), list[1].force = V(400, 0);
  NodePatch<2> node(list);
  const auto settings = node.settings(options_of(ContactLaw::friction));
  node.first(settings);
  node.second(settings);
  node.repeat(settings);
  for (int b = 0; b < 2; ++b) {
    EXPECT_EQ(node.momentum(b), list[b].momentum);
    EXPECT_EQ(node.force(b), list[b].force);
    EXPECT_EQ(node.projected(b), list[b].momentum);
  }
  // Half the force: held. The first pass stops the approach, the second has nothing to push, and what is projected
  // again is held without friction, for it pulls apart.
  list[0].force = V(-200, 0), list[1].force = V(200, 0);
  NodePatch<2> held(list);
  held.first(settings);
  expect_close<2>(held.momentum(0), V(1, 2), 10);
  held.second(settings);
  expect_close<2>(held.force(0), list[0].force, 1000);
  held.repeat(settings);
  expect_close<2>(held.projected(0), V(1, 2), 10);
}

TEST(ContactSweep, CommonNormalIsThatOfTheFlatterSurface) {
  const auto after = [](double volume_0, V gradient_0, double volume_1, V gradient_1) {
    auto list = meeting_pair();
    list[0].volume = volume_0, list[0].gradient = gradient_0;
    list[1].volume = volume_1, list[1].gradient = gradient_1;
    NodePatch<2> node(list);
    node.first(node.settings(options_of(ContactLaw::frictionless, Release::approach)));
    return V(node.momentum(0));
  };
  const V straight(1, 2), tilted(4 - 2.25, 2 - 2.25);  // P . (1,1)/2 = 2.25
  // A corner of body 0 on a face of body 1; a face of body 0 at 45 degrees and a corner of body 1.
  expect_close<2>(after(0.0625, V(0.25, 0.125), 0.5, V(-1, 0)), straight, 10);
  expect_close<2>(after(0.5, V(1, 1) * std::sqrt(0.5), 0.25, V(-0.2, 0)), tilted, 10);
  // Points whose squares overlap make a foot of body 0 steeper than any flat surface: the face of body 1 counts.
  expect_close<2>(after(0.6, V(1.3, 0.6), 0.5, V(-1, 0)), straight, 10);
}

TEST(ContactSweep, WithoutAnyGradientNothingHappens) {
  auto list = meeting_pair();
  list[0].gradient = list[1].gradient = V(0, 0);
  NodePatch<2> node(list);
  node.first(node.settings(options_of(ContactLaw::friction, Release::approach)));
  EXPECT_EQ(node.momentum(0), list[0].momentum);
}

/// Eq. 23 of Bardenhagen, Brackbill & Sulsky 2000 as printed, with eqs. 21 and 22.
template <int Dim>
Vec<Dim> equation_23(const Vec<Dim>& v, const Vec<Dim>& v_cm, const Vec<Dim>& outward, double mu) {
  Vec3 dv = Vec3::Zero(), n = Vec3::Zero();
  dv.head<Dim>() = v - v_cm, n.head<Dim>() = outward;
  const double approach = dv.dot(n);
  if (approach <= 0) return v;
  const Vec3 cross = dv.cross(n), omega = cross.normalized();
  const double mu_dash = std::min(mu, cross.norm() / approach);
  const Vec3 change = approach * (n + mu_dash * n.cross(omega));
  return v - change.head<Dim>();
}

template <int Dim>
void check_own_normals() {
  Random random(5);
  int changed = 0;
  for (int k = 0; k < 200; ++k) {
    std::vector<NodeBody<Dim>> list;
    for (int b = 0; b < 2 + k % 3; ++b) list.push_back(random_body<Dim>(random));
    ContactOptions options = options_of(ContactLaw::friction, Release::approach, 0.4);
    options.normal_choice = NormalChoice::own;
    NodePatch<Dim> node(list);
    node.first(node.settings(options));
    double M = 0;
    Vec<Dim> p = Vec<Dim>::Zero();
    for (const auto& body : list) M += body.mass, p += body.momentum;
    for (std::size_t b = 0; b < list.size(); ++b) {
      const Vec<Dim> v = equation_23<Dim>(list[b].velocity(), p / M, list[b].gradient.normalized(), 0.4);
      expect_close<Dim>(node.momentum(static_cast<int>(b)) / list[b].mass, v, 100);
      changed += v != list[b].velocity();
    }
  }
  EXPECT_GT(changed, 100);
}
TEST(ContactSweep, OwnNormalsReproduceEquation23) {
  check_own_normals<2>();
  check_own_normals<3>();
}

/// A rigid body of any mass keeps its motion; what sticks to it takes its velocity.
template <int Dim>
void check_rigid_partner(const ContactOptions& options, bool sticks) {
  Random random(6);
  for (int k = 0; k < 50; ++k) {
    std::vector<NodeBody<Dim>> list;
    for (int b = 0; b < 2 + k % 3; ++b) list.push_back(random_body<Dim>(random));
    list[0].rigid = true, list[0].mass = 0.1;  // lighter than the others
    list[0].gradient = 10 * Vec<Dim>::UnitX(), list[0].force.setZero();
    for (std::size_t b = 1; b < list.size(); ++b) {  // all come towards it, and are pressed on
      list[b].gradient = -Vec<Dim>::UnitX();
      list[b].momentum[0] = list[b].mass * (list[0].velocity()[0] - random(1, 2));
      list[b].force[0] = -1000 * list[b].mass;
    }
    NodePatch<Dim> node(list);
    const auto settings = node.settings(options);
    node.first(settings);
    node.second(settings);
    node.repeat(settings);
    EXPECT_EQ(node.momentum(0), list[0].momentum);
    EXPECT_EQ(node.force(0), list[0].force);
    EXPECT_EQ(node.projected(0), list[0].momentum);
    const Vec<Dim> v = list[0].velocity();
    for (int b = 1; b < static_cast<int>(list.size()); ++b) {
      EXPECT_NEAR(node.momentum(b)[0] / node.mass(b), v[0], 1e-12);
      EXPECT_NEAR(node.updated(b)[0] / node.mass(b), v[0], 1e-12);
      EXPECT_NEAR(node.projected(b)[0] / node.mass(b), v[0], 1e-12);
      if (!sticks) continue;
      expect_close<Dim>(node.momentum(b) / node.mass(b), v, 1000);
      expect_close<Dim>(node.updated(b) / node.mass(b), v, 1000);
      expect_close<Dim>(node.projected(b) / node.mass(b), v, 1000);
    }
  }
}
TEST(ContactSweep, RigidPartnerSetsTheVelocity) {
  check_rigid_partner<2>(options_of(ContactLaw::stick), true);
  check_rigid_partner<3>(options_of(ContactLaw::stick), true);
  for (Release release : {Release::approach, Release::reaction}) {
    check_rigid_partner<2>(options_of(ContactLaw::friction, release, infinity), true);
    check_rigid_partner<3>(options_of(ContactLaw::friction, release, infinity), true);
    check_rigid_partner<2>(options_of(ContactLaw::friction, release, 0.1), false);
    check_rigid_partner<3>(options_of(ContactLaw::frictionless, release), false);
  }
}

TEST(ContactSettings, PairTable) {
  ContactOptions options = options_of(ContactLaw::friction, Release::approach, 0.3);
  options.pairs = {{0, 1, ContactLaw::frictionless, 9.0},
                   {2, 2, ContactLaw::stick, 0.0},
                   {1, 2, ContactLaw::friction, 0.7},
                   {-1, 0, ContactLaw::stick, 0.0}};
  const auto settings = ContactSettings<2>::make(options, std::vector<ContactMaterial>(3), {});
  const auto expect = [&](int a, int b, ContactLaw law, double mu) {
    for (const PairLaw& pair : {settings.pair(a, b), settings.pair(b, a)}) {
      EXPECT_EQ(pair.law, law) << a << b;
      EXPECT_EQ(pair.friction, mu) << a << b;
    }
  };
  expect(0, 0, ContactLaw::friction, 0.3);
  expect(0, 1, ContactLaw::frictionless, 0);
  expect(0, 2, ContactLaw::friction, 0.3);
  expect(1, 1, ContactLaw::friction, 0.3);
  expect(1, 2, ContactLaw::friction, 0.7);
  expect(2, 2, ContactLaw::stick, 0);
}

TEST(ContactSweep, PairsOfMaterialsActByTheirOwnLaw) {
  ContactOptions options = options_of(ContactLaw::friction, Release::approach, 0.3);
  options.pairs = {{0, 1, ContactLaw::frictionless, 0.0}};
  auto list = meeting_pair();
  list[1].material = 1;
  NodePatch<2> node(list);
  node.first(node.settings(options, 2));
  expect_close<2>(node.momentum(0), V(1, 2), 10);
  list[0].material = 1;
  NodePatch<2> same(list);
  same.first(same.settings(options, 2));
  expect_close<2>(same.momentum(0), V(1, 1.1), 10);
}

TEST(ContactSweep, OnePassOnly) {
  auto list = meeting_pair();
  ContactOptions options = options_of(ContactLaw::friction, Release::approach);
  options.passes = Passes::after;
  NodePatch<2> after(list);
  after.first(after.settings(options));
  EXPECT_EQ(after.momentum(0), list[0].momentum);
  after.second(after.settings(options));
  expect_close<2>(after.updated(0), V(1, 1.1), 10);
  expect_close<2>(after.updated(1), V(3, 0.9), 10);
  // Before only: the nodes' momenta return to what they were, and the impulse reaches the points through the force.
  options.passes = Passes::before;
  NodePatch<2> before(list);
  before.first(before.settings(options));
  expect_close<2>(before.momentum(0), V(1, 1.1), 10);
  before.second(before.settings(options));
  expect_close<2>(before.momentum(0), list[0].momentum, 10);
  expect_close<2>(before.updated(0), V(1, 1.1), 10);
}

TEST(ContactSweep, LedgerBooksTheEnergyLost) {
  // After the update only, with momenta that come back from the points unchanged: what these lose is what it gains.
  ContactOptions options = options_of(ContactLaw::friction, Release::approach);
  options.passes = Passes::after;
  NodePatch<2> node(meeting_pair());
  node.first(node.settings(options));
  node.second(node.settings(options));
  node.project_updated();
  node.repeat(node.settings(options));
  const double before = 0.5 * V(4, 2).squaredNorm(), now = 0.5 * V(1, 1.1).squaredNorm() + V(3, 0.9).squaredNorm() / 6;
  EXPECT_NEAR(node.patch.ledger.contact_dissipation, before - now, 1e-13);
  EXPECT_EQ(node.patch.ledger.boundary_work, 0);
  EXPECT_EQ(node.patch.ledger.contact_nodes, 1);
}

TEST(ContactSweep, KeepsWhatPassesBetweenPairs) {
  auto list = meeting_pair();
  ContactOptions options = options_of(ContactLaw::friction, Release::approach);
  options.passes = Passes::after;
  NodePatch<2> node(list);
  auto settings = node.settings(options);
  settings.keep_contacts = true;
  node.first(settings);
  node.second(settings);
  ASSERT_EQ(node.patch.contacts.size(), 1u);
  const auto& [pair, sum] = *node.patch.contacts.begin();
  EXPECT_EQ(pair, std::pair(0, 1));
  const double size = V(3, 0.9).norm();
  const std::vector<double> expected = {size, -3, -0.9, 3 * size, 3 * size, size, 0};  // normal from 0 to 1: +x
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(sum.values[i], expected[i], 1e-13) << i;
}

}  // namespace
}  // namespace cairn
