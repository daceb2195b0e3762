#pragma once
/// Points of several bodies dealt out over patches and ranks, for tests of exchanges.

#include <gtest/gtest.h>
#include <mpi.h>

#include <algorithm>
#include <map>
#include <memory>
#include <numeric>
#include <set>

#include "cairn/parallel/distribution.hpp"
#include "cairn/parallel/migration.hpp"
#include "cairn/parallel/node_exchange.hpp"
#include "lattices.hpp"
#include "pieces.hpp"

namespace cairn::test {

inline constexpr double density = 1300;
inline constexpr int body_count = 4;

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
  PatchTable<Dim> table;
  std::vector<Patch<Dim>> patches;
  std::unique_ptr<NeighbourExchange> messages;
  std::unique_ptr<NodeExchange<Dim>> exchange;
  std::unique_ptr<Migration<Dim>> migration;
  TransferSettings<Dim> settings;

  World(const Lattice<Dim>& lattice_, const std::vector<GlobalPoint<Dim>>& points, MPI_Comm comm) : lattice(lattice_) {
    int rank = 0, ranks = 1;
    MPI_Comm_rank(comm, &rank), MPI_Comm_size(comm, &ranks);
    const std::vector<PatchId> all = all_patches(lattice);
    table = PatchTable<Dim>(lattice, all);
    table.assign(
        distribute_patches(lattice, all, std::vector<std::int64_t>(all.size(), 1), ranks, Partition::round_robin));
    std::set<int> neighbours;
    for (const PatchId id : all) {
      if (table.owner(id) != rank) continue;
      patches.emplace_back(id, lattice);
      for (const auto& link : patches.back().links) neighbours.insert(table.owner(link.patch));
    }
    neighbours.erase(rank);
    for (const auto& point : points) add(point);
    messages = std::make_unique<NeighbourExchange>(comm, std::vector<int>(neighbours.begin(), neighbours.end()));
    exchange = std::make_unique<NodeExchange<Dim>>(*messages, table, patches);
    migration = std::make_unique<Migration<Dim>>(*messages, table);
    ContactOptions contact;
    contact.release = Release::traction;
    settings = TransferSettings<Dim>::make(SolverOptions{}, contact, Vec<Dim>::Constant(-3));
    if constexpr (Dim == 3) settings.half_size.fill(0.25);
  }
  Patch<Dim>* patch(PatchId id) {
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
  /// Points that left their patch go to the others.
  void migrate() {
    migration->begin();
    for (auto& patch : patches)
      for (auto& piece : patch.pieces) migration->collect(patch, piece, lattice);
    migration->start();
    migration->finish(patches);
  }
  template <class F>
  void for_pieces(F&& f) {
    for (auto& patch : patches)
      for (auto& piece : patch.pieces) f(piece);
  }
  void sum_points() {
    for_pieces([&](auto& piece) { lay_out_nodes(piece, lattice, settings); });
    for_pieces([&](auto& piece) { project(piece, lattice, settings, density); });
    exchange->begin_sums(true);
    sum();
  }
  /// Momentum once more, by the exchange of one array.
  void sum_momentum() {
    for_pieces([&](auto& piece) { project_momentum(piece, lattice, settings, density); });
    exchange->begin(&NodeBox<Dim>::velocity);
    sum();
  }
  void sum() {
    for (std::size_t p = 0; p < patches.size(); ++p) exchange->put(patches[p], p);
    exchange->start();
    for (bool beside_others : {false, true}) {
      if (beside_others) exchange->receive();
      for (std::size_t p = 0; p < patches.size(); ++p)
        if (exchange->beside_others(p) == beside_others) exchange->add(patches[p], p);
    }
  }
};

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

}  // namespace cairn::test
