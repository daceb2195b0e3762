// Sums over patches, on any number of ranks: against plain global sums, and bit for bit against the same patches on one
// rank.

#include "../support/world.hpp"

namespace cairn {
namespace {

using namespace test;

/// mass, momentum, volume, gradient, force and extras of all points at one node.
template <int Dim>
using NodeValues = std::array<double, NodeSums<Dim>::used + Dim + NodeExtras<Dim>::used>;

/// Global sums by body and node (reduced to one period): every point to all nodes within three cells, whatever its
/// weight.
template <int Dim>
std::map<std::pair<int, Index<Dim>>, NodeValues<Dim>> naive_sums(const World<Dim>& world,
                                                                 const std::vector<GlobalPoint<Dim>>& points) {
  std::map<std::pair<int, Index<Dim>>, NodeValues<Dim>> sums;
  const test::Formula shape = formula_of(ShapeFunction::gimp, {0.25, 0.25, 0.25});
  const Vec<Dim> gravity = Vec<Dim>::Constant(-3);
  for (const auto& point : points) {
    Box<Dim> near;
    for (int d = 0; d < Dim; ++d) {
      near.lower[d] = static_cast<int>(std::floor(world.lattice.scaled(d, point.state.x[d]))) - 2;
      near.upper[d] = near.lower[d] + 6;
    }
    for_each(near, [&](const Index<Dim>& i) {
      const auto [w, g] = weight_of(world.lattice, shape, point.state.x, i);
      if (w == 0) return;
      const double m = density * point.state.volume0, V = point.state.volume();
      const Mat3 flux = V * point.state.stress;
      NodeValues<Dim>& at = sums[{point.body, canonical(world.lattice, i)}];
      double* to = at.data();
      *to++ += m * w;
      Vec<Dim> arm;
      for (int d = 0; d < Dim; ++d) arm[d] = world.lattice.node_position(d, i[d]) - point.state.x[d];
      const Vec<Dim> v = point.state.v + turning<Dim>(point.state.spin, arm);
      for (int d = 0; d < Dim; ++d) *to++ += m * w * v[d];
      *to++ += V * w;
      for (int d = 0; d < Dim; ++d) *to++ += V * g[d];
      for (int d = 0; d < Dim; ++d) {
        *to += m * w * gravity[d];
        for (int e = 0; e < Dim; ++e) *to -= flux(d, e) * g[e];
        ++to;
      }
      if constexpr (Dim == 2)
        *to++ += w * flux(0, 0), *to++ += w * flux(1, 1), *to++ += w * flux(0, 1);
      else
        for (auto [r, c] : {std::pair{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}}) *to++ += w * flux(r, c);
      for (int d = 0; d < Dim; ++d) *to++ += w * V * (point.state.x[d] - world.lattice.node_position(d, i[d]));
    });
  }
  return sums;
}

/// The same numbers as a piece holds them.
template <int Dim>
NodeValues<Dim> values_at(const NodeBox<Dim>& nodes, const std::type_identity_t<Index<Dim>>& i) {
  NodeValues<Dim> values{};
  if (!nodes.box.contains(i)) return values;
  const std::size_t at = nodes.box.offset(i);
  auto to = std::copy_n(nodes.sums.data() + at * NodeSums<Dim>::width, NodeSums<Dim>::used, values.begin());
  to = std::copy_n(nodes.force.data() + at * vector_width, Dim, to);
  std::copy_n(nodes.extras.data() + at * NodeExtras<Dim>::width, NodeExtras<Dim>::used, to);
  return values;
}

/// Every node of every patch, for every body, holds the complete sums; those of a body it does not know vanish.
template <int Dim>
void expect_naive_sums(World<Dim>& world, const std::vector<GlobalPoint<Dim>>& points) {
  const auto expected = naive_sums(world, points);
  NodeValues<Dim> largest{};
  for (const auto& [key, values] : expected)
    for (std::size_t i = 0; i < values.size(); ++i) largest[i] = std::max(largest[i], std::abs(values[i]));
  double worst = 0, worst_again = 0;
  for (auto& patch : world.patches)
    for (int body = 0; body < body_count; ++body) {
      const NodeBox<Dim> none{};
      const NodeBox<Dim>* nodes = &none;
      for (const auto& piece : patch.pieces)
        if (piece.body == body) nodes = &piece.nodes;
      EXPECT_TRUE(nodes->box.empty() || patch.nodes.contains(nodes->box));
      for_each(patch.nodes, [&](const Index<Dim>& i) {
        const auto at = expected.find({body, canonical(world.lattice, i)});
        const NodeValues<Dim> sums = at == expected.end() ? NodeValues<Dim>{} : at->second;
        const NodeValues<Dim> found = values_at(*nodes, i);
        for (std::size_t k = 0; k < sums.size(); ++k)
          worst = std::max(worst, std::abs(found[k] - sums[k]) / largest[k]);
        if (!nodes->box.contains(i)) return;
        for (int d = 0; d < Dim; ++d)
          worst_again =
              std::max(worst_again, std::abs(nodes->velocity[nodes->box.offset(i) * vector_width + d] - sums[1 + d]) /
                                        largest[1 + d]);
      });
    }
  EXPECT_LE(worst, 1e-12);
  EXPECT_LE(worst_again, 1e-12);
}

/// A node's sums have the same bits in every patch (all patches on one rank).
template <int Dim>
void expect_patches_agree(const World<Dim>& world) {
  std::map<std::pair<int, Index<Dim>>, NodeValues<Dim>> seen;
  int compared = 0;
  for (const auto& patch : world.patches)
    for (const auto& piece : patch.pieces)
      for_each(piece.nodes.box, [&](const Index<Dim>& i) {
        const auto values = values_at(piece.nodes, i);
        const auto [at, is_new] = seen.emplace(std::pair(piece.body, canonical(world.lattice, i)), values);
        compared += !is_new;
        if (!is_new) {
          EXPECT_EQ(at->second, values) << "body " << piece.body << " in patch " << patch.id;
        }
      });
  EXPECT_TRUE(compared > 0 || world.lattice.patch_count() == 1);
}

template <int Dim>
void check_sums(const Lattice<Dim>& lattice) {
  const auto points = make_points(lattice, Dim == 2 ? 150 : 80);
  World<Dim> world(lattice, points, MPI_COMM_WORLD), alone(lattice, points, MPI_COMM_SELF);
  for (World<Dim>* w : {&world, &alone}) {
    w->sum_points();
    w->sum_momentum();
  }
  expect_naive_sums(world, points);
  expect_same_bits(world.patches, alone);
  expect_patches_agree(alone);
}

TEST(NodeExchange, SumsAreCompleteAndTheSameBits2D) { for_lattices<2>(check_sums<2>); }
TEST(NodeExchange, SumsAreCompleteAndTheSameBits3D) { for_lattices<3>(check_sums<3>); }

TEST(NodeExchange, GhostsComeAndGo) {
  const auto lattice = lattice_of<2>({8, 8}, {false, false}, 4);
  std::vector<GlobalPoint<2>> points;
  Random random;
  const auto at = [&](double x, double y) {
    return Vec<2>(lattice.lower()[0] + x * lattice.spacing()[0], lattice.lower()[1] + y * lattice.spacing()[1]);
  };
  for (int body = 0; body < 2; ++body) points.push_back({body, body, random_point<2>(random, at(3.9, 1.4), 1)});
  World<2> world(lattice, points, MPI_COMM_WORLD);
  const auto bodies_in = [&](int id) {
    std::vector<std::pair<int, int>> bodies;  // body, points
    if (Patch<2>* patch = world.patch(id))
      for (const auto& piece : patch->pieces) bodies.emplace_back(piece.body, piece.points.size());
    return bodies;
  };
  using Bodies = std::vector<std::pair<int, int>>;
  world.sum_points();
  if (world.patch(0)) {
    EXPECT_EQ(bodies_in(0), (Bodies{{0, 1}, {1, 1}}));
  }
  if (world.patch(1)) {  // known from the neighbour
    EXPECT_EQ(bodies_in(1), (Bodies{{0, 0}, {1, 0}}));
  }
  if (world.patch(3)) {  // its nodes start higher up
    EXPECT_EQ(bodies_in(3), Bodies{});
  }
  // Body 1 leaves for the middle of patch 0, out of its neighbours' sight.
  if (Patch<2>* patch = world.patch(0)) patch->pieces[1].points.column(0)[0] = at(1.4, 0)[0];
  world.sum_points();
  if (world.patch(1)) {
    EXPECT_EQ(bodies_in(1), (Bodies{{0, 0}}));
  }
  if (world.patch(0)) {
    EXPECT_EQ(bodies_in(0).size(), 2u);
  }
  // And back.
  if (Patch<2>* patch = world.patch(0)) patch->pieces[1].points.column(0)[0] = at(3.9, 0)[0];
  world.sum_points();
  if (world.patch(1)) {
    EXPECT_EQ(bodies_in(1), (Bodies{{0, 0}, {1, 0}}));
  }
}

}  // namespace
}  // namespace cairn
