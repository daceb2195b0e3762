// Shape functions: their defining properties, and their formulas written a second time from the literature.

#include <gtest/gtest.h>

#include <map>

#include "../support/lattices.hpp"
#include "../support/random.hpp"
#include "../support/weights.hpp"
#include "cairn/grid/shape_functions.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr double round_off = 1e-14;
const std::vector<double> half_sizes = {0.5, 0.25, 1.0 / 6, 0.125, 0.01};

/// Values and slopes of one point, by node.
template <class Shape>
std::map<int, Weight> weights(const Shape& shape, double xi, double first) {
  Lanes value[Shape::nodes], slope[Shape::nodes];
  shape.evaluate(0, broadcast(xi), broadcast(first), value, slope);
  std::map<int, Weight> all;
  for (int k = 0; k < Shape::nodes; ++k) all[static_cast<int>(first) + k] = {value[k][3], slope[k][3]};
  return all;
}
template <class Shape>
std::map<int, Weight> weights(const Shape& shape, double xi) {
  return weights(shape, xi, Shape::first_node(xi));
}

/// Positions on and off nodes, cell middles and the breaks between the pieces of the formulas.
std::vector<double> positions() {
  std::vector<double> all = {0, 0.5, 0.25, 0.75, 1, -0.5, -2, 7.5};
  Random random;
  for (int k = 0; k < 500; ++k) all.push_back(random(-3, 40));
  return all;
}

template <class Shape>
void check_completeness(const Shape& shape) {
  for (double xi : positions()) {
    double one = 0, none = 0, place = 0, unit = 0;
    for (const auto& [node, w] : weights(shape, xi)) {
      one += w.value, none += w.slope;
      place += w.value * (node - xi), unit += w.slope * (node - xi);
    }
    EXPECT_NEAR(one, 1, 10 * round_off) << xi;
    EXPECT_NEAR(none, 0, 10 * round_off) << xi;
    EXPECT_NEAR(place, 0, 10 * round_off) << xi;
    EXPECT_NEAR(unit, 1, 10 * round_off) << xi;
  }
}
TEST(ShapeFunctions, ReproduceConstantsAndLinears) {
  check_completeness(LinearShape{});
  check_completeness(QuadraticShape{});
  check_completeness(CellDensityShape{});
  for (double l : half_sizes) {
    // A hat averaged over a tiny extent divides by it: round-off grows like 1/l.
    if (l >= 0.1) check_completeness(GimpShape{{l, l, l}});
  }
}

/// The formula of the literature at every node, also those that are not visited: there it must vanish.
template <class Shape, class Formula>
void check_formula(const Shape& shape, Formula&& formula, double tolerance = round_off) {
  for (double xi : positions()) {
    const auto found = weights(shape, xi);
    for (int node = static_cast<int>(std::floor(xi)) - 4; node < xi + 4; ++node) {
      const Weight expected = formula(xi - node);
      const auto at = found.find(node);
      const Weight w = at == found.end() ? Weight{0, 0} : at->second;
      EXPECT_NEAR(w.value, expected.value, tolerance) << xi - node;
      // On a node the hat has no slope; either side's will do there.
      if (xi != std::floor(xi)) {
        EXPECT_NEAR(w.slope, expected.slope, tolerance) << xi - node;
      }
    }
  }
}
TEST(ShapeFunctions, LinearIsTheHat) { check_formula(LinearShape{}, hat, 1e-13); }
TEST(ShapeFunctions, QuadraticIsTheSpline) { check_formula(QuadraticShape{}, spline, 1e-13); }
TEST(ShapeFunctions, CellDensityIsEquation24) { check_formula(CellDensityShape{}, cell_density, 1e-13); }
TEST(ShapeFunctions, GimpIsThePiecewiseFormula) {
  for (double l : half_sizes)
    check_formula(
        GimpShape{{l, l, l}}, [&](double x) { return gimp(x, l); }, 1e-13 / l);
}

/// Slopes against central differences, away from the breaks between pieces (multiples of 1/8), where these are exact.
template <class Shape>
void check_slopes(const Shape& shape) {
  const double h = 1e-5;
  for (int k = 0; k < 200; ++k) {
    const double xi = -2 + (k + 0.37) / 8, first = Shape::first_node(xi);
    const auto w = weights(shape, xi, first), up = weights(shape, xi + h, first), down = weights(shape, xi - h, first);
    for (const auto& [node, at] : w)
      EXPECT_NEAR(at.slope, (up.at(node).value - down.at(node).value) / (2 * h), 1e-9) << xi - node;
  }
}
TEST(ShapeFunctions, SlopesAreDerivatives) {
  check_slopes(LinearShape{});
  check_slopes(QuadraticShape{});
  for (double l : {0.5, 0.25, 0.125}) check_slopes(GimpShape{{l, l, l}});
}

/// Average of the hat over [x - l, x + l], exactly: the trapezoidal rule between breaks.
double average_hat(double x, double l) {
  std::vector<double> at = {x - l, x + l};
  for (double b : {-1.0, 0.0, 1.0})
    if (b > x - l && b < x + l) at.push_back(b);
  std::sort(at.begin(), at.end());
  double sum = 0;
  for (std::size_t i = 1; i < at.size(); ++i)
    sum += 0.5 * (hat(at[i - 1]).value + hat(at[i]).value) * (at[i] - at[i - 1]);
  return sum / (2 * l);
}

TEST(ShapeFunctions, GimpAveragesTheHat) {
  for (double l : half_sizes)
    for (double xi : positions())
      for (const auto& [node, w] : weights(GimpShape{{l, l, l}}, xi)) {
        const double x = xi - node;
        EXPECT_NEAR(w.value, average_hat(x, l), 1e-14 / l);
        EXPECT_NEAR(w.slope, (hat(x + l).value - hat(x - l).value) / (2 * l), 1e-14 / l);
      }
}

TEST(ShapeFunctions, GimpTendsToLinear) {
  const double l = 1e-7;
  for (double xi : positions()) {
    const auto fine = weights(GimpShape{{l, l, l}}, xi);
    for (const auto& [node, w] : weights(LinearShape{}, xi)) {
      if (fine.count(node) == 0) continue;  // the far node of a point close to another: its weight is tiny
      EXPECT_NEAR(fine.at(node).value, w.value, l + 1e-7);
      if (std::abs(xi - std::round(xi)) > l) {
        EXPECT_NEAR(fine.at(node).slope, w.slope, 1e-7);
      }
    }
  }
}

TEST(ShapeFunctions, LanesAreIndependent) {
  Lanes xi, value[3], slope[3];
  for (int lane = 0; lane < lane_count; ++lane) xi[lane] = 3.1 + 0.37 * lane;
  const GimpShape shape{{0.25, 0.25, 0.25}};
  const Lanes first = GimpShape::first_node(xi);
  shape.evaluate(0, xi, first, value, slope);
  for (int lane = 0; lane < lane_count; ++lane)
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(value[k][lane], gimp(xi[lane] - first[lane] - k, 0.25).value, 1e-13);
}

TEST(ShapeFunctions, GimpTakesTheHalfSizeOfItsDirection) {
  Lanes value[3], slope[3];
  const GimpShape shape{{0.5, 0.25, 0.125}};
  for (int d = 0; d < 3; ++d) {
    shape.evaluate(d, broadcast(2.1), broadcast(1.0), value, slope);
    EXPECT_NEAR(value[1][0], gimp(0.1, shape.half[d]).value, 1e-14);
  }
}

/// Eq. 24 with its two fields: densities of all cells first, then differences of these at the nodes.
template <int Dim>
std::map<Index<Dim>, Vec<Dim>> density_gradient(const Lattice<Dim>& lattice, const Vec<Dim>& x, const Box<Dim>& nodes) {
  std::map<Index<Dim>, double> density;
  Box<Dim> cells = nodes;
  for (int d = 0; d < Dim; ++d) --cells.lower[d];
  for_each(cells, [&](const Index<Dim>& cell) {
    double w = 1;
    for (int d = 0; d < Dim; ++d)
      w *= spline((lattice.node_position(d, 0) + (cell[d] + 0.5) * lattice.spacing()[d] - x[d]) / lattice.spacing()[d])
               .value;
    density[cell] = w / lattice.cell_volume();
  });
  std::map<Index<Dim>, Vec<Dim>> gradient;
  for_each(nodes, [&](const Index<Dim>& node) {
    Vec<Dim> g = Vec<Dim>::Zero();
    for (int corner = 0; corner < 1 << Dim; ++corner) {
      Index<Dim> cell = node;
      for (int d = 0; d < Dim; ++d) cell[d] -= (corner >> d) & 1;
      for (int d = 0; d < Dim; ++d)
        g[d] += ((corner >> d) & 1 ? -1 : 1) * density[cell] / (lattice.spacing()[d] * (1 << (Dim - 1)));
    }
    gradient[node] = g;
  });
  return gradient;
}

template <int Dim>
void check_cell_density() {
  std::array<bool, Dim> periodic{};
  Index<Dim> cells;
  cells.fill(8);
  const auto lattice = lattice_of<Dim>(cells, periodic, 8);
  Random random;
  alignas(64) double x[Dim][lane_count];
  const double* columns[Dim];
  for (int d = 0; d < Dim; ++d) {
    columns[d] = x[d];
    for (int lane = 0; lane < lane_count; ++lane) x[d][lane] = lattice.lower()[d] + random(2, 6) * lattice.spacing()[d];
  }
  const Box<Dim> box = lattice.patch_nodes(0);
  const Stencil<Dim, CellDensityShape> stencil(lattice, CellDensityShape{}, box, columns);
  for (int lane = 0; lane < lane_count; ++lane) {
    std::vector<Vec<Dim>> found(box.size(), Vec<Dim>::Zero());
    stencil.for_nodes(lane, [&](int node, double, const double(&g)[Dim]) {
      for (int d = 0; d < Dim; ++d) found[node][d] += g[d];
    });
    Vec<Dim> at;
    for (int d = 0; d < Dim; ++d) at[d] = x[d][lane];
    for (const auto& [node, g] : density_gradient(lattice, at, box))  // which points inwards
      EXPECT_LE((found[box.offset(node)] + g * lattice.cell_volume()).norm(), 1e-12 / lattice.smallest_spacing());
  }
}
TEST(ShapeFunctions, CellDensityFollowsThePaperStepByStep) {
  check_cell_density<2>();
  check_cell_density<3>();
}

/// Weights and gradients of eight points on every node of a box, against products of one-dimensional ones.
template <int Dim, class Shape, class Formula>
void check_stencil(const Shape& shape, Formula&& formula) {
  Index<Dim> cells;
  cells.fill(6);
  const auto lattice = lattice_of<Dim>(cells, {}, 6);
  const Box<Dim> box = lattice.patch_nodes(0);
  Random random;
  alignas(64) double x[Dim][lane_count];
  const double* columns[Dim];
  for (int d = 0; d < Dim; ++d) {
    columns[d] = x[d];
    for (int lane = 0; lane < lane_count; ++lane)
      x[d][lane] = lattice.lower()[d] + random(-0.5, 6.5) * lattice.spacing()[d];
  }
  const Stencil<Dim, Shape> stencil(lattice, shape, box, columns);
  for (int lane = 0; lane < lane_count; ++lane) {
    std::vector<Vec<Dim>> gradients(box.size(), Vec<Dim>::Zero());
    std::vector<double> values(box.size(), 0.0);
    stencil.for_nodes(lane, [&](int node, double w, const double(&g)[Dim]) {
      values.at(node) += w;
      for (int d = 0; d < Dim; ++d) gradients.at(node)[d] += g[d];
    });
    for_each(box, [&](const Index<Dim>& node) {
      double value = 1;
      Vec<Dim> gradient = Vec<Dim>::Ones();
      for (int d = 0; d < Dim; ++d) {
        const Weight w = formula((x[d][lane] - lattice.node_position(d, node[d])) / lattice.spacing()[d]);
        value *= w.value;
        for (int e = 0; e < Dim; ++e) gradient[e] *= d == e ? w.slope / lattice.spacing()[d] : w.value;
      }
      EXPECT_NEAR(values[box.offset(node)], value, 1e-13);
      EXPECT_LE((gradients[box.offset(node)] - gradient).norm(), 1e-12 / lattice.smallest_spacing());
    });
  }
}
TEST(ShapeFunctions, StencilsAreProducts) {
  check_stencil<2>(LinearShape{}, hat);
  check_stencil<3>(LinearShape{}, hat);
  check_stencil<2>(QuadraticShape{}, spline);
  check_stencil<3>(QuadraticShape{}, spline);
  check_stencil<2>(GimpShape{{0.25, 0.25, 0.25}}, [](double x) { return gimp(x, 0.25); });
  check_stencil<3>(GimpShape{{0.25, 0.25, 0.25}}, [](double x) { return gimp(x, 0.25); });
}

}  // namespace
}  // namespace cairn
