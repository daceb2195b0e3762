#include "cairn/parallel/migration.hpp"

#include <fmt/format.h>

#include <bit>
#include <numeric>

#include "cairn/core/error.hpp"

namespace cairn {
namespace {

/// Where a point is.
template <int Dim>
struct Place {
  Index<Dim> cell{};  // the nearest, for a point within half a cell of the domain
  bool left = false;  // through an open face
  std::string lost;   // why it is in no cell
};

/// The place of a point, its position wrapped at periodic boundaries.
template <int Dim>
Place<Dim> locate(Points<Dim>& points, int p, int body, const Lattice<Dim>& lattice, const Exits<Dim>& exits) {
  Place<Dim> place;
  for (int d = 0; d < Dim; ++d) {
    double& x = points.column(d)[p];
    std::int32_t& image = points.images()[p][d];
    if (lattice.periodic(d) && __builtin_add_overflow(image, lattice.wrap(d, x), &image))
      place.lost = fmt::format("point {} of body {} crossed a periodic boundary more often than can be counted",
                               points.ids()[p], body);
    const double xi = lattice.scaled(d, x), margin = lattice.periodic(d) ? 0.0 : 0.5;
    if (xi >= -margin && xi < lattice.cells()[d] + margin) {
      place.cell[d] = std::clamp(static_cast<int>(std::floor(xi)), 0, lattice.cells()[d] - 1);
    } else if (std::isfinite(xi) && !lattice.periodic(d) && exits.open[2 * d + (xi > 0)]) {
      place.left = true;
    } else {
      place.lost = fmt::format("point {} of body {} left the domain: {} = {:.6g} m, velocity {:.6g} m/s there",
                               points.ids()[p], body, "xyz"[d], x, points.column(PointColumns<Dim>::velocity + d)[p]);
    }
  }
  return place;
}

}  // namespace

template <int Dim>
bool all_inside(const Piece<Dim>& piece, const Lattice<Dim>& lattice, PatchId patch) {
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
  std::vector<std::pair<PatchId, int>> leaving;  // patch, point
  std::vector<Departure> departing;
  for (int p = 0; p < points.size(); ++p) {
    if (is_lost(points.ids()[p])) {
      departing.push_back({p, "marked"});
      continue;
    }
    Place<Dim> place = locate(points, p, piece.body, lattice, exits_);
    const PatchId to = place.left ? patch.id : lattice.patch_of_cell(place.cell);
    const bool near =
        std::any_of(patch.links.begin(), patch.links.end(), [&](const auto& link) { return link.patch == to; });
    if (place.lost.empty() && to != patch.id && !near)
      place.lost =
          fmt::format("point {} of body {} crossed more than a patch in one step", points.ids()[p], piece.body);
    const bool lost = !place.lost.empty();
    if (lost && !exits_.drop_lost) {
      if (failure_.empty()) failure_ = place.lost;
      staying.push_back(p);
    } else if (lost || place.left) {
      departing.push_back({p, place.lost});
    } else if (to == patch.id) {
      staying.push_back(p);
    } else {
      leaving.emplace_back(to, p);
    }
  }
  if (!departing.empty()) exits_.book(patch, piece, departing);
  send(patch, piece, leaving);
  points.select(staying);
}

/// Puts points into the messages: for each pair (patch they go to, point), in that order.
template <int Dim>
void Migration<Dim>::send(const Patch<Dim>& patch, const Piece<Dim>& piece,
                          std::vector<std::pair<PatchId, int>>& leaving) {
  const Points<Dim>& points = piece.points;
  std::stable_sort(leaving.begin(), leaving.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < leaving.size();) {
    std::size_t end = i;
    while (end < leaving.size() && leaving[end].first == leaving[i].first) ++end;
    const PatchId to = leaving[i].first;
    if (!table_.is_filled(to)) entered_.push_back(to);
    Message& message = messages_.outgoing(table_.owner(to));
    for (std::int64_t value :
         {to, patch.id, std::int64_t{piece.body}, static_cast<std::int64_t>(end - i), std::int64_t{points.columns()}})
      message.put(value);
    for (; i < end; ++i) {
      const int p = leaving[i].second;
      message.put(points.ids()[p]);
      for (const std::int64_t word : std::bit_cast<ImageWords>(points.images()[p])) message.put(word);
      for (int c = 0; c < points.columns(); ++c) message.put(points.column(c)[p]);
    }
  }
}

template <int Dim>
void Migration<Dim>::begin() {
  messages_.begin();
  failure_.clear();
  entered_.clear();
}

template <int Dim>
void Migration<Dim>::finish(std::vector<Patch<Dim>>& patches) {
  messages_.receive();
  struct Arrival {
    PatchId to, from;
    int body, count, columns, rank;
    std::size_t at;
  };
  std::vector<Arrival> arrivals;
  const auto read = [&](int rank) {
    const Message& message = messages_.incoming(rank);
    for (std::size_t at = 0; at < message.size();) {
      Arrival a;
      a.to = message.integer(at++), a.from = message.integer(at++);
      a.body = static_cast<int>(message.integer(at++)), a.count = static_cast<int>(message.integer(at++));
      a.columns = static_cast<int>(message.integer(at++)), a.rank = rank, a.at = at;
      at += static_cast<std::size_t>(a.count) * (3 + a.columns);
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
        std::lower_bound(patches.begin(), patches.end(), a.to, [](const auto& p, PatchId id) { return p.id < id; });
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
      points.images()[p] = std::bit_cast<Image>(ImageWords{message.integer(at), message.integer(at + 1)});
      at += 2;
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
template bool all_inside(const Piece<2>&, const Lattice<2>&, PatchId);
template bool all_inside(const Piece<3>&, const Lattice<3>&, PatchId);
template void sort_by_cell(Piece<2>&, const Lattice<2>&, const Box<2>&);
template void sort_by_cell(Piece<3>&, const Lattice<3>&, const Box<3>&);

}  // namespace cairn
