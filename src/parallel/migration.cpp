#include "cairn/parallel/migration.hpp"

#include <fmt/format.h>

#include <bit>
#include <numeric>

#include "cairn/core/error.hpp"

namespace cairn {
namespace {

/// The cell of a point (the nearest, for one within half a cell of the domain), its position wrapped at periodic
/// boundaries; says in `failure` where it lies further outside.
template <int Dim>
Index<Dim> locate(Points<Dim>& points, int p, int body, const Lattice<Dim>& lattice, std::string& failure) {
  Index<Dim> cell{};
  for (int d = 0; d < Dim; ++d) {
    double& x = points.column(d)[p];
    const double margin = lattice.periodic(d) ? 0.0 : 0.5;
    const auto outside = [&] {
      return !(lattice.scaled(d, x) >= -margin && lattice.scaled(d, x) < lattice.cells()[d] + margin);
    };
    if (lattice.periodic(d) && x - x == 0) {
      // Twice: a position a rounding error below the domain may wrap to just its upper end, which is its lower end
      // again.
      for (int turn = 0; turn < 2 && outside(); ++turn) {
        const int direction = lattice.scaled(d, x) < 0 ? 1 : -1;
        x += direction * lattice.length(d);
        points.images()[p][d] -= static_cast<std::int16_t>(direction);
      }
    }
    if (outside()) {
      failure = fmt::format("point {} of body {} left the domain: {} = {:.6g} m, velocity {:.6g} m/s there",
                            points.ids()[p], body, "xyz"[d], x, points.column(PointColumns<Dim>::velocity + d)[p]);
      return cell;
    }
    cell[d] = std::clamp(static_cast<int>(std::floor(lattice.scaled(d, x))), 0, lattice.cells()[d] - 1);
  }
  return cell;
}

}  // namespace

template <int Dim>
bool all_inside(const Piece<Dim>& piece, const Lattice<Dim>& lattice, int patch) {
  for (int d = 0; d < Dim; ++d) {
    const double* x = piece.points.column(d);
    const auto [lower, upper] = lattice.patch_reach(patch, d);
    bool inside = true;
    for (int p = 0; p < piece.points.size(); ++p) {
      const double xi = lattice.scaled(d, x[p]);
      inside &= xi >= lower && xi < upper;  // false for a position that is no number
    }
    if (!inside) return false;
  }
  return true;
}

template <int Dim>
void Migration<Dim>::collect(Patch<Dim>& patch, Piece<Dim>& piece, const Lattice<Dim>& lattice) {
  Points<Dim>& points = piece.points;
  std::vector<int> staying;
  std::vector<std::pair<int, int>> leaving;  // patch, point
  for (int p = 0; p < points.size(); ++p) {
    std::string failure;
    const int to = lattice.patch_of_cell(locate(points, p, piece.body, lattice, failure));
    const bool near =
        std::any_of(patch.links.begin(), patch.links.end(), [&](const auto& link) { return link.patch == to; });
    if (failure.empty() && to != patch.id && !near)
      failure = fmt::format("point {} of body {} crossed more than a patch in one step", points.ids()[p], piece.body);
    if (failure_.empty()) failure_ = failure;
    if (to == patch.id || !failure.empty())
      staying.push_back(p);
    else
      leaving.emplace_back(to, p);
  }
  std::stable_sort(leaving.begin(), leaving.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < leaving.size();) {
    std::size_t end = i;
    while (end < leaving.size() && leaving[end].first == leaving[i].first) ++end;
    Message& message = messages_.outgoing(owner_[leaving[i].first]);
    for (std::int64_t value : {std::int64_t{leaving[i].first}, std::int64_t{patch.id}, std::int64_t{piece.body},
                               static_cast<std::int64_t>(end - i), std::int64_t{points.columns()}})
      message.put(value);
    for (; i < end; ++i) {
      const int p = leaving[i].second;
      message.put(points.ids()[p]);
      message.put(std::bit_cast<std::int64_t>(points.images()[p]));
      for (int c = 0; c < points.columns(); ++c) message.put(points.column(c)[p]);
    }
  }
  points.select(staying);
}

template <int Dim>
void Migration<Dim>::begin() {
  messages_.begin();
  failure_.clear();
}

template <int Dim>
void Migration<Dim>::finish(std::vector<Patch<Dim>>& patches) {
  messages_.receive();
  struct Arrival {
    int to, from, body, count, columns, rank;
    std::size_t at;
  };
  std::vector<Arrival> arrivals;
  const auto read = [&](int rank) {
    const Message& message = messages_.incoming(rank);
    for (std::size_t at = 0; at < message.size();) {
      Arrival a;
      a.to = static_cast<int>(message.integer(at++)), a.from = static_cast<int>(message.integer(at++));
      a.body = static_cast<int>(message.integer(at++)), a.count = static_cast<int>(message.integer(at++));
      a.columns = static_cast<int>(message.integer(at++)), a.rank = rank, a.at = at;
      at += static_cast<std::size_t>(a.count) * (2 + a.columns);
      arrivals.push_back(a);
    }
  };
  read(messages_.rank());
  for (int rank : messages_.neighbours()) read(rank);
  std::stable_sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) {
    return std::pair(a.to, a.from) < std::pair(b.to, b.from);
  });
  for (const Arrival& a : arrivals) {
    auto patch =
        std::lower_bound(patches.begin(), patches.end(), a.to, [](const auto& p, int id) { return p.id < id; });
    Piece<Dim>& piece = patch->piece_of(a.body, 0);
    piece.projected = false;
    Points<Dim>& points = piece.points;
    if (points.size() == 0) points = Points<Dim>(a.columns - PointColumns<Dim>::state);
    const Message& message = messages_.incoming(a.rank);
    int p = points.size();
    points.resize(p + a.count);
    std::size_t at = a.at;
    for (int i = 0; i < a.count; ++i, ++p) {
      points.ids()[p] = message.integer(at++);
      points.images()[p] = std::bit_cast<Image>(message.integer(at++));
      for (int c = 0; c < a.columns; ++c) points.column(c)[p] = *message.data(at++);
    }
  }
}

template <int Dim>
void sort_by_cell(Piece<Dim>& piece, const Lattice<Dim>& lattice, const Box<Dim>& cells) {
  Points<Dim>& points = piece.points;
  std::vector<int> key(points.size()), order(points.size());
  for (int p = 0; p < points.size(); ++p) {
    Index<Dim> cell;
    for (int d = 0; d < Dim; ++d)
      cell[d] = std::clamp(static_cast<int>(std::floor(lattice.scaled(d, points.column(d)[p]))), cells.lower[d],
                           cells.upper[d] - 1);
    key[p] = cells.offset(cell);
  }
  std::iota(order.begin(), order.end(), 0);
  if (std::is_sorted(key.begin(), key.end())) return;
  piece.projected = false;
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return key[a] < key[b]; });
  points.select(order);
}

template class Migration<2>;
template class Migration<3>;
template bool all_inside(const Piece<2>&, const Lattice<2>&, int);
template bool all_inside(const Piece<3>&, const Lattice<3>&, int);
template void sort_by_cell(Piece<2>&, const Lattice<2>&, const Box<2>&);
template void sort_by_cell(Piece<3>&, const Lattice<3>&, const Box<3>&);

}  // namespace cairn
