#include "cairn/crack/faces.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <optional>
#include <tuple>

#include "segments_seen.hpp"

namespace cairn {
namespace {

constexpr double light = 0.1;   // nodes filled by less than this share count the less
constexpr double aside = 1e-3;  // cells from the plane at which a face begins
constexpr double stiff = 1e-3;  // of the linear part of the weights' matrix, where rows lie on a line

double spline(double u) {
  u = std::abs(u);
  if (u < 0.5) return 0.75 - u * u;
  return u < 1.5 ? 0.5 * (1.5 - u) * (1.5 - u) : 0.0;
}

bool carries(const Bond& bond) { return bond.state == Bond::holds && bond.length > 0; }

/// Mass, momentum and share of a full node of all cut bodies in one row.
template <int Dim>
struct RowState {
  double mass = 0, fill = 0;
  Vec<Dim> momentum = Vec<Dim>::Zero();
};

/// Mass times the velocity that strains see in the step: at its start, at its end, or their mean.
template <int Dim>
Vec<Dim> strain_momentum(const NodeBox<Dim>& nodes, int row, double mass, StressUpdate update) {
  using Map = Eigen::Map<const Vec<Dim>>;
  const auto at = static_cast<std::size_t>(row);
  const Map start(nodes.sums.data() + at * NodeSums<Dim>::width + NodeSums<Dim>::momentum);
  const double* motion = nodes.motion.data() + at * NodeMotion<Dim>::width + NodeMotion<Dim>::velocity;
  const double* end = update == StressUpdate::last ? motion : nodes.velocity.data() + at * vector_width;
  if (update == StressUpdate::first) return start;
  if (update == StressUpdate::both) return 0.5 * (start + mass * Map(end));
  return mass * Map(end);
}

/// The row of a piece that the crack cuts; -1: none.
template <int Dim>
int row_at(const CrackSurroundings<Dim>& around, int crack, const Piece<Dim>& piece, const Index<Dim>& place,
           SideSet sides) {
  const NodeBox<Dim>& nodes = piece.nodes;
  if (!(around.densities[piece.body] > 0) || !around.cracks[crack].cuts(piece.body) || !nodes.box.contains(place))
    return -1;
  if (sides.empty()) return nodes.box.offset(place);
  const int further = nodes.further.find(place, sides);
  return further < 0 ? -1 : nodes.row_of(further);
}

template <int Dim>
RowState<Dim> state_of(const CrackSurroundings<Dim>& around, int crack, const Index<Dim>& place, SideSet sides) {
  RowState<Dim> state;
  for (const auto& piece : around.patch.pieces) {
    const NodeBox<Dim>& nodes = piece.nodes;
    const int row = row_at<Dim>(around, crack, piece, place, sides);
    if (row < 0) continue;
    const double density = around.densities[piece.body];
    const double mass = nodes.sums[static_cast<std::size_t>(row) * NodeSums<Dim>::width];
    state.mass += mass, state.fill += mass / (density * around.lattice.cell_volume());
    // Where tractions are found the arrays may be those of the step before, on another box: only masses are asked for.
    const auto end = static_cast<std::size_t>(row) + 1;
    const bool by_velocity = around.update != StressUpdate::first && around.update != StressUpdate::last;
    if (nodes.motion.size() >= end * NodeMotion<Dim>::width &&
        (!by_velocity || nodes.velocity.size() >= end * vector_width))
      state.momentum += strain_momentum(nodes, row, mass, around.update);
  }
  return state;
}

/// The cracks that the line from a face to a node crosses: the own one is left on the side's side.
template <int Dim>
SideSet sides_seen(const CrackSurroundings<Dim>& around, SegmentsSeen<Dim>& segments, const CrackPoint<Dim>& point,
                   const Vec<Dim>& face, const Vec<Dim>& start, const Vec<Dim>& node, int body) {
  const SideSet own = around.segments.crossed(segments.own(node), start, node, body, around.cracks).sides;
  const SideSet others = around.segments.crossed(segments.others(node), face, node, body, around.cracks).sides;
  std::vector<int> list;
  for (int k = 0; k < others.size(); ++k)
    if (others.crack(k) != point.crack) list.push_back(others.crack(k));
  if (own.contains(point.crack)) list.push_back(point.crack);
  std::sort(list.begin(), list.end());
  SideSet sides;
  for (std::size_t k = 0; k < std::min<std::size_t>(list.size(), SideSet::most); ++k) sides = sides.with(list[k]);
  return sides;
}

/// A body that the crack cuts, of those in the patch; -1: none.
template <int Dim>
int cut_body(const CrackSurroundings<Dim>& around, int crack) {
  for (const auto& piece : around.patch.pieces)
    if (around.densities[piece.body] > 0 && around.cracks[crack].cuts(piece.body)) return piece.body;
  return -1;
}

/// Calls f(place, node, weight) for the nodes nearest to x.
template <int Dim, class F>
void for_nearest(const Lattice<Dim>& lattice, const Vec<Dim>& x, F&& f) {
  Box<Dim> around;
  for (int d = 0; d < Dim; ++d) {
    const int middle = static_cast<int>(std::floor(lattice.scaled(d, x[d]) + 0.5));
    around.lower[d] = middle - 1, around.upper[d] = middle + 2;
  }
  for_each(around, [&](const Index<Dim>& place) {
    Vec<Dim> node;
    double weight = 1;
    for (int d = 0; d < Dim; ++d) {
      node[d] = lattice.node_position(d, place[d]);
      weight *= spline(lattice.scaled(d, x[d]) - place[d]);
    }
    f(place, node, weight);
  });
}

/// Velocity of the material that a face sees.
template <int Dim>
Vec<Dim> velocity_of(const CrackSurroundings<Dim>& around, int crack, const FaceRows<Dim>& face) {
  Vec<Dim> v = Vec<Dim>::Zero();
  for (const auto& at : face.rows) {
    const auto state = state_of<Dim>(around, crack, at.place, at.sides);
    v += at.weight / state.mass * state.momentum;
  }
  return v;
}

/// Calls f(state) for all rows at a node.
template <int Dim, class F>
void for_rows(const CrackSurroundings<Dim>& around, int crack, const Index<Dim>& place, F&& f) {
  f(state_of<Dim>(around, crack, place, {}));
  std::vector<SideSet> seen;
  for (const auto& piece : around.patch.pieces) {
    const auto [first, last] = piece.nodes.further.at(place);
    for (int k = first; k < last; ++k) seen.push_back(piece.nodes.further.rows[k].sides);
  }
  std::sort(seen.begin(), seen.end());
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
  for (const SideSet sides : seen) f(state_of<Dim>(around, crack, place, sides));
}

/// The common velocity of all that moves around x; nothing where nothing does.
template <int Dim>
std::optional<Vec<Dim>> common_velocity(const CrackSurroundings<Dim>& around, int crack, const Vec<Dim>& x) {
  double mass = 0;
  Vec<Dim> momentum = Vec<Dim>::Zero();
  for_nearest(around.lattice, x, [&](const Index<Dim>& place, const Vec<Dim>&, double weight) {
    for_rows<Dim>(around, crack, place, [&](const RowState<Dim>& state) {
      mass += weight * state.mass, momentum += weight * state.momentum;
    });
  });
  if (!(mass > 0)) return {};
  return Vec<Dim>(momentum / mass);
}

}  // namespace

template <int Dim>
FaceRows<Dim> rows_of_face(const CrackSurroundings<Dim>& around, const CrackPoint<Dim>& point, int side) {
  FaceRows<Dim> face;
  const int body = cut_body(around, point.crack);
  const Vec<Dim> normal = around.segments.normal_at(point);
  if (body < 0 || !(normal.squaredNorm() > 0)) return face;
  const Lattice<Dim>& lattice = around.lattice;
  const Vec<Dim> x = side > 0 ? point.upper : point.lower;
  const Vec<Dim> start = point.plane + side * aside * lattice.smallest_spacing() * normal;
  SegmentsSeen<Dim> seen(around, point.crack, x, start);
  constexpr int size = 1 + Dim;
  using Square = Eigen::Matrix<double, size, size>;
  Square M = Square::Zero();
  const auto basis = [&](const Index<Dim>& place) {
    Eigen::Matrix<double, size, 1> b;
    b[0] = 1;
    for (int d = 0; d < Dim; ++d) b[1 + d] = place[d] - lattice.scaled(d, x[d]);
    return b;
  };
  for_nearest(lattice, x, [&](const Index<Dim>& place, const Vec<Dim>& node, double weight) {
    const SideSet sides = sides_seen(around, seen, point, x, start, node, body);
    const double fill = std::min(1.0, state_of<Dim>(around, point.crack, place, sides).fill / light);
    if (!(weight * fill > 0)) return;
    face.filled += weight * fill;
    face.rows.push_back({place, sides, weight * fill});
    M += weight * fill * basis(place) * basis(place).transpose();
  });
  if (face.rows.empty()) return face;
  for (int d = 1; d < size; ++d) M(d, d) += stiff * M(0, 0);
  const Eigen::Matrix<double, size, 1> row = M.ldlt().solve(Eigen::Matrix<double, size, 1>::Unit(0));
  double sum = 0;
  for (auto& at : face.rows) at.weight *= row.dot(basis(at.place)), sum += at.weight;
  for (auto& at : face.rows) at.weight /= sum;
  return face;
}

template <int Dim>
double fill_at(const CrackSurroundings<Dim>& around, int crack, const Vec<Dim>& x) {
  double fill = 0;
  for_nearest(around.lattice, x, [&](const Index<Dim>& place, const Vec<Dim>&, double weight) {
    double there = 0;
    for_rows<Dim>(around, crack, place, [&](const RowState<Dim>& state) { there += state.fill; });
    fill += weight * std::min(1.0, there);
  });
  return fill;
}

namespace {

/// Whether x lies so near to a patch's cells that it has all nodes around it.
template <int Dim>
bool is_among_nodes(const Lattice<Dim>& lattice, const Box<Dim>& cells, const Vec<Dim>& x) {
  for (int d = 0; d < Dim; ++d) {
    const double xi = lattice.scaled(d, x[d]);
    if (!(xi >= cells.lower[d] - 0.49 && xi <= cells.upper[d] + 0.49)) return false;
  }
  return true;
}

/// The cells of the patch to which a crack point belongs, in this patch's frame; empty where none is near.
template <int Dim>
Box<Dim> cells_of_owner(const CrackSurroundings<Dim>& around, const CrackPoint<Dim>& point) {
  for (const auto& link : around.patch.links) {
    const Box<Dim> cells = around.lattice.patch_cells(link.patch).shifted(link.shift);
    Index<Dim> cell;
    for (int d = 0; d < Dim; ++d) {
      cell[d] = static_cast<int>(std::floor(around.lattice.scaled(d, point.plane[d])));
      if (!around.lattice.periodic(d)) cell[d] = std::clamp(cell[d], 0, around.lattice.cells()[d] - 1);
    }
    if (cells.contains(cell)) return cells;
  }
  return {};
}

/// Whether a face lies among the patch's nodes, and not among those of the patch that the crack point belongs to.
template <int Dim>
bool answers_for_face(const CrackSurroundings<Dim>& around, const CrackPoint<Dim>& point, int side) {
  const Vec<Dim>& x = point.face(side);
  if (!is_among_nodes(around.lattice, around.patch.cells, x)) return false;
  if (point.own) return true;
  const Box<Dim> owner = cells_of_owner(around, point);
  return !owner.empty() && !is_among_nodes(around.lattice, owner, x);
}

/// Velocities of the two faces, where they are known: {below, above}.
template <int Dim>
using Faces = std::array<std::optional<Vec<Dim>>, 2>;

template <int Dim>
Faces<Dim> velocities_of_faces(const CrackSurroundings<Dim>& around, CrackPoint<Dim>& point) {
  const Crack& crack = around.cracks[point.crack];
  Faces<Dim> faces;
  point.faces_filled = 0;
  if (crack.idle) faces[0] = faces[1] = Vec<Dim>::Zero();
  if (crack.idle) return faces;
  if (is_tip(crack, point)) {
    faces[0] = faces[1] = common_velocity(around, point.crack, point.plane);
    return faces;
  }
  for (const int side : {-1, 1}) {
    auto& velocity = faces[side > 0];
    if (!is_among_nodes(around.lattice, around.patch.cells, point.face(side))) {
      // A neighbour's: what it did last, until it tells.
      velocity = side > 0 ? point.upper_velocity : point.lower_velocity;
      continue;
    }
    const auto rows = rows_of_face(around, point, side);
    if (!rows.is_filled()) continue;
    velocity = velocity_of(around, point.crack, rows);
    point.faces_filled |= CrackPoint<Dim>::filled_bit(side);
  }
  if (!faces[1]) faces[1] = faces[0];
  if (!faces[0]) faces[0] = faces[1];
  return faces;
}

}  // namespace

/// Of the material in a row, as strains see it at the start of a step.
template <int Dim>
Vec<Dim> start_velocity(const CrackSurroundings<Dim>& around, int crack, const typename FaceRows<Dim>::At& at) {
  double mass = 0;
  Vec<Dim> momentum = Vec<Dim>::Zero();
  for (const auto& piece : around.patch.pieces) {
    const int row = row_at<Dim>(around, crack, piece, at.place, at.sides);
    if (row < 0) continue;
    const double* sums = piece.nodes.sums.data() + static_cast<std::size_t>(row) * NodeSums<Dim>::width;
    mass += sums[NodeSums<Dim>::mass];
    momentum += Eigen::Map<const Vec<Dim>>(sums + NodeSums<Dim>::momentum);
  }
  return momentum / mass;
}

template <int Dim>
std::vector<FaceMotion<Dim>> find_face_velocities(std::vector<CrackPoint<Dim>>& points,
                                                  const CrackSurroundings<Dim>& around) {
  std::vector<Faces<Dim>> known(points.size());
  std::vector<FaceMotion<Dim>> told;
  for (std::size_t k = 0; k < points.size(); ++k) {
    CrackPoint<Dim>& point = points[k];
    if (point.own) {
      known[k] = velocities_of_faces(around, point);
      continue;
    }
    for (const int side : {-1, 1}) {
      if (!answers_for_face(around, point, side)) continue;
      const auto rows = rows_of_face(around, point, side);
      if (rows.is_filled()) told.push_back({static_cast<int>(k), side, velocity_of(around, point.crack, rows)});
    }
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    CrackPoint<Dim>& point = points[k];
    if (!point.own) continue;
    point.filled = known[k][0].has_value();
    Faces<Dim>& faces = known[k];
    if (!faces[0]) faces[0] = faces[1] = common_velocity(around, point.crack, point.plane);
    for (const int side : {-1, 1})
      if (faces[side > 0]) point.velocity(side) = *faces[side > 0];  // nothing near: as before
  }
  return told;
}

template <int Dim>
void keep_idle_bonds_closed(std::vector<CrackPoint<Dim>>& points) {
  for (CrackPoint<Dim>& point : points) {
    if (!point.own || !carries(point.bond) || point.faces_filled == 3) continue;
    const Vec<Dim> mean = 0.5 * (point.lower_velocity + point.upper_velocity);
    point.lower_velocity = point.upper_velocity = mean;
  }
}

template <int Dim>
std::vector<RowForce<Dim>> find_row_forces(
    const CrackSurroundings<Dim>& around, double ahead,
    const std::function<Vec<Dim>(const CrackPoint<Dim>&, const Vec<Dim>&)>& traction) {
  std::vector<RowForce<Dim>> forces;
  for (const auto& point : around.patch.cracks) {
    if (!carries(point.bond) || is_tip(around.cracks[point.crack], point)) continue;
    std::array<FaceRows<Dim>, 2> rows;
    Vec<Dim> opening = point.opening();
    bool whole = point.own, filled = true;
    for (const int side : {-1, 1}) {
      const bool here = answers_for_face(around, point, side);
      if (here) rows[side > 0] = rows_of_face(around, point, side);
      whole = whole && here, filled = filled && rows[side > 0].is_filled();
    }
    // Faces with material on both sides now part in this step, and no others. Of a wide crack one patch does not know
    // both: as they were.
    if (whole ? !filled : point.faces_filled != 3) continue;
    for (const int side : {-1, 1})
      for (const auto& at : rows[side > 0].rows)
        if (whole) opening += side * ahead * at.weight * start_velocity<Dim>(around, point.crack, at);
    const Vec<Dim> pull = point.bond.length * traction(point, opening);
    for (const int side : {-1, 1})
      for (const auto& at : rows[side > 0].rows)
        forces.push_back(
            {around.patch.id, point.crack, point.index, side, at.place, at.sides, -side * at.weight * pull});
  }
  return forces;
}

template <int Dim>
void sort_row_forces(std::vector<RowForce<Dim>>& forces) {
  const auto face = [](const RowForce<Dim>& f) { return std::tuple(f.crack, f.index, f.side); };
  const auto order = [&](const RowForce<Dim>& f) {
    return std::tuple(f.crack, f.index, f.side, f.from, FurtherRow<Dim>{f.place, f.sides});
  };
  std::ranges::sort(forces, {}, order);
  std::vector<RowForce<Dim>> first;
  for (const auto& f : forces)
    if (first.empty() || face(first.back()) != face(f) || first.back().from == f.from) first.push_back(f);
  forces = std::move(first);
}

template <int Dim>
void add_row_forces(Patch<Dim>& patch, const CrackSurroundings<Dim>& around, const std::vector<RowForce<Dim>>& forces) {
  for (const auto& f : forces) {
    const double whole = state_of<Dim>(around, f.crack, f.place, f.sides).mass;
    for (auto& piece : patch.pieces) {
      const int row = row_at<Dim>(around, f.crack, piece, f.place, f.sides);
      if (row < 0) continue;
      const double mass = piece.nodes.sums[static_cast<std::size_t>(row) * NodeSums<Dim>::width];
      if (mass > 0)
        Eigen::Map<Vec<Dim>>(piece.nodes.force.data() + static_cast<std::size_t>(row) * vector_width) +=
            mass / whole * f.force;
    }
  }
}

#define CAIRN_INSTANTIATE(Dim)                                                                                         \
  template FaceRows<Dim> rows_of_face(const CrackSurroundings<Dim>&, const CrackPoint<Dim>&, int);                     \
  template std::vector<FaceMotion<Dim>> find_face_velocities(std::vector<CrackPoint<Dim>>&,                            \
                                                             const CrackSurroundings<Dim>&);                           \
  template double fill_at(const CrackSurroundings<Dim>&, int, const Vec<Dim>&);                                        \
  template std::vector<RowForce<Dim>> find_row_forces(                                                                 \
      const CrackSurroundings<Dim>&, double, const std::function<Vec<Dim>(const CrackPoint<Dim>&, const Vec<Dim>&)>&); \
  template void sort_row_forces(std::vector<RowForce<Dim>>&);                                                          \
  template void add_row_forces(Patch<Dim>&, const CrackSurroundings<Dim>&, const std::vector<RowForce<Dim>>&);         \
  template void keep_idle_bonds_closed(std::vector<CrackPoint<Dim>>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
