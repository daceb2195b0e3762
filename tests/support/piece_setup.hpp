#pragma once
/// A random piece with its transfer settings, and the loops over all nodes that transfers are compared with.

#include <gtest/gtest.h>

#include "lattices.hpp"
#include "pieces.hpp"

namespace cairn::test {

inline constexpr double round_off = 1e-13;  // relative to the largest value
inline constexpr double density = 1300;
inline constexpr int point_count = 61;  // seven chunks and a rest

template <int Dim>
struct PieceSetup {
  Lattice<Dim> lattice = make_lattice();
  TransferSettings<Dim> settings;
  Box<Dim> box = lattice.patch_nodes(0);
  Random random{7};
  Piece<Dim> piece{0, 0};
  Formula shape, normals;

  explicit PieceSetup(ShapeFunction kind, NormalSource source = NormalSource::volume_gradient, bool extras = false,
                      bool spin = true) {
    SolverOptions solver;
    solver.spin = spin;
    solver.shape = kind;
    solver.points_per_cell = Dim == 2 ? 9 : 8;
    ContactOptions contact;
    contact.normals = source;
    if (extras) contact.release = Release::traction;
    Vec<Dim> gravity;
    for (int d = 0; d < Dim; ++d) gravity[d] = 3.0 * d - 4;
    settings = TransferSettings<Dim>::make(solver, contact, gravity);
    const double half = 0.5 / (Dim == 2 ? 3 : 2);
    shape = formula_of(kind, {half, half, half});
    normals = shape;
    if (source == NormalSource::density) normals = [](int, double x) { return cell_density(x); };
    if (source == NormalSource::volume_gradient && kind == ShapeFunction::linear)
      normals = [half](int, double x) { return gimp(x, half); };
    // Half a cell beyond the faces, where contact with walls lets points go.
    piece = random_piece<Dim>(random, lattice, point_count, Vec<Dim>::Constant(-0.49), Vec<Dim>::Constant(5.49));
    lay_out_nodes(piece, lattice, settings);
  }
  static Lattice<Dim> make_lattice() {
    Index<Dim> cells;
    cells.fill(5);
    return lattice_of<Dim>(cells, {}, 5);
  }
  NaiveSums<Dim> naive() const {
    return {piece.points, lattice, box, shape, normals, density, settings.gravity, settings.spin};
  }
  /// Random velocities at the nodes of the piece; returns them over the whole box.
  Eigen::MatrixXd set_random(AlignedDoubles NodeBox<Dim>::*array, int width, int rows) {
    auto& values = piece.nodes.*array;
    values.assign(piece.nodes.box.size() * width, 0.0);
    for (std::size_t i = 0; i < piece.nodes.box.size(); ++i)
      for (int r = 0; r < rows; ++r) values[i * width + r] = random(-1, 1);
    return nodal(piece.nodes, array, width, 0, rows, box);
  }
  /// sum over nodes of weight times the node's column, and of column times gradient.
  Vec<Dim> interpolate(const Eigen::MatrixXd& columns, int first, const Vec<Dim>& x) const {
    Vec<Dim> sum = Vec<Dim>::Zero();
    for_each(box, [&](const Index<Dim>& i) {
      const double w = weight_of(lattice, shape, x, i).first;
      for (int d = 0; d < Dim; ++d) sum[d] += w * columns(first + d, box.offset(i));
    });
    return sum;
  }
  /// FLIP's spin w + dt sum N arm x a / sum N arm^2, blended with the grid's, sum N arm x v / sum N arm^2.
  Vec3 spin(const Eigen::MatrixXd& motion, const PointState<Dim>& at, double dt, double flip) const {
    Vec3 turn = Vec3::Zero(), grid = Vec3::Zero(), inertia = Vec3::Zero();
    const Vec<Dim> at_velocity = interpolate(motion, Dim, at.x);
    for_each(box, [&](const Index<Dim>& i) {
      const double w = weight_of(lattice, shape, at.x, i).first;
      Vec3 arm = Vec3::Zero(), a = Vec3::Zero(), v = Vec3::Zero();
      for (int d = 0; d < Dim; ++d) {
        arm[d] = lattice.node_position(d, i[d]) - at.x[d];
        a[d] = motion(d, box.offset(i)), v[d] = motion(Dim + d, box.offset(i));
      }
      turn += w * arm.cross(a), grid += w * arm.cross(v);
      inertia += w * (arm.squaredNorm() * Vec3::Ones() - arm.cwiseAbs2());
    });
    double cells = 0;  // that the point moves
    for (int d = 0; d < Dim; ++d) cells += std::pow(dt * at_velocity[d] / lattice.spacing()[d], 2);
    const double keep = flip * (1 - std::min(1.0, settings.spin_relaxation * std::sqrt(cells)));
    const Vec3 spin = keep * (at.spin + dt * turn.cwiseQuotient(inertia)) + (1 - keep) * grid.cwiseQuotient(inertia);
    return Dim == 2 ? Vec3(0, 0, spin[2]) : spin;
  }
  Mat3 velocity_gradient(const Eigen::MatrixXd& velocity, const Vec<Dim>& x) const {
    Mat3 L = Mat3::Zero();
    for_each(box, [&](const Index<Dim>& i) {
      const Vec<Dim> g = weight_of(lattice, shape, x, i).second;
      for (int d = 0; d < Dim; ++d)
        for (int e = 0; e < Dim; ++e) L(d, e) += velocity(d, box.offset(i)) * g[e];
    });
    return L;
  }
};

/// Calls check(setup) for every shape function.
template <int Dim, class F>
void for_shapes(F&& check) {
  for (ShapeFunction kind : {ShapeFunction::linear, ShapeFunction::gimp, ShapeFunction::bspline2})
    for (bool spin : {false, true}) {
      SCOPED_TRACE(testing::Message() << "shape " << static_cast<int>(kind) << " in " << Dim << "D, spin " << spin);
      PieceSetup<Dim> setup(kind, NormalSource::volume_gradient, false, spin);
      check(setup);
    }
}

}  // namespace cairn::test
