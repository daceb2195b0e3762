#pragma once
/// Pieces with random points, and sums over all points and all nodes written as plain loops.

#include <functional>
#include <string>
#include <type_traits>

#include "cairn/body/patch.hpp"
#include "cairn/transfer/transfer.hpp"
#include "tensors.hpp"
#include "weights.hpp"

namespace cairn::test {

/// One material point as matrices and vectors.
template <int Dim>
struct PointState {
  Vec<Dim> x, v;
  Mat3 F, stress;
  double volume0;
  Vec3 spin = Vec3::Zero();
  double volume() const { return volume0 * F.determinant(); }
};

template <int Dim>
void put_point(Points<Dim>& points, int p, const PointState<Dim>& state) {
  using C = PointColumns<Dim>;
  for (int d = 0; d < Dim; ++d) points.column(d)[p] = state.x[d], points.column(C::velocity + d)[p] = state.v[d];
  const auto F = tensor<Dim>(state.F);
  const auto s = symmetric<Dim>(state.stress);
  for (int i = 0; i < tensor_size<Dim>; ++i) points.column(C::deformation + i)[p] = F.c[i];
  for (int i = 0; i < symmetric_size<Dim>; ++i) points.column(C::stress + i)[p] = s.c[i];
  points.column(C::volume)[p] = state.volume0;
  for (int s = 0; s < spin_size<Dim>; ++s) points.column(C::spin + s)[p] = state.spin[Dim == 2 ? 2 : s];
}

template <int Dim>
PointState<Dim> get_point(const Points<Dim>& points, int p) {
  using C = PointColumns<Dim>;
  PointState<Dim> state;
  for (int d = 0; d < Dim; ++d) state.x[d] = points.column(d)[p], state.v[d] = points.column(C::velocity + d)[p];
  Tensor<Dim, double> F;
  Symmetric<Dim, double> s;
  for (int i = 0; i < tensor_size<Dim>; ++i) F.c[i] = points.column(C::deformation + i)[p];
  for (int i = 0; i < symmetric_size<Dim>; ++i) s.c[i] = points.column(C::stress + i)[p];
  state.F = matrix(F), state.stress = matrix(s), state.volume0 = points.column(C::volume)[p];
  for (int s = 0; s < spin_size<Dim>; ++s) state.spin[Dim == 2 ? 2 : s] = points.column(C::spin + s)[p];
  return state;
}

/// w x arm.
template <int Dim>
Vec<Dim> turning(const Vec3& spin, const Vec<Dim>& arm) {
  Vec3 r = Vec3::Zero();
  r.head<Dim>() = arm;
  return spin.cross(r).template head<Dim>();
}

/// A random state at x: stress of the order of `stress` [Pa].
template <int Dim>
PointState<Dim> random_point(Random& random, const Vec<Dim>& x, double stress) {
  return {x,
          random.vector<Dim>(2),
          Mat3::Identity() + random_matrix<Dim>(random, 0.15),
          random_symmetric<Dim>(random, stress),
          random(1e-3, 2e-3),
          Vec3(random(-3, 3), random(-3, 3), random(-3, 3))};
}

/// `count` random points between two corners given in cells.
template <int Dim>
Piece<Dim> random_piece(Random& random, const Lattice<Dim>& lattice, int count, const Vec<Dim>& from,
                        const Vec<Dim>& to, int body = 0, int states = 0) {
  Piece<Dim> piece(body, states);
  piece.points.resize(count);
  for (int p = 0; p < count; ++p) {
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d) x[d] = lattice.lower()[d] + random(from[d], to[d]) * lattice.spacing()[d];
    put_point(piece.points, p, random_point<Dim>(random, x, 1e4));
    piece.points.ids()[p] = p;
    piece.points.images()[p] = {};
    for (int s = 0; s < states; ++s) piece.points.column(PointColumns<Dim>::state + s)[p] = 0;
  }
  return piece;
}

/// A one-dimensional weight of direction d from the distance to the node in cells.
using Formula = std::function<Weight(int d, double x)>;

inline Formula formula_of(ShapeFunction shape, const std::array<double, 3>& half) {
  switch (shape) {
    case ShapeFunction::linear:
      return [](int, double x) { return hat(x); };
    case ShapeFunction::bspline2:
      return [](int, double x) { return spline(x); };
    case ShapeFunction::gimp:
    case ShapeFunction::cpdi:  // no product: tests/transfer/test_cpdi.cpp has its own
      break;
  }
  return [half](int d, double x) { return gimp(x, half[d]); };
}

/// Weight and gradient [1/m] of a node at a position.
template <int Dim>
std::pair<double, Vec<Dim>> weight_of(const Lattice<Dim>& lattice, const Formula& formula, const Vec<Dim>& x,
                                      const std::type_identity_t<Index<Dim>>& node) {
  double value = 1;
  Vec<Dim> gradient = Vec<Dim>::Ones();
  for (int d = 0; d < Dim; ++d) {
    const Weight w = formula(d, (x[d] - lattice.node_position(d, node[d])) / lattice.spacing()[d]);
    value *= w.value;
    for (int e = 0; e < Dim; ++e) gradient[e] *= d == e ? w.slope / lattice.spacing()[d] : w.value;
  }
  return {value, gradient};
}

/// All nodal sums of a piece on the nodes of a box, each a column for each node.
template <int Dim>
struct NaiveSums {
  using Columns = Eigen::Matrix<double, Dim, Eigen::Dynamic>;
  Eigen::RowVectorXd mass, volume;
  Columns momentum, force, volume_gradient, mass_gradient, position;
  Eigen::Matrix<double, 9, Eigen::Dynamic> stress;

  NaiveSums(const Points<Dim>& points, const Lattice<Dim>& lattice, const Box<Dim>& box, const Formula& shape,
            const Formula& normals, double density, const Vec<Dim>& gravity, bool spin) {
    const auto n = static_cast<Eigen::Index>(box.size());
    mass = volume = Eigen::RowVectorXd::Zero(n);
    momentum = force = volume_gradient = mass_gradient = position = Columns::Zero(Dim, n);
    stress.setZero(9, n);
    for_each(box, [&](const Index<Dim>& node) {
      const int i = box.offset(node);
      for (int p = 0; p < points.size(); ++p) {
        const auto at = get_point(points, p);
        const auto [w, g] = weight_of(lattice, shape, at.x, node);
        const double m = density * at.volume0, V = at.volume();
        Vec<Dim> node_x = Vec<Dim>::Zero();
        for (int d = 0; d < Dim; ++d) node_x[d] = lattice.node_position(d, node[d]);
        mass[i] += m * w, volume[i] += V * w;
        momentum.col(i) += m * w * at.v;
        if (spin) momentum.col(i) += m * w * turning<Dim>(at.spin, node_x - at.x);
        const Mat3 flux = V * at.stress;
        force.col(i) += m * w * gravity - flux.topLeftCorner<Dim, Dim>() * g;
        const Vec<Dim> outward = weight_of(lattice, normals, at.x, node).second;
        volume_gradient.col(i) += V * outward, mass_gradient.col(i) += m * outward;
        position.col(i) += V * w * (at.x - node_x);
        stress.col(i) += w * flux.reshaped();
      }
    });
  }
};

/// Columns [first, first + rows) of a nodal array of a piece, spread over a larger box, zero where the piece has none.
template <int Dim>
Eigen::MatrixXd nodal(const NodeBox<Dim>& nodes, AlignedDoubles NodeBox<Dim>::*array, int width, int first, int rows,
                      const Box<Dim>& box) {
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(box.size()));
  for_each(nodes.box, [&](const Index<Dim>& i) {
    for (int r = 0; r < rows; ++r)
      all(r, box.offset(i)) = (nodes.*array)[static_cast<std::size_t>(nodes.box.offset(i)) * width + first + r];
  });
  return all;
}
template <int Dim>
Eigen::MatrixXd nodal_sums(const NodeBox<Dim>& nodes, int first, int rows, const Box<Dim>& box) {
  return nodal(nodes, &NodeBox<Dim>::sums, NodeSums<Dim>::width, first, rows, box);
}
template <int Dim>
Eigen::MatrixXd nodal_force(const NodeBox<Dim>& nodes, const Box<Dim>& box) {
  return nodal(nodes, &NodeBox<Dim>::force, vector_width, 0, Dim, box);
}

/// Largest difference over the largest value.
template <class Found, class Expected>
double relative_difference(const Found& found, const Expected& expected) {
  double difference = 0, largest = 1e-300;
  for (Eigen::Index c = 0; c < expected.cols(); ++c)
    for (Eigen::Index r = 0; r < expected.rows(); ++r) {
      difference = std::max(difference, std::abs(found(r, c) - expected(r, c)));
      largest = std::max(largest, std::abs(expected(r, c)));
    }
  return difference / largest;
}

/// Sum over all nodes of each row.
template <int Dim>
Vec<Dim> total(const Eigen::MatrixXd& columns) {
  Vec<Dim> sum = Vec<Dim>::Zero();
  for (Eigen::Index c = 0; c < columns.cols(); ++c)
    for (int d = 0; d < Dim; ++d) sum[d] += columns(d, c);
  return sum;
}
inline double total_size(const Eigen::MatrixXd& columns) {
  double sum = 0;
  for (Eigen::Index c = 0; c < columns.cols(); ++c)
    for (Eigen::Index r = 0; r < columns.rows(); ++r) sum += std::abs(columns(r, c));
  return sum;
}

}  // namespace cairn::test
