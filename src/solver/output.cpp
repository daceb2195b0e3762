#include "cairn/solver/output.hpp"

#include <numeric>

#include "cairn/body/deformation.hpp"
#include "cairn/solver/body_states.hpp"
#include "columns.hpp"

namespace cairn {
namespace {

constexpr std::string_view smooth_stress_field = "stress_smooth";

template <int Dim>
RowBlocks point_rows(const Simulation<Dim>& simulation) {
  return patch_rows(simulation, [](const Patch<Dim>& patch) { return patch.point_count(); });
}

/// Rows of a table of which each rank holds a consecutive part. Collective.
RowBlocks consecutive_rows(std::int64_t count, MPI_Comm comm) {
  RowBlocks rows;
  std::int64_t before = 0;
  MPI_Exscan(&count, &before, 1, MPI_INT64_T, MPI_SUM, comm);
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  if (rank == 0) before = 0;
  if (count > 0) rows.blocks.push_back({before, count});
  MPI_Allreduce(&count, &rows.total_rows, 1, MPI_INT64_T, MPI_SUM, comm);
  return rows;
}

/// Columns of the points, made patch by patch as they are written.
template <int Dim>
class PointTable {
 public:
  using C = PointColumns<Dim>;
  explicit PointTable(const Simulation<Dim>& simulation) : simulation_(simulation) {
    for (const auto& patch : simulation.patches())
      if (patch.point_count() > 0) filled_.push_back(&patch);
  }

  void add(const std::string& field) {
    using P = Points<Dim>;
    if (field == "position")
      add_points(field, 3, [](const P& points, int p, int c) { return c < Dim ? points.column(c)[p] : 0.0; });
    else if (field == "velocity")
      add_points(field, 3,
                 [](const P& points, int p, int c) { return c < Dim ? points.column(C::velocity + c)[p] : 0.0; });
    else if (field == "spin")
      add_points(field, 3, [](const P& points, int p, int c) {
        return Dim == 3 ? points.column(C::spin + c % spin_size<Dim>)[p] : c == 2 ? points.column(C::spin)[p] : 0.0;
      });
    else if (field == "stress")
      add_points(field, 6, [](const P& points, int p, int c) {
        return c < symmetric_size<Dim> ? points.column(C::stress + c)[p] : 0.0;
      });
    else if (field == smooth_stress_field)
      add_smooth_stress();
    else if (field == "deformation_gradient")
      add_points(field, 9, [](const P& points, int p, int c) {
        if (Dim == 2 && c != 8 && (c % 3 == 2 || c / 3 == 2)) return 0.0;
        return points.column(C::deformation + tensor_index<Dim>(c / 3, c % 3))[p];
      });
    else if (field == "volume")
      add_points(field, 1, [](const P& points, int p, int) { return volume(points, p); });
    else if (field == "id")
      add_points<std::int64_t>(field, 1, [](const P& points, int p, int) { return points.ids()[p]; });
    else if (field == "image")
      add_points<std::int32_t>(field, 3, [](const P& points, int p, int c) { return points.images()[p][c]; });
    else if (field == "body")
      add_pieces<std::int32_t>(field, 1, [](const Piece<Dim>& piece, int, int) { return piece.body; });
    else if (field == "mass")
      add_pieces<double>(field, 1, [this](const Piece<Dim>& piece, int p, int) {
        return piece.points.column(C::volume)[p] * simulation_.material_of(piece).density;
      });
    else
      add_state(field);
  }

  std::span<const Column> view() const { return columns_; }

 private:
  /// A column with value(piece)(point, component).
  template <class T, class F>
  void add_column(const std::string& name, int components, const F& value) {
    columns_.push_back({name, components, BlockSource<T>([this, components, value](std::size_t block) {
                          auto& out = std::get<std::vector<T>>(buffers_);
                          const Patch<Dim>& patch = *filled_[block];
                          out.resize(static_cast<std::size_t>(patch.point_count() * components));
                          T* next = out.data();
                          for (const auto& piece : patch.pieces) {
                            const auto of_piece = value(piece);
                            for (int p = 0; p < piece.points.size(); ++p)
                              for (int c = 0; c < components; ++c) *next++ = of_piece(p, c);
                          }
                          return std::span<const T>(out);
                        })});
  }
  /// A column with value(piece, point, component).
  template <class T, class F>
  void add_pieces(const std::string& name, int components, const F& value) {
    add_column<T>(name, components, [value](const Piece<Dim>& piece) {
      return [&piece, value](int p, int c) { return value(piece, p, c); };
    });
  }
  void add_smooth_stress() {
    add_column<double>(std::string(smooth_stress_field), 6, [this](const Piece<Dim>& piece) {
      return [smooth = smooth_stress(piece, simulation_.lattice(), simulation_.transfer())](int p, int c) {
        return c < symmetric_size<Dim> ? smooth[p][c] : 0.0;
      };
    });
  }
  /// A column with value(points, point, component).
  template <class T = double, class F>
  void add_points(const std::string& name, int components, const F& value) {
    add_pieces<T>(name, components,
                  [value](const Piece<Dim>& piece, int p, int c) { return value(piece.points, p, c); });
  }
  static double volume(const Points<Dim>& points, int p) {
    return points.column(C::volume)[p] * volume_ratio(points, p);
  }
  /// A variable of the laws; zero for points whose law has none of that name.
  void add_state(const std::string& name) {
    std::vector<int> column;  // for each material, or -1
    for (const SolverMaterial& material : simulation_.materials()) {
      const auto& names = material.state_names;
      const auto at = std::find(names.begin(), names.end(), name);
      column.push_back(at == names.end() ? -1 : C::state + static_cast<int>(at - names.begin()));
    }
    add_pieces<double>(name, 1, [this, column](const Piece<Dim>& piece, int p, int) {
      const int c = column[simulation_.bodies()[piece.body].material];
      return c < 0 ? 0.0 : piece.points.column(c)[p];
    });
  }

  const Simulation<Dim>& simulation_;
  std::vector<const Patch<Dim>*> filled_;  // those with points: blocks of rows
  std::vector<Column> columns_;
  std::tuple<std::vector<double>, std::vector<std::int32_t>, std::vector<std::int64_t>> buffers_;
};

}  // namespace

template <int Dim>
void write_particles(Simulation<Dim>& simulation, const std::filesystem::path& file,
                     const std::vector<std::string>& fields) {
  if (std::ranges::find(fields, smooth_stress_field) != fields.end()) simulation.project_stress();
  PointTable<Dim> table(simulation);
  table.add("position");
  for (const auto& field : fields)
    if (field != "position") table.add(field);
  write_vtkhdf(file, simulation.communicator(), point_rows(simulation), table.view(), simulation.time(),
               simulation.steps());
}

template <int Dim>
void write_grains(const Simulation<Dim>& simulation, const std::filesystem::path& file) {
  const auto states = body_states(simulation);
  Columns columns;
  auto& position = columns.add_doubles("position", 3);
  auto& body = columns.add_ints("body", 1);
  auto& material = columns.add_ints("material", 1);
  auto& points = columns.add_ints("points", 1);
  auto& mass = columns.add_doubles("mass", 1);
  auto& centre = columns.add_doubles("centre", 3);
  auto& velocity = columns.add_doubles("velocity", 3);
  auto& spin = columns.add_doubles("angular_velocity", 3);
  auto& stress = columns.add_doubles("mean_stress", 6);
  auto& contacts = columns.add_ints("contact_count", 1);
  auto& volume = columns.add_doubles("volume", 1);
  auto& second_moment = columns.add_doubles("second_moment", 6);
  for (const BodyState& s : states) {
    append(position, s.centre), append(centre, s.centre), append(velocity, s.velocity),
        append(spin, s.angular_velocity);
    body.push_back(s.body), material.push_back(simulation.bodies()[s.body].material), contacts.push_back(s.contacts);
    mass.push_back(s.mass), points.push_back(s.points), volume.push_back(s.volume);
    second_moment.insert(second_moment.end(), s.second_moment.begin(), s.second_moment.end());
    stress.insert(stress.end(), s.mean_stress.begin(), s.mean_stress.end());
  }
  const RowBlocks rows = consecutive_rows(static_cast<std::int64_t>(states.size()), simulation.communicator());
  write_vtkhdf(file, simulation.communicator(), rows, columns.view(), simulation.time(), simulation.steps(), "bodies");
}

template <int Dim>
void write_contacts(const Simulation<Dim>& simulation, const std::filesystem::path& file, double duration) {
  const auto states = contact_states(simulation, duration);
  Columns columns;
  auto& position = columns.add_doubles("position", 3);
  auto& body_a = columns.add_ints("body_a", 1);
  auto& body_b = columns.add_ints("body_b", 1);
  auto& point = columns.add_doubles("point", 3);
  auto& normal = columns.add_doubles("normal", 3);
  auto& force = columns.add_doubles("force", 3);
  auto& moment = columns.add_doubles("moment", 9);
  auto& slip = columns.add_doubles("slip", 1);
  auto& friction = columns.add_doubles("friction_work", 1);
  auto& sticking = columns.add_doubles("sticking", 1);
  for (const ContactState& s : states) {
    body_a.push_back(s.body_a), body_b.push_back(s.body_b);
    append(position, s.point), append(point, s.point), append(normal, s.normal), append(force, s.force);
    for (int i = 0; i < 9; ++i) moment.push_back(s.moment(i / 3, i % 3));
    slip.push_back(s.slip), friction.push_back(s.friction_work), sticking.push_back(s.sticking);
  }
  const RowBlocks rows = consecutive_rows(static_cast<std::int64_t>(states.size()), simulation.communicator());
  write_vtkhdf(file, simulation.communicator(), rows, columns.view(), simulation.time(), simulation.steps(),
               "contacts");
}

#define CAIRN_INSTANTIATE(Dim)                                                                                    \
  template void write_particles(Simulation<Dim>&, const std::filesystem::path&, const std::vector<std::string>&); \
  template void write_grains(const Simulation<Dim>&, const std::filesystem::path&);                               \
  template void write_contacts(const Simulation<Dim>&, const std::filesystem::path&, double);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
