// Migration of points between patches, on any number of ranks: bit for bit as on one rank, and none is lost.

#include "../support/world.hpp"

namespace cairn {
namespace {

using namespace test;

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
std::map<std::pair<PatchId, int>, std::vector<std::int64_t>> expected_order(
    const World<Dim>& before, const std::map<std::int64_t, Vec<Dim>>& to) {
  std::map<std::pair<PatchId, int>, std::vector<std::int64_t>> order;
  for (bool staying : {true, false})
    for (const auto& patch : before.patches)  // ascending
      for (const auto& piece : patch.pieces)
        for (std::int64_t id : piece.points.ids()) {
          const PatchId home =
              before.lattice.patch_of_cell(cell_of(before.lattice, wrapped(before.lattice, to.at(id))));
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
    w->migrate();
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
  world.migrate();
  *points_left = 0;
  for (const auto& patch : world.patches) *points_left += patch.point_count();
  MPI_Allreduce(MPI_IN_PLACE, points_left, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  char text[512] = {};
  world.migration->failure().copy(text, sizeof(text) - 1);
  MPI_Bcast(text, sizeof(text), MPI_CHAR, world.table.owner(0), MPI_COMM_WORLD);
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
    world.migrate();
    EXPECT_EQ(world.migration->failure(), "");
    world.for_pieces([&](auto& piece) {
      if (piece.points.size() == 0) return;
      const double xi = lattice.scaled(0, piece.points.column(0)[0]);
      EXPECT_TRUE(xi >= 0 && xi < 8) << x;
      EXPECT_NEAR(piece.points.column(0)[0] + 0.7 * piece.points.images()[0][0], x, 1e-15);
    });
  }
}

TEST(Migration, CrossingsAreCountedBeyond16Bits) {
  const Lattice<2> lattice(Vec<2>(-0.06, 0), Vec<2>(1.14, 1), {8, 8}, {true, true}, 4);
  for (const std::int32_t before : {32767, -32768, 2'000'000'000}) {
    Random random;
    World<2> world(lattice, {{0, 0, random_point<2>(random, Vec<2>(before > 0 ? 1.1 : 0, 0.1), 1)}}, MPI_COMM_WORLD);
    world.for_pieces([&](auto& piece) {
      piece.points.images()[0][0] = before, piece.points.column(0)[0] += before > 0 ? 0.1 : -0.1;
    });
    world.migrate();
    EXPECT_EQ(world.migration->failure(), "");
    world.for_pieces([&](auto& piece) {
      if (piece.points.size() == 0) return;
      EXPECT_EQ(piece.points.images()[0][0], before + (before > 0 ? 1 : -1));
    });
  }
  Random random;
  World<2> world(lattice, {{0, 0, random_point<2>(random, Vec<2>(1.1, 0.1), 1)}}, MPI_COMM_WORLD);
  bool here = false;
  world.for_pieces([&](auto& piece) {
    piece.points.images()[0][0] = std::numeric_limits<std::int32_t>::max(), piece.points.column(0)[0] += 0.1;
    here = true;
  });
  world.migrate();
  EXPECT_EQ(world.migration->failure().empty(), !here);
}

/// A point beyond a face of a world whose right face is open leaves by it, is lost by another, and by both is lost.
TEST(Migration, PointsLeaveThroughOpenFacesAlone) {
  const auto lattice = lattice_of<2>({8, 8}, {false, false}, 4);
  struct Trial {
    double x, y;
    bool leaves, lost;
  };
  for (const bool drop : {false, true})
    for (const auto& [x, y, leaves, lost] : {Trial{8.51, 2, true, false},
                                             {8.49, 2, false, false},
                                             {9e9, 6, true, false},
                                             {-0.51, 2, false, true},
                                             {8.6, 8.6, false, true},
                                             {2, 9, false, true},
                                             {std::nan(""), 2, false, true}}) {
      Random random;
      const Vec<2> start = lattice.lower() + 2.5 * lattice.spacing();
      World<2> world(lattice, {{5, 3, random_point<2>(random, start, 1)}, {6, 3, random_point<2>(random, start, 1)}},
                     MPI_COMM_WORLD);
      Exits<2> exits;
      exits.open[1] = true, exits.drop_lost = drop;
      int booked = 0;
      exits.book = [&](Patch<2>&, const Piece<2>& piece, std::span<const Departure> departing) {
        ASSERT_EQ(departing.size(), 1U);
        EXPECT_EQ(piece.points.ids()[departing[0].point], 5);  // still there
        EXPECT_EQ(departing[0].lost.empty(), leaves);
        ++booked;
      };
      world.migration = std::make_unique<Migration<2>>(*world.messages, world.table, exits);
      bool here = false;
      world.for_pieces([&](auto& piece) {
        piece.points.column(0)[0] = lattice.lower()[0] + x * lattice.spacing()[0];
        piece.points.column(1)[0] = lattice.lower()[1] + y * lattice.spacing()[1];
        here = true;
      });
      world.migrate();
      const bool taken = leaves || (lost && drop);
      EXPECT_EQ(booked, here && taken);
      EXPECT_EQ(world.migration->failure().empty(), !here || !lost || drop);
      std::int64_t points = 0;
      world.for_pieces([&](auto& piece) { points += piece.points.size(); });
      MPI_Allreduce(MPI_IN_PLACE, &points, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
      EXPECT_EQ(points, taken ? 1 : 2);
    }
}

TEST(Migration, MarkedPointsAreTakenOut) {
  const auto lattice = lattice_of<2>({8, 8}, {false, false}, 4);
  Random random;
  const Vec<2> start = lattice.lower() + 2.5 * lattice.spacing();
  World<2> world(lattice, {{5, 3, random_point<2>(random, start, 1)}, {0, 3, random_point<2>(random, start, 1)}},
                 MPI_COMM_WORLD);
  world.for_pieces([&](auto& piece) { mark_lost(piece.points.ids()[1]); });
  world.migrate();
  world.for_pieces([&](auto& piece) { EXPECT_EQ(piece.points.ids(), std::vector<std::int64_t>{5}); });
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
