// Sums over patches and migration of points, on any number of ranks: against plain global sums, and bit for bit against
// the same patches on one rank.

#include <gtest/gtest.h>
#include <mpi.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "../support/lattices.hpp"
#include "../support/pieces.hpp"
#include "cairn/parallel/distribution.hpp"
#include "cairn/parallel/migration.hpp"
#include "cairn/parallel/node_exchange.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr double density = 1300;
constexpr int body_count = 4;

/// A point anywhere in the domain, the same list on every rank.
template <int Dim>
struct GlobalPoint {
  std::int64_t id;
  int body;
  PointState<Dim> state;
};

template <int Dim>
Index<Dim> cell_of(const Lattice<Dim>& lattice, const Vec<Dim>& x) {
  Index<Dim> cell;
  for (int d = 0; d < Dim; ++d)
    cell[d] = std::clamp(static_cast<int>(std::floor(lattice.scaled(d, x[d]))), 0, lattice.cells()[d] - 1);
  return cell;
}

/// Bodies as clouds of points that overlap each other and many patches; one lies in a single cell.
template <int Dim>
std::vector<GlobalPoint<Dim>> make_points(const Lattice<Dim>& lattice, int count) {
  Random random(8);
  std::vector<GlobalPoint<Dim>> points;
  for (int p = 0; p < count; ++p) {
    const int body = p % body_count;
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d) {
      const double cells = lattice.cells()[d], margin = lattice.periodic(d) ? 0.0 : 0.45;
      const double lower = body == 1 ? cells / 2 : -margin, upper = body == 2 ? cells / 2 : cells + margin;
      const double xi = body == 3 ? random(3, 4) : random(lower, upper);
      x[d] = lattice.lower()[d] + xi * lattice.spacing()[d];
    }
    points.push_back({p, body, random_point<Dim>(random, x, 1e4)});
  }
  return points;
}

/// The patches of one communicator's ranks, with the points in them.
template <int Dim>
struct World {
  const Lattice<Dim>& lattice;
  std::vector<int> owner;
  std::vector<Patch<Dim>> patches;
  std::unique_ptr<NeighbourExchange> messages;
  std::unique_ptr<NodeExchange<Dim>> exchange;
  std::unique_ptr<Migration<Dim>> migration;
  TransferSettings<Dim> settings;

  World(const Lattice<Dim>& lattice_, const std::vector<GlobalPoint<Dim>>& points, MPI_Comm comm) : lattice(lattice_) {
    int rank = 0, ranks = 1;
    MPI_Comm_rank(comm, &rank), MPI_Comm_size(comm, &ranks);
    owner =
        distribute_patches(lattice, std::vector<std::int64_t>(lattice.patch_count(), 1), ranks, Partition::round_robin);
    std::set<int> neighbours;
    for (int id = 0; id < lattice.patch_count(); ++id) {
      if (owner[id] != rank) continue;
      patches.emplace_back(id, lattice);
      for (const auto& link : patches.back().links) neighbours.insert(owner[link.patch]);
    }
    neighbours.erase(rank);
    for (const auto& point : points) add(point);
    messages = std::make_unique<NeighbourExchange>(comm, std::vector<int>(neighbours.begin(), neighbours.end()));
    exchange = std::make_unique<NodeExchange<Dim>>(*messages, owner);
    migration = std::make_unique<Migration<Dim>>(*messages, owner);
    ContactOptions contact;
    contact.release = Release::traction;
    settings = TransferSettings<Dim>::make(SolverOptions{}, contact, Vec<Dim>::Constant(-3));
    if constexpr (Dim == 3) settings.half_size.fill(0.25);
  }
  Patch<Dim>* patch(int id) {
    for (auto& p : patches)
      if (p.id == id) return &p;
    return nullptr;
  }
  void add(const GlobalPoint<Dim>& point) {
    Patch<Dim>* home = patch(lattice.patch_of_cell(cell_of(lattice, point.state.x)));
    if (home == nullptr) return;
    auto& points = home->piece_of(point.body, 0).points;
    const int p = points.size();
    points.resize(p + 1);
    put_point(points, p, point.state);
    points.ids()[p] = point.id;
    points.images()[p] = {};
  }
  template <class F>
  void for_pieces(F&& f) {
    for (auto& patch : patches)
      for (auto& piece : patch.pieces) f(piece);
  }
  void sum_points() {
    for_pieces([&](auto& piece) { lay_out_nodes(piece, lattice, settings); });
    for_pieces([&](auto& piece) { project(piece, lattice, settings, density); });
    exchange->start_sums(patches, true);
    exchange->finish_sums(patches);
  }
  /// Momentum once more, by the exchange of one array.
  void sum_momentum() {
    for_pieces([&](auto& piece) { project_momentum(piece, lattice, settings, density); });
    exchange->sum(patches, &NodeBox<Dim>::velocity);
  }
};

/// mass, momentum, volume, gradient, force and extras of all points at one node.
template <int Dim>
using NodeValues = std::array<double, NodeSums<Dim>::used + Dim + NodeExtras<Dim>::used>;

/// Global sums by body and node (reduced to one period): every point to all nodes within three cells, whatever its
/// weight.
template <int Dim>
std::map<std::pair<int, Index<Dim>>, NodeValues<Dim>> naive_sums(const World<Dim>& world,
                                                                 const std::vector<GlobalPoint<Dim>>& points) {
  std::map<std::pair<int, Index<Dim>>, NodeValues<Dim>> sums;
  const Formula shape = formula_of(ShapeFunction::gimp, {0.25, 0.25, 0.25});
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
      for (int d = 0; d < Dim; ++d) *to++ += m * w * point.state.v[d];
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

template <int Dim>
void expect_same_bits(const std::vector<Patch<Dim>>& patches, World<Dim>& alone) {
  for (const auto& patch : patches) {
    const Patch<Dim>& other = *alone.patch(patch.id);
    ASSERT_EQ(patch.pieces.size(), other.pieces.size());
    for (std::size_t k = 0; k < patch.pieces.size(); ++k) {
      const auto &a = patch.pieces[k], &b = other.pieces[k];
      EXPECT_EQ(a.body, b.body);
      EXPECT_EQ(a.points.ids(), b.points.ids());
      EXPECT_EQ(a.points.images(), b.points.images());
      for (int c = 0; c < a.points.columns(); ++c)
        EXPECT_TRUE(std::equal(a.points.column(c), a.points.column(c) + a.points.size(), b.points.column(c))) << c;
      EXPECT_EQ(a.nodes.box, b.nodes.box);
      for (auto array : {&NodeBox<Dim>::sums, &NodeBox<Dim>::force, &NodeBox<Dim>::extras, &NodeBox<Dim>::velocity})
        EXPECT_EQ(a.nodes.*array, b.nodes.*array);
    }
  }
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

/// Every choice of periodic directions; periodic directions one, two and three patches wide.
template <int Dim, class F>
void for_lattices(F&& check) {
  for (const auto& lattice : all_lattices<Dim>()) {
    std::string name;
    for (int d = 0; d < Dim; ++d) name += std::to_string(lattice.cells()[d]) + (lattice.periodic(d) ? "p " : " ");
    SCOPED_TRACE(name);
    check(lattice);
  }
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

// Migration -----------------------------------------------------------------------------------------------------------

/// Where each point goes: up to nearly a patch away, within the half cell allowed beyond faces that are not periodic.
template <int Dim>
std::map<std::int64_t, Vec<Dim>> destinations(const Lattice<Dim>& lattice,
                                              const std::vector<GlobalPoint<Dim>>& points) {
  Random random(9);
  std::map<std::int64_t, Vec<Dim>> to;
  for (const auto& point : points) {
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d) {
      double xi = lattice.scaled(d, point.state.x[d]) + random(-3.4, 3.4);
      if (!lattice.periodic(d)) xi = std::clamp(xi, -0.49, lattice.cells()[d] + 0.49);
      x[d] = lattice.lower()[d] + xi * lattice.spacing()[d];
    }
    to[point.id] = x;
  }
  return to;
}

template <int Dim>
Vec<Dim> wrapped(const Lattice<Dim>& lattice, Vec<Dim> x) {
  for (int d = 0; d < Dim; ++d)
    if (lattice.periodic(d)) x[d] -= lattice.length(d) * std::floor(lattice.scaled(d, x[d]) / lattice.cells()[d]);
  return x;
}

/// Ids of every piece after migration by the documented rule: those that stay, then arrivals by (source patch, order
/// there).
template <int Dim>
std::map<std::pair<int, int>, std::vector<std::int64_t>> expected_order(const World<Dim>& before,
                                                                        const std::map<std::int64_t, Vec<Dim>>& to) {
  std::map<std::pair<int, int>, std::vector<std::int64_t>> order;
  for (bool staying : {true, false})
    for (const auto& patch : before.patches)  // ascending
      for (const auto& piece : patch.pieces)
        for (std::int64_t id : piece.points.ids()) {
          const int home = before.lattice.patch_of_cell(cell_of(before.lattice, wrapped(before.lattice, to.at(id))));
          if ((home == patch.id) == staying) order[{home, piece.body}].push_back(id);
        }
  return order;
}

template <int Dim>
void expect_arrived(World<Dim>& world, const std::vector<GlobalPoint<Dim>>& points,
                    const std::map<std::int64_t, Vec<Dim>>& to) {
  std::int64_t count = 0;
  for (auto& patch : world.patches)
    for (auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size(); ++p, ++count) {
        const auto state = get_point(piece.points, p);
        const auto& origin = points[piece.points.ids()[p]];
        EXPECT_TRUE(patch.cells.contains(cell_of(world.lattice, state.x)));
        EXPECT_EQ(piece.body, origin.body);
        EXPECT_EQ(state.v, origin.state.v);
        EXPECT_EQ(state.F, origin.state.F);
        EXPECT_EQ(state.stress, origin.state.stress);
        EXPECT_EQ(state.volume0, origin.state.volume0);
        for (int d = 0; d < Dim; ++d) {
          const double xi = world.lattice.scaled(d, state.x[d]), length = world.lattice.length(d);
          const bool inside = xi >= 0 && xi < world.lattice.cells()[d];
          EXPECT_TRUE(world.lattice.periodic(d) ? inside : piece.points.images()[p][d] == 0);
          EXPECT_NEAR(state.x[d] + piece.points.images()[p][d] * length, to.at(origin.id)[d], 1e-14 * (length + 3));
        }
      }
  MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  EXPECT_EQ(count, static_cast<std::int64_t>(points.size()));
}

template <int Dim>
void check_migration(const Lattice<Dim>& lattice) {
  const auto points = make_points(lattice, 200);
  const auto to = destinations(lattice, points);
  World<Dim> world(lattice, points, MPI_COMM_WORLD), alone(lattice, points, MPI_COMM_SELF);
  const auto order = expected_order(alone, to);
  for (World<Dim>* w : {&world, &alone}) {
    w->for_pieces([&](auto& piece) {
      for (int p = 0; p < piece.points.size(); ++p)
        for (int d = 0; d < Dim; ++d) piece.points.column(d)[p] = to.at(piece.points.ids()[p])[d];
    });
    w->migration->start(w->patches, lattice);
    w->migration->finish(w->patches);
    EXPECT_EQ(w->migration->failure(), "");
  }
  expect_arrived(world, points, to);
  expect_same_bits(world.patches, alone);
  for (const auto& patch : world.patches)
    for (const auto& piece : patch.pieces) {
      const auto at = order.find({patch.id, piece.body});
      EXPECT_EQ(piece.points.ids(), at == order.end() ? std::vector<std::int64_t>{} : at->second);
    }
}
TEST(Migration, PointsArriveInOrderWithTheirState2D) { for_lattices<2>(check_migration<2>); }
TEST(Migration, PointsArriveInOrderWithTheirState3D) { for_lattices<3>(check_migration<3>); }

/// Sends one point of patch 0 to x and tells what the ranks report together.
std::string failure_of(const Lattice<2>& lattice, const Vec<2>& x, std::int64_t* points_left) {
  Random random;
  std::vector<GlobalPoint<2>> points;
  Vec<2> start;
  for (int d = 0; d < 2; ++d) start[d] = lattice.lower()[d] + 2.5 * lattice.spacing()[d];
  points.push_back({77, 0, random_point<2>(random, start, 1)});
  World<2> world(lattice, points, MPI_COMM_WORLD);
  world.for_pieces([&](auto& piece) {
    for (int d = 0; d < 2; ++d) piece.points.column(d)[0] = x[d];
  });
  world.migration->start(world.patches, lattice);
  world.migration->finish(world.patches);
  *points_left = 0;
  for (const auto& patch : world.patches) *points_left += patch.point_count();
  MPI_Allreduce(MPI_IN_PLACE, points_left, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  char text[512] = {};
  world.migration->failure().copy(text, sizeof(text) - 1);
  MPI_Bcast(text, sizeof(text), MPI_CHAR, world.owner[0], MPI_COMM_WORLD);
  return text;
}

TEST(Migration, ReportsPointsThatAreLost) {
  const auto lattice = lattice_of<2>({20, 20}, {false, true}, 4);
  const auto place = [&](double x, double y) {
    return Vec<2>(lattice.lower()[0] + x * lattice.spacing()[0], lattice.lower()[1] + y * lattice.spacing()[1]);
  };
  std::int64_t left = 0;
  for (const Vec<2>& x : {place(-0.51, 2), place(20.6, 2), place(std::nan(""), 2), place(2, std::nan("")),
                          place(2, std::numeric_limits<double>::infinity()), place(-1e30, 2)}) {
    const std::string failure = failure_of(lattice, x, &left);
    EXPECT_NE(failure.find("point 77 of body 0 left the domain"), std::string::npos) << failure;
    EXPECT_EQ(left, 1);
  }
  EXPECT_NE(failure_of(lattice, place(9, 2), &left).find("crossed more than a patch"), std::string::npos);
  EXPECT_EQ(failure_of(lattice, place(-0.49, 2), &left), "");  // beyond a face by less than half a cell
  EXPECT_EQ(failure_of(lattice, place(7.9, -3), &left), "");
  EXPECT_EQ(left, 1);
}

TEST(Migration, RoundingErrorsAtAPeriodicBoundaryDoNoHarm) {
  const Lattice<2> lattice(Vec<2>(0, 0), Vec<2>(0.7, 0.7), {8, 8}, {true, true}, 4);
  for (double x : {-1e-300, -1e-20, -1e-17, 0.7, std::nextafter(0.7, 0), std::nextafter(0.7, 1)}) {
    Random random;
    const std::vector<GlobalPoint<2>> points = {{0, 0, random_point<2>(random, Vec<2>(x < 0.3 ? 0.1 : 0.6, 0.1), 1)}};
    World<2> world(lattice, points, MPI_COMM_WORLD);
    world.for_pieces([&](auto& piece) { piece.points.column(0)[0] = x; });
    world.migration->start(world.patches, lattice);
    world.migration->finish(world.patches);
    EXPECT_EQ(world.migration->failure(), "");
    world.for_pieces([&](auto& piece) {
      if (piece.points.size() == 0) return;
      const double xi = lattice.scaled(0, piece.points.column(0)[0]);
      EXPECT_TRUE(xi >= 0 && xi < 8) << x;
      EXPECT_NEAR(piece.points.column(0)[0] + 0.7 * piece.points.images()[0][0], x, 1e-15);
    });
  }
}

TEST(Migration, SortingByCellIsStable) {
  const auto lattice = lattice_of<3>({4, 4, 4}, {true, true, true}, 4);
  World<3> world(lattice, make_points(lattice, 400), MPI_COMM_SELF);
  for (auto& piece : world.patches[0].pieces) {
    const auto before = piece.points.ids();
    std::map<std::int64_t, PointState<3>> states;
    std::vector<std::pair<int, std::int64_t>> order;  // cell, then the order so far (ids ascend within a piece)
    for (int p = 0; p < piece.points.size(); ++p) {
      states.emplace(before[p], get_point(piece.points, p));
      const auto cell = cell_of(lattice, states.at(before[p]).x);
      order.emplace_back((cell[2] * 4 + cell[1]) * 4 + cell[0], before[p]);
    }
    ASSERT_TRUE(std::is_sorted(before.begin(), before.end()));
    std::sort(order.begin(), order.end());
    sort_by_cell(piece, lattice, world.patches[0].cells);
    for (int p = 0; p < piece.points.size(); ++p) {
      EXPECT_EQ(piece.points.ids()[p], order[p].second);
      const auto state = get_point(piece.points, p);
      EXPECT_EQ(state.x, states.at(order[p].second).x);
      EXPECT_EQ(state.stress, states.at(order[p].second).stress);
    }
  }
}

}  // namespace
}  // namespace cairn
