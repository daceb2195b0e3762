// Result files of cracks and of their tips.

#include "cairn/solver/output.hpp"
#include "columns.hpp"

namespace cairn {
namespace {

template <int Dim>
Vec3 padded(const Vec<Dim>& v) {
  Vec3 p = Vec3::Zero();
  p.template head<Dim>() = v;
  return p;
}

/// This rank's crack points, in the order of their rows.
template <int Dim>
std::vector<const CrackPoint<Dim>*> own_points(const Simulation<Dim>& simulation) {
  std::vector<const CrackPoint<Dim>*> own;
  for (const auto& patch : simulation.patches())
    for (const auto& point : patch.cracks)
      if (point.own) own.push_back(&point);
  if (Dim == 3) std::ranges::sort(own, {}, [](const auto* p) { return std::pair(p->crack, p->index); });
  return own;
}

/// The row of a crack's first point: in 3D points are numbered through, and lie in the order of cracks and numbers.
std::vector<std::int64_t> first_rows(const std::vector<Crack>& cracks) {
  std::vector<std::int64_t> first = {0};
  for (const Crack& crack : cracks) first.push_back(first.back() + crack.ends[1] + 1);
  return first;
}

template <int Dim>
RowBlocks rows_of_points(const Simulation<Dim>& simulation, const std::vector<const CrackPoint<Dim>*>& own) {
  if constexpr (Dim == 2)
    return patch_rows(
        simulation, [](const Patch<Dim>& patch) { return std::ranges::count_if(patch.cracks, &CrackPoint<Dim>::own); });
  const auto first = first_rows(simulation.cracks());
  RowBlocks rows{{}, first.back()};
  for (const auto* point : own) rows.blocks.push_back({first[point->crack] + point->index, 1});
  return rows;
}

/// Corners of the triangles that own points hold, as rows of points, in patch order.
struct TriangleTable {
  RowBlocks rows;
  std::vector<std::int64_t> corners;

  explicit TriangleTable(const Simulation<3>& simulation) {
    const auto first = first_rows(simulation.cracks());
    rows = patch_rows(simulation, [](const Patch<3>& patch) {
      std::int64_t count = 0;
      for (const auto& point : patch.cracks) count += point.own ? point.held : 0;
      return count;
    });
    for (const auto& patch : simulation.patches())
      for (const auto& point : patch.cracks)
        for (int t = 0; point.own && t < point.held; ++t)
          for (const int corner : {point.index, point.triangles[t].second, point.triangles[t].third})
            corners.push_back(first[point.crack] + corner);
  }
};

}  // namespace

template <int Dim>
void write_cracks(const Simulation<Dim>& simulation, const std::filesystem::path& file) {
  Columns columns;
  auto& position = columns.add_doubles("position", 3);
  auto& lower = columns.add_doubles("lower", 3);
  auto& upper = columns.add_doubles("upper", 3);
  auto& opening = columns.add_doubles("opening", 3);
  auto& crack = columns.add_ints("crack", 1);
  auto& index = columns.add_ints("index", 1);
  auto& image = columns.add_ints("image", 3);
  auto& bond = columns.add_ints("bond", 1);
  auto& parted = columns.add_ints("parted", 1);
  auto& traction = columns.add_doubles("traction", 3);
  auto& length = columns.add_doubles(Dim == 3 ? "area" : "length", 1);
  auto& stored = columns.add_doubles("stored", 1);
  auto& dissipated = columns.add_doubles("dissipated", 1);
  const auto own = own_points(simulation);
  for (const CrackPoint<Dim>* point : own) {
    const CrackPoint<Dim>& p = *point;
    append(position, padded<Dim>(p.plane));
    append(lower, padded<Dim>(p.lower)), append(upper, padded<Dim>(p.upper));
    append(opening, padded<Dim>(p.opening()));
    crack.push_back(p.crack), index.push_back(p.index);
    for (int d = 0; d < 3; ++d) image.push_back(d < Dim ? p.image[d] : 0);
    const auto energies = simulation.energies_of(p);
    parted.push_back(simulation.cracks()[p.crack].idle);
    bond.push_back(p.bond.state), length.push_back(p.bond.length), append(traction, padded<Dim>(p.traction));
    stored.push_back(energies[0]), dissipated.push_back(energies[1]);
  }
  const RowBlocks rows = rows_of_points(simulation, own);
  const auto write = [&](const TriangleCells* cells) {
    write_vtkhdf(file, simulation.communicator(), rows, columns.view(), simulation.time(), simulation.steps(),
                 "crack points", cells);
  };
  if constexpr (Dim == 2) {
    write(nullptr);
  } else {
    const TriangleTable table(simulation);
    const TriangleCells cells{table.rows, table.corners};
    write(&cells);
  }
}

template <int Dim>
void write_tips(Simulation<Dim>& simulation, const std::filesystem::path& file) {
  const auto states = simulation.tip_states();
  int rank = 0;
  MPI_Comm_rank(simulation.communicator(), &rank);
  Columns columns;
  auto& position = columns.add_doubles("position", 3);
  auto& ahead = columns.add_doubles("ahead", 3);
  auto& crack = columns.add_ints("crack", 1);
  auto& end = columns.add_ints(Dim == 3 ? "index" : "end", 1);
  std::vector<std::vector<double>*> numbers;
  for (const char* name : {"J", "J_static", "K_I", "K_II"}) numbers.push_back(&columns.add_doubles(name, 1));
  std::vector<double>* normal = nullptr;
  if (Dim == 3) numbers.push_back(&columns.add_doubles("K_III", 1)), normal = &columns.add_doubles("normal", 3);
  RowBlocks rows{{}, std::ssize(states)};
  if (rank == 0 && !states.empty()) rows.blocks.push_back({0, rows.total_rows});
  for (const TipState<Dim>& s : states) {
    if (rank != 0) break;
    append(position, padded<Dim>(s.tip.position)), append(ahead, padded<Dim>(s.tip.ahead));
    if (Dim == 3) append(*normal, padded<Dim>(s.tip.normal));
    crack.push_back(s.tip.crack), end.push_back(s.tip.end);
    const double values[] = {s.J, s.J_static, s.K_opening, s.K_sliding, s.K_tearing};
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i]->push_back(values[i]);
  }
  write_vtkhdf(file, simulation.communicator(), rows, columns.view(), simulation.time(), simulation.steps(),
               "tips of cracks");
}

#define CAIRN_INSTANTIATE(Dim)                                                      \
  template void write_cracks(const Simulation<Dim>&, const std::filesystem::path&); \
  template void write_tips(Simulation<Dim>&, const std::filesystem::path&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
