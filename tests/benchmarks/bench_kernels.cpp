// Speed of the transfers between points and nodes, kernel by kernel, on one core, and the bandwidth of its memory.
//
//   bench_kernels                                            everything: minutes
//   bench_kernels --benchmark_filter='3D/gimp/.*block'       what matches
//   bench_kernels --benchmark_filter=triad
//
// Names: KERNEL/DIMENSION/SHAPE[/LAW]/SIZE. SIZE is `grain`: the one piece of a ball 8 cells across, which stays in the
// cache; or `block`: about a million points in pieces as large as a patch, which do not.

#include <benchmark/benchmark.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "cairn/transfer/transfer.hpp"

namespace cairn {
namespace {

constexpr double density = 1900, spacing = 1e-5;  // [kg/m3], [m]
constexpr double wave_speed = 3400;               // about that of the laws below [m/s]
constexpr double dt =
    1e-9 * spacing / wave_speed;  // so short that the state hardly changes however often it is advanced

enum class Size { grain, block };

Law law_named(const std::string& name) {
  const ParameterValues moduli = {{"shear_modulus", 7.5e9}, {"bulk_modulus", 11.4e9}};
  if (name == "neo_hookean") return NeoHookean(moduli);
  ParameterValues plastic = moduli;
  plastic["yield_stress"] = 0.3e9, plastic["hardening_modulus"] = 0.01e9;
  return VonMises(plastic);
}

/// The pieces of one body in as many patches as it covers, with smooth nodal fields.
template <int Dim>
struct Workload {
  Lattice<Dim> lattice;
  TransferSettings<Dim> settings;
  Law law;
  std::vector<Piece<Dim>> pieces;
  std::int64_t points = 0;

  Workload(ShapeFunction shape, const std::string& law_name, Size size)
      : lattice(make_lattice(size)), law(law_named(law_name)) {
    SolverOptions solver;
    solver.shape = shape;
    solver.points_per_cell = 1 << Dim;
    settings = TransferSettings<Dim>::make(solver, ContactOptions{}, Vec<Dim>::Zero());
    const int states = std::visit([](const auto& l) { return static_cast<int>(l.state_names.size()); }, law);
    for (int patch = 0; patch < lattice.patch_count(); ++patch) {
      Piece<Dim>& piece = pieces.emplace_back(0, states);
      fill(piece, lattice.patch_cells(patch), size);
      set_nodes(piece);
      points += piece.points.size();
    }
  }

 private:
  /// 512^2 or 48^3 cells; or 12 cells a side with the ball in their middle.
  static Lattice<Dim> make_lattice(Size size) {
    const int n = size == Size::grain ? 12 : Dim == 2 ? 512 : 48;
    Index<Dim> cells;
    cells.fill(n);
    return {Vec<Dim>::Zero(), Vec<Dim>::Constant(n * spacing), cells, {}, Dim == 2 ? 32 : 16};
  }

  void fill(Piece<Dim>& piece, const Box<Dim>& cells, Size size) {
    std::vector<Vec<Dim>> positions;
    Box<Dim> inside;
    inside.upper.fill(2);
    for_each(cells, [&](const Index<Dim>& cell) {
      for_each(inside, [&](const Index<Dim>& sub) {
        Vec<Dim> x;
        for (int d = 0; d < Dim; ++d) x[d] = cell[d] + 0.25 + 0.5 * sub[d];
        if (size == Size::block || (x - Vec<Dim>::Constant(6)).norm() <= 4) positions.push_back(x);
      });
    });
    using C = PointColumns<Dim>;
    auto& points = piece.points;
    points.resize(static_cast<int>(positions.size()));
    for (int p = 0; p < points.size(); ++p) {
      for (int c = 0; c < points.columns(); ++c) points.column(c)[p] = 0;
      for (int i = 0; i < 3; ++i) points.column(C::deformation + tensor_index<Dim>(i, i))[p] = 1;
      for (int d = 0; d < Dim; ++d) {
        points.column(d)[p] = (positions[p][d] + 0.1 * std::sin(positions[p].sum())) * spacing;  // no longer a lattice
        points.column(C::velocity + d)[p] = std::cos(positions[p][d]);
      }
      points.column(C::volume)[p] = lattice.cell_volume() / (1 << Dim);
    }
  }

  void set_nodes(Piece<Dim>& piece) {
    lay_out_nodes(piece, lattice, settings);
    project(piece, lattice, settings, density);
    velocity_from_sums(piece);
    integrate(piece, dt);
  }
};

template <int Dim>
using Kernel = std::function<void(Workload<Dim>&, Piece<Dim>&)>;

template <int Dim>
void add(const std::string& kernel, ShapeFunction shape, const std::string& law, Size size, const Kernel<Dim>& run,
         bool law_matters) {
  const char* shapes[] = {"linear", "gimp", "bspline2"};
  std::string name = kernel + (Dim == 2 ? "/2D/" : "/3D/") + shapes[static_cast<int>(shape)];
  if (law_matters) name += "/" + law;
  name += size == Size::grain ? "/grain" : "/block";
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    Workload<Dim> work(shape, law, size);
    for (auto _ : state)
      for (auto& piece : work.pieces) {
        run(work, piece);
        benchmark::ClobberMemory();
      }
    state.counters["Mpoints"] =
        benchmark::Counter(1e-6 * static_cast<double>(work.points), benchmark::Counter::kIsIterationInvariantRate);
  })->Unit(benchmark::kMicrosecond);
}

template <int Dim>
void add_kernels() {
  using W = Workload<Dim>;
  using P = Piece<Dim>;
  for (Size size : {Size::grain, Size::block})
    for (ShapeFunction shape : {ShapeFunction::linear, ShapeFunction::gimp, ShapeFunction::bspline2}) {
      const auto plain = [&](const std::string& name, const Kernel<Dim>& run) {
        add<Dim>(name, shape, "neo_hookean", size, run, false);
      };
      plain("project", [](W& w, P& p) { project(p, w.lattice, w.settings, density); });
      plain("accelerate_and_project",
            [](W& w, P& p) { accelerate_and_project(p, w.lattice, w.settings, density, dt); });
      plain("accelerate_and_move", [](W& w, P& p) {
        SpeedLimits speeds;
        accelerate_and_move(p, w.lattice, w.settings, density, 0, speeds);
      });
      for (const char* law : {"neo_hookean", "von_mises"}) {
        add<Dim>(
            "update_stress_and_move", shape, law, size,
            [](W& w, P& p) {
              SpeedLimits speeds;
              update_stress_and_move(p, w.lattice, w.settings, w.law, density, dt, 0, speeds);
            },
            true);
        add<Dim>(
            "update_stress_and_force", shape, law, size,
            [](W& w, P& p) {
              SpeedLimits speeds;
              update_stress_and_force(p, w.lattice, w.settings, w.law, density, dt, speeds);
            },
            true);
      }
    }
}

/// a = b + s c with arrays of 64 MiB; 24 bytes are counted for each element, as is usual, though the store may also
/// read.
void triad(benchmark::State& state) {
  constexpr std::size_t n = (std::size_t{64} << 20) / sizeof(double);
  AlignedDoubles a(n), b(n), c(n);
  std::fill(a.begin(), a.end(), 0.0);
  std::fill(b.begin(), b.end(), 1.0);
  std::fill(c.begin(), c.end(), 2.0);
  for (auto _ : state) {
    double* __restrict to = a.data();
    const double *left = b.data(), *right = c.data();
    for (std::size_t i = 0; i < n; ++i) to[i] = left[i] + 3.0 * right[i];
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * 3 * n * sizeof(double)));
}
BENCHMARK(triad)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace cairn

int main(int argc, char** argv) {
  cairn::add_kernels<2>();
  cairn::add_kernels<3>();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
