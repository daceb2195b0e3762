#include "cairn/parallel/crack_exchange.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace cairn {
namespace {

constexpr double longest_segment = 1.0;  // cells

constexpr double farthest = 1e9;  // cells, so that they can be counted

/// The cell of a crack point in its patch's frame; the nearest, where there is a face of the domain.
template <int Dim>
Index<Dim> cell_of(const Lattice<Dim>& lattice, const Vec<Dim>& x) {
  Index<Dim> cell;
  for (int d = 0; d < Dim; ++d) {
    cell[d] = static_cast<int>(std::floor(std::clamp(lattice.scaled(d, x[d]), -farthest, farthest)));
    if (!lattice.periodic(d)) cell[d] = std::clamp(cell[d], 0, lattice.cells()[d] - 1);
  }
  return cell;
}

/// Whether x lies within reach of a patch's cells.
template <int Dim>
bool is_near(const Lattice<Dim>& lattice, const Vec<Dim>& x, const Box<Dim>& cells) {
  for (int d = 0; d < Dim; ++d) {
    const double xi = lattice.scaled(d, x[d]);
    if (!(xi >= cells.lower[d] - crack_reach && xi <= cells.upper[d] + crack_reach)) return false;
  }
  return true;
}

/// A copy for the patch at the other end of a link: in its frame, its own where its cells hold the point.
template <int Dim>
CrackPoint<Dim> seen_across(const CrackPoint<Dim>& point, const Link<Dim>& link, const Lattice<Dim>& lattice) {
  CrackPoint<Dim> seen = point;
  Vec<Dim> by;
  Index<Dim> cell = cell_of(lattice, point.plane);
  for (int d = 0; d < Dim; ++d) {
    by[d] = -link.shift[d] * lattice.spacing()[d];
    cell[d] -= link.shift[d];
    seen.image[d] = point.image[d] + link.shift[d] / lattice.cells()[d];
  }
  seen.shift(by);
  seen.own = lattice.patch_cells(link.patch).contains(cell);
  return seen;
}

/// Puts points in the middle of segments that the material stretched to more than a cell. Every patch that knows both
/// of a segment's points finds the same. The new ones stand for no length of a law: their neighbours keep theirs.
template <int Dim>
void divide_long_segments(Patch<Dim>& patch, const Lattice<Dim>& lattice) {
  std::vector<CrackPoint<Dim>> divided;
  for (std::size_t k = 0; k < patch.cracks.size(); ++k) {
    divided.push_back(patch.cracks[k]);
    if (k + 1 == patch.cracks.size()) break;
    CrackPoint<Dim>& a = divided.back();
    const CrackPoint<Dim>& b = patch.cracks[k + 1];
    const double cells = (b.plane - a.plane).cwiseProduct(lattice.inverse_spacing()).norm();
    if (!a.precedes(b) || !(cells > longest_segment) || b.index - a.index < 2) continue;
    CrackPoint<Dim> middle = a;
    middle.index = a.index + (b.index - a.index) / 2, middle.next = b.index;
    a.next = middle.index;
    for (auto vector : {&CrackPoint<Dim>::plane, &CrackPoint<Dim>::lower, &CrackPoint<Dim>::upper,
                        &CrackPoint<Dim>::lower_velocity, &CrackPoint<Dim>::upper_velocity})
      middle.*vector = 0.5 * (a.*vector + b.*vector);
    middle.filled = a.filled && b.filled, middle.faces_filled = a.faces_filled & b.faces_filled;
    middle.bond = {}, middle.traction.setZero();
    middle.own = holds(patch, lattice, middle);
    divided.push_back(middle);
  }
  if (divided.size() > patch.cracks.size()) patch.cracks = std::move(divided);
}

void put_triangles(const CrackHeld<3>& point, Message& message) {
  message.put(std::int64_t{point.tip}), message.put(std::int64_t{point.held});
  for (std::int32_t t = 0; t < point.held; ++t)
    for (const std::int64_t value : {point.triangles[t].second, point.triangles[t].third, point.triangles[t].edges})
      message.put(value);
}

void take_triangles(CrackHeld<3>& point, const Message& message, std::size_t& at) {
  point.tip = message.integer(at++) != 0, point.held = static_cast<std::int32_t>(message.integer(at++));
  for (std::int32_t t = 0; t < point.held; ++t)
    for (auto* value : {&point.triangles[t].second, &point.triangles[t].third, &point.triangles[t].edges})
      *value = static_cast<std::int32_t>(message.integer(at++));
}

}  // namespace

template <int Dim>
bool holds(const Patch<Dim>& patch, const Lattice<Dim>& lattice, const CrackPoint<Dim>& point) {
  return patch.cells.contains(cell_of(lattice, point.plane));
}

template <int Dim>
void put_crack_point(const CrackPoint<Dim>& point, Message& message) {
  for (std::int64_t value : {point.crack, point.index, point.next, std::int32_t{point.own}, std::int32_t{point.filled},
                             std::int32_t{point.faces_filled}, std::int32_t{point.bond.state}})
    message.put(value);
  for (const double value : {point.bond.length, point.bond.peak[0], point.bond.peak[1], point.bond.dissipated})
    message.put(value);
  for (const std::int64_t word : std::bit_cast<ImageWords>(point.image)) message.put(word);
  for (const Vec<Dim>& v :
       {point.plane, point.lower, point.upper, point.lower_velocity, point.upper_velocity, point.traction})
    for (int d = 0; d < Dim; ++d) message.put(v[d]);
  if constexpr (Dim == 3) put_triangles(point, message);
}

template <int Dim>
CrackPoint<Dim> take_crack_point(const Message& message, std::size_t& at) {
  CrackPoint<Dim> point;
  point.crack = static_cast<std::int32_t>(message.integer(at++));
  point.index = static_cast<std::int32_t>(message.integer(at++));
  point.next = static_cast<std::int32_t>(message.integer(at++));
  point.own = message.integer(at++) != 0, point.filled = message.integer(at++) != 0;
  point.faces_filled = static_cast<int>(message.integer(at++));
  point.bond.state = static_cast<Bond::State>(message.integer(at++));
  for (double* value : {&point.bond.length, &point.bond.peak[0], &point.bond.peak[1], &point.bond.dissipated})
    *value = *message.data(at++);
  point.image = std::bit_cast<Image>(ImageWords{message.integer(at), message.integer(at + 1)}), at += 2;
  for (Vec<Dim>* v :
       {&point.plane, &point.lower, &point.upper, &point.lower_velocity, &point.upper_velocity, &point.traction})
    for (int d = 0; d < Dim; ++d) (*v)[d] = *message.data(at++);
  if constexpr (Dim == 3) take_triangles(point, message, at);
  return point;
}

template <int Dim>
std::string exchange_cracks(NeighbourExchange& messages, const PatchTable<Dim>& table, std::vector<Patch<Dim>>& patches,
                            const Lattice<Dim>& lattice) {
  messages.begin();
  std::string failure;
  for (auto& patch : patches) {
    std::vector<CrackPoint<Dim>> kept;
    for (const auto& point : patch.cracks) {
      if (!point.own) continue;
      CrackPoint<Dim> mine = point;
      mine.own = holds(patch, lattice, point);
      bool held = mine.own;
      if (mine.own || is_near(lattice, mine.plane, patch.cells)) kept.push_back(mine);
      for (const auto& link : patch.links) {
        if (table.find(link.patch) < 0) continue;  // there is nothing to cut
        const CrackPoint<Dim> theirs = seen_across(point, link, lattice);
        held = held || theirs.own;
        if (!theirs.own && !is_near(lattice, theirs.plane, lattice.patch_cells(link.patch))) continue;
        Message& message = messages.outgoing(table.owner(link.patch));
        message.put(link.patch);
        put_crack_point(theirs, message);
      }
      if (!held && failure.empty())
        failure = fmt::format("point {} of crack {} moved more than a patch in one step, to {:.6g}, {:.6g} m",
                              point.index, point.crack, point.plane[0], point.plane[1]);
    }
    patch.cracks = std::move(kept);
  }
  messages.start();
  messages.receive();
  const auto read = [&](int rank) {
    const Message& message = messages.incoming(rank);
    for (std::size_t at = 0; at < message.size();) {
      const PatchId id = message.integer(at++);
      auto patch = std::ranges::lower_bound(patches, id, {}, &Patch<Dim>::id);
      patch->cracks.push_back(take_crack_point<Dim>(message, at));
    }
  };
  read(messages.rank());
  for (int rank : messages.neighbours()) read(rank);
  for (auto& patch : patches) {
    auto& points = patch.cracks;
    // Of one point that came twice, across several links, the own one stays.
    std::sort(points.begin(), points.end(),
              [](const auto& a, const auto& b) { return a < b || (!(b < a) && a.own > b.own); });
    points.erase(
        std::unique(points.begin(), points.end(), [](const auto& a, const auto& b) { return !(a < b) && !(b < a); }),
        points.end());
    divide_long_segments(patch, lattice);
  }
  return failure;
}

template <int Dim>
void exchange_face_velocities(NeighbourExchange& messages, const PatchTable<Dim>& table,
                              std::vector<Patch<Dim>>& patches, const Lattice<Dim>& lattice,
                              const std::vector<std::vector<FaceMotion<Dim>>>& told) {
  messages.begin();
  for (std::size_t p = 0; p < patches.size(); ++p)
    for (const auto& motion : told[p])
      for (const auto& link : patches[p].links) {
        if (table.find(link.patch) < 0) continue;
        const CrackPoint<Dim> theirs = seen_across(patches[p].cracks[motion.point], link, lattice);
        if (!theirs.own) continue;
        Message& message = messages.outgoing(table.owner(link.patch));
        message.put(link.patch), message.put(patches[p].id);
        message.put(std::int64_t{motion.side});
        put_crack_point(theirs, message);
        for (int d = 0; d < Dim; ++d) message.put(motion.velocity[d]);
        break;
      }
  messages.start();
  messages.receive();
  struct Told {
    PatchId to, from;
    int side;
    CrackPoint<Dim> point;
    Vec<Dim> velocity;
  };
  std::vector<Told> all;
  const auto read = [&](int rank) {
    const Message& message = messages.incoming(rank);
    for (std::size_t at = 0; at < message.size();) {
      Told t;
      t.to = message.integer(at++), t.from = message.integer(at++);
      t.side = static_cast<int>(message.integer(at++));
      t.point = take_crack_point<Dim>(message, at);
      for (int d = 0; d < Dim; ++d) t.velocity[d] = *message.data(at++);
      all.push_back(t);
    }
  };
  read(messages.rank());
  for (int rank : messages.neighbours()) read(rank);
  // The last to be taken counts.
  std::stable_sort(all.begin(), all.end(), [](const Told& a, const Told& b) { return a.from > b.from; });
  for (const Told& t : all) {
    auto patch = std::ranges::lower_bound(patches, t.to, {}, &Patch<Dim>::id);
    const auto point = std::lower_bound(patch->cracks.begin(), patch->cracks.end(), t.point);
    if (point == patch->cracks.end() || t.point < *point || !point->own) continue;
    point->velocity(t.side) = t.velocity;
    point->faces_filled |= CrackPoint<Dim>::filled_bit(t.side);
  }
}

template <int Dim>
void exchange_row_forces(NeighbourExchange& messages, const PatchTable<Dim>& table,
                         const std::vector<Patch<Dim>>& patches, const Lattice<Dim>& lattice,
                         std::vector<std::vector<RowForce<Dim>>>& forces) {
  messages.begin();
  for (std::size_t p = 0; p < patches.size(); ++p)
    for (const auto& link : patches[p].links) {
      if (forces[p].empty() || table.find(link.patch) < 0) continue;
      const Box<Dim> theirs = lattice.patch_nodes(link.patch).shifted(link.shift);
      for (const RowForce<Dim>& f : forces[p]) {
        if (!theirs.contains(f.place)) continue;
        Message& message = messages.outgoing(table.owner(link.patch));
        for (const std::int64_t value : {std::int64_t{link.patch}, std::int64_t{f.from}, std::int64_t{f.crack},
                                         std::int64_t{f.index}, std::int64_t{f.side}, f.sides.key()})
          message.put(value);
        for (int d = 0; d < Dim; ++d) message.put(std::int64_t{f.place[d] - link.shift[d]});
        for (int d = 0; d < Dim; ++d) message.put(f.force[d]);
      }
    }
  messages.start();
  messages.receive();
  const auto read = [&](int rank) {
    const Message& message = messages.incoming(rank);
    for (std::size_t at = 0; at < message.size();) {
      const PatchId to = message.integer(at++);
      RowForce<Dim> f;
      f.from = message.integer(at++);
      f.crack = static_cast<std::int32_t>(message.integer(at++));
      f.index = static_cast<std::int32_t>(message.integer(at++));
      f.side = static_cast<int>(message.integer(at++)), f.sides = SideSet(message.integer(at++));
      for (int d = 0; d < Dim; ++d) f.place[d] = static_cast<int>(message.integer(at++));
      for (int d = 0; d < Dim; ++d) f.force[d] = *message.data(at++);
      forces[std::ranges::lower_bound(patches, to, {}, &Patch<Dim>::id) - patches.begin()].push_back(f);
    }
  };
  read(messages.rank());
  for (int rank : messages.neighbours()) read(rank);
  for (auto& list : forces) sort_row_forces(list);
}

template void exchange_row_forces(NeighbourExchange&, const PatchTable<2>&, const std::vector<Patch<2>>&,
                                  const Lattice<2>&, std::vector<std::vector<RowForce<2>>>&);
template void exchange_row_forces(NeighbourExchange&, const PatchTable<3>&, const std::vector<Patch<3>>&,
                                  const Lattice<3>&, std::vector<std::vector<RowForce<3>>>&);
template void exchange_face_velocities(NeighbourExchange&, const PatchTable<2>&, std::vector<Patch<2>>&,
                                       const Lattice<2>&, const std::vector<std::vector<FaceMotion<2>>>&);
template void exchange_face_velocities(NeighbourExchange&, const PatchTable<3>&, std::vector<Patch<3>>&,
                                       const Lattice<3>&, const std::vector<std::vector<FaceMotion<3>>>&);
template std::string exchange_cracks(NeighbourExchange&, const PatchTable<2>&, std::vector<Patch<2>>&,
                                     const Lattice<2>&);
template std::string exchange_cracks(NeighbourExchange&, const PatchTable<3>&, std::vector<Patch<3>>&,
                                     const Lattice<3>&);

template bool holds(const Patch<2>&, const Lattice<2>&, const CrackPoint<2>&);
template bool holds(const Patch<3>&, const Lattice<3>&, const CrackPoint<3>&);
template void put_crack_point(const CrackPoint<2>&, Message&);
template void put_crack_point(const CrackPoint<3>&, Message&);
template CrackPoint<2> take_crack_point(const Message&, std::size_t&);
template CrackPoint<3> take_crack_point(const Message&, std::size_t&);

}  // namespace cairn
