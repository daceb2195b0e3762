#include "body_parts.hpp"

#include <set>

namespace cairn {
namespace {

constexpr double point_reach = 1.5;  // cells from a point to the nodes that it may touch

/// The nodes that a point may touch, one within a rounding error of its reach among them.
template <int Dim>
Box<Dim> nodes_around(const Points<Dim>& points, int p, const Lattice<Dim>& lattice) {
  Box<Dim> around;
  for (int d = 0; d < Dim; ++d) {
    const double xi = lattice.scaled(d, points.column(d)[p]);
    around.lower[d] = static_cast<int>(std::ceil(xi - point_reach - 1e-9));
    around.upper[d] = static_cast<int>(std::floor(xi + point_reach + 1e-9)) + 1;
  }
  return around;
}

int find_root(std::vector<int>& up, int i) {
  while (up[i] != i) i = up[i] = up[up[i]];
  return i;
}

void unite(std::vector<int>& up, int a, int b) {
  a = find_root(up, a), b = find_root(up, b);
  up[std::max(a, b)] = std::min(a, b);
}

}  // namespace

template <int Dim>
std::int64_t name_of_node(const Lattice<Dim>& lattice, const Index<Dim>& place) {
  constexpr int bits = 63 / Dim;
  std::int64_t name = 0;
  for (int d = Dim - 1; d >= 0; --d) {
    const int n = lattice.cells()[d];
    const int i = lattice.periodic(d) ? ((place[d] % n) + n) % n : place[d] + 8;
    name = name << bits | i;
  }
  return name;
}

template <int Dim>
PieceParts<Dim>::PieceParts(const Piece<Dim>& piece, const Lattice<Dim>& lattice, const std::vector<SideSet>& sides)
    : body_(piece.body) {
  const Points<Dim>& points = piece.points;
  for (int p = 0; p < points.size(); ++p) {
    const Box<Dim> around = nodes_around(points, p, lattice);
    if (p == 0) box_ = around;
    for (int d = 0; d < Dim; ++d) {
      box_.lower[d] = std::min(box_.lower[d], around.lower[d]);
      box_.upper[d] = std::max(box_.upper[d], around.upper[d]);
    }
  }
  base_.assign(box_.size(), -1);
  const FurtherRows<Dim>& further = piece.nodes.further;
  std::vector<int> of_point;
  std::size_t block = 0;
  for (int p = 0; p < points.size(); ++p) {
    while (block < further.blocks.size() && further.blocks[block] + lane_count <= p) ++block;
    const bool cut = !sides.empty() && block < further.blocks.size() && further.blocks[block] <= p;
    int first = -1;
    for_each(nodes_around(points, p, lattice), [&](const Index<Dim>& place) {
      const int number = cut ? further.points[block * lane_count + p % lane_count].at(place) : -1;
      int& set = row(place, number < 0 ? SideSet() : sides[number]);
      if (set < 0) set = static_cast<int>(up_.size()), up_.push_back(set);
      first < 0 ? void(first = set) : unite(up_, first, set);
    });
    of_point.push_back(first);
  }
  for (int p = 0; p < points.size(); ++p) {
    const auto [at, is_new] = least_.try_emplace(root(of_point[p]), points.ids()[p]);
    if (!is_new) at->second = std::min(at->second, points.ids()[p]);
  }
  for (const int set : of_point) label_of_point_.push_back(least_.at(root(set)));
}

template <int Dim>
int& PieceParts<Dim>::row(const Index<Dim>& place, SideSet sides) {
  if (sides.empty()) return base_[box_.offset(place)];
  return further_.try_emplace({place, sides.key()}, -1).first->second;
}

template <int Dim>
void PieceParts<Dim>::tell_shared_rows(const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                       std::vector<std::int64_t>& rows) const {
  std::set<std::int64_t> told;
  for_rows([&](const Index<Dim>& place, SideSet sides, std::int64_t label) {
    const bool shared = std::ranges::any_of(patch.overlaps, [&](const auto& box) { return box.contains(place); });
    if (shared || told.insert(label).second)
      rows.insert(rows.end(), {body_, name_of_node<Dim>(lattice, place), sides.key(), label});
  });
}

JoinedParts join_parts(const std::vector<std::int64_t>& rows) {
  std::map<std::int64_t, int> number;
  for (std::size_t i = 0; i < rows.size(); i += 4) number[rows[i + 3]] = 0;
  std::vector<std::int64_t> labels;  // ascending, so that the smallest label names the set
  std::vector<int> up;
  for (auto& [label, n] : number) n = static_cast<int>(up.size()), up.push_back(n), labels.push_back(label);
  std::map<RowName, int> at_row;
  JoinedParts joined;
  for (std::size_t i = 0; i < rows.size(); i += 4) {
    const int n = number[rows[i + 3]];
    const auto [at, is_new] = at_row.try_emplace(RowName{rows[i], rows[i + 1], rows[i + 2]}, n);
    if (!is_new) unite(up, at->second, n);
    joined[rows[i + 3]].body = rows[i];
  }
  for (auto& [label, part] : joined) part.label = labels[find_root(up, number[label])];
  return joined;
}

template <int Dim>
std::map<std::int64_t, int> bodies_in_parts(const Simulation<Dim>& simulation) {
  std::vector<std::int64_t> rows;
  for (const auto& patch : simulation.patches())
    for (const auto& piece : patch.pieces) {
      const bool cut = std::ranges::any_of(simulation.cracks(), [&](const Crack& c) { return c.cuts(piece.body); });
      if (cut || simulation.is_rigid(piece) || piece.points.size() == 0) continue;
      PieceParts<Dim>(piece, simulation.lattice(), {}).tell_shared_rows(patch, simulation.lattice(), rows);
    }
  std::map<std::int64_t, int> parts;
  for (const auto& [label, part] : join_parts(gather_on_first(rows, simulation.communicator())))
    if (part.label == label) ++parts[part.body];
  std::erase_if(parts, [](const auto& body) { return body.second == 1; });
  return parts;
}

#define CAIRN_INSTANTIATE(Dim)                                                     \
  template std::int64_t name_of_node<Dim>(const Lattice<Dim>&, const Index<Dim>&); \
  template class PieceParts<Dim>;                                                  \
  template std::map<std::int64_t, int> bodies_in_parts<Dim>(const Simulation<Dim>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
