#include "cairn/solver/output.hpp"

#include <deque>

#include "cairn/io/table_file.hpp"
#include "cairn/solver/body_states.hpp"

namespace cairn {
namespace {

/// Columns under construction; keeps their numbers alive until the file is written.
class Columns {
 public:
  std::vector<double>& add_doubles(const std::string& name, int components) { return add(name, components, doubles_); }
  std::vector<std::int32_t>& add_ints(const std::string& name, int components) { return add(name, components, ints_); }
  std::vector<std::int64_t>& add_longs(const std::string& name, int components) {
    return add(name, components, longs_);
  }

  std::vector<Column> view() const {
    std::vector<Column> columns;
    for (const auto& [name, components, values] : columns_)
      std::visit(
          [&, &name = name, &components = components](const auto* list) {
            columns.push_back({name, components, std::span(*list)});
          },
          values);
    return columns;
  }

 private:
  template <class T>
  std::vector<T>& add(const std::string& name, int components, std::deque<std::vector<T>>& store) {
    store.emplace_back();
    columns_.emplace_back(name, components, &store.back());
    return store.back();
  }
  using Values =
      std::variant<const std::vector<double>*, const std::vector<std::int32_t>*, const std::vector<std::int64_t>*>;
  std::deque<std::vector<double>> doubles_;
  std::deque<std::vector<std::int32_t>> ints_;
  std::deque<std::vector<std::int64_t>> longs_;
  std::vector<std::tuple<std::string, int, Values>> columns_;
};

/// Rows of the points of this rank's patches: in the file they lie in patch order. Collective.
template <int Dim>
RowBlocks point_rows(const Simulation<Dim>& simulation) {
  std::vector<std::int64_t> counts(simulation.lattice().patch_count(), 0);
  for (const auto& patch : simulation.patches()) counts[patch.id] = patch.point_count();
  MPI_Allreduce(MPI_IN_PLACE, counts.data(), static_cast<int>(counts.size()), MPI_INT64_T, MPI_SUM,
                simulation.communicator());
  RowBlocks rows;
  auto patch = simulation.patches().begin();
  for (int id = 0; id < simulation.lattice().patch_count(); rows.total_rows += counts[id], ++id)
    if (patch != simulation.patches().end() && patch->id == id) {
      if (counts[id] > 0) rows.blocks.push_back({rows.total_rows, counts[id]});
      ++patch;
    }
  return rows;
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

template <int Dim>
class PointTable {
 public:
  using C = PointColumns<Dim>;
  explicit PointTable(const Simulation<Dim>& simulation) : simulation_(simulation) {}

  void add(const std::string& field) {
    if (field == "position")
      add_columns(field, 3, [](auto& points, int p, int c) { return c < Dim ? points.column(c)[p] : 0.0; });
    else if (field == "velocity")
      add_columns(field, 3,
                  [](auto& points, int p, int c) { return c < Dim ? points.column(C::velocity + c)[p] : 0.0; });
    else if (field == "spin")
      add_columns(field, 3, [](auto& points, int p, int c) {
        return Dim == 3 ? points.column(C::spin + c % spin_size<Dim>)[p] : c == 2 ? points.column(C::spin)[p] : 0.0;
      });
    else if (field == "stress")
      add_columns(field, 6, [](auto& points, int p, int c) {
        return c < symmetric_size<Dim> ? points.column(C::stress + c)[p] : 0.0;
      });
    else if (field == "deformation_gradient")
      add_columns(field, 9, [](auto& points, int p, int c) {
        if (Dim == 2 && c != 8 && (c % 3 == 2 || c / 3 == 2)) return 0.0;
        return points.column(C::deformation + tensor_index<Dim>(c / 3, c % 3))[p];
      });
    else if (field == "volume")
      add_piecewise(field, [](auto& piece, double) { return volumes(piece.points); });
    else if (field == "mass")
      add_piecewise(field, [](auto& piece, double density) {
        std::vector<double> m(piece.points.column(C::volume), piece.points.column(C::volume) + piece.points.size());
        for (double& value : m) value *= density;
        return m;
      });
    else if (field == "body")
      add_body();
    else if (field == "id")
      add_id();
    else if (field == "image")
      add_image();
    else
      add_state(field);
  }

  std::vector<Column> view() const { return columns_.view(); }

 private:
  template <class F>
  void for_pieces(F&& f) const {
    for (const auto& patch : simulation_.patches())
      for (const auto& piece : patch.pieces) f(piece);
  }
  template <class F>
  void add_columns(const std::string& name, int components, F&& value) {
    auto& out = columns_.add_doubles(name, components);
    out.reserve(count() * components);
    for_pieces([&](const Piece<Dim>& piece) {
      for (int p = 0; p < piece.points.size(); ++p)
        for (int c = 0; c < components; ++c) out.push_back(value(piece.points, p, c));
    });
  }
  template <class F>
  void add_piecewise(const std::string& name, F&& values) {
    auto& out = columns_.add_doubles(name, 1);
    out.reserve(count());
    for_pieces([&](const Piece<Dim>& piece) {
      const std::vector<double> v = values(piece, simulation_.material_of(piece).density);
      out.insert(out.end(), v.begin(), v.end());
    });
  }
  std::size_t count() const {
    std::size_t n = 0;
    for (const auto& patch : simulation_.patches()) n += static_cast<std::size_t>(patch.point_count());
    return n;
  }
  static std::vector<double> volumes(const Points<Dim>& points) {
    std::vector<double> v(points.size());
    for (int p = 0; p < points.size(); ++p) {
      Tensor<Dim, double> F;
      for (int i = 0; i < tensor_size<Dim>; ++i) F.c[i] = points.column(C::deformation + i)[p];
      v[p] = points.column(C::volume)[p] * determinant(F);
    }
    return v;
  }
  void add_body() {
    auto& out = columns_.add_ints("body", 1);
    out.reserve(count());
    for_pieces([&](const Piece<Dim>& piece) { out.insert(out.end(), piece.points.size(), piece.body); });
  }
  void add_id() {
    auto& out = columns_.add_longs("id", 1);
    out.reserve(count());
    for_pieces(
        [&](const Piece<Dim>& piece) { out.insert(out.end(), piece.points.ids().begin(), piece.points.ids().end()); });
  }
  void add_image() {
    auto& out = columns_.add_ints("image", 3);
    out.reserve(3 * count());
    for_pieces([&](const Piece<Dim>& piece) {
      for (const Image& image : piece.points.images()) out.insert(out.end(), image.begin(), image.begin() + 3);
    });
  }
  /// A variable of the laws; zero for points whose law has none of that name.
  void add_state(const std::string& name) {
    auto& out = columns_.add_doubles(name, 1);
    for_pieces([&](const Piece<Dim>& piece) {
      const auto& names = simulation_.material_of(piece).state_names;
      const auto at = std::find(names.begin(), names.end(), name);
      const int c = C::state + static_cast<int>(at - names.begin());
      for (int p = 0; p < piece.points.size(); ++p) out.push_back(at == names.end() ? 0.0 : piece.points.column(c)[p]);
    });
  }

  const Simulation<Dim>& simulation_;
  Columns columns_;
};

void append(std::vector<double>& out, const Vec3& v) { out.insert(out.end(), v.data(), v.data() + 3); }

}  // namespace

template <int Dim>
void write_particles(const Simulation<Dim>& simulation, const std::filesystem::path& file,
                     const std::vector<std::string>& fields) {
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
  auto& mass = columns.add_doubles("mass", 1);
  auto& centre = columns.add_doubles("centre", 3);
  auto& velocity = columns.add_doubles("velocity", 3);
  auto& spin = columns.add_doubles("angular_velocity", 3);
  auto& stress = columns.add_doubles("mean_stress", 6);
  auto& contacts = columns.add_ints("contact_count", 1);
  for (const BodyState& s : states) {
    append(position, s.centre), append(centre, s.centre), append(velocity, s.velocity),
        append(spin, s.angular_velocity);
    body.push_back(s.body), material.push_back(simulation.bodies()[s.body].material), contacts.push_back(s.contacts);
    mass.push_back(s.mass);
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
  for (const ContactState& s : states) {
    body_a.push_back(s.body_a), body_b.push_back(s.body_b);
    append(position, s.point), append(point, s.point), append(normal, s.normal), append(force, s.force);
  }
  const RowBlocks rows = consecutive_rows(static_cast<std::int64_t>(states.size()), simulation.communicator());
  write_vtkhdf(file, simulation.communicator(), rows, columns.view(), simulation.time(), simulation.steps(),
               "contacts");
}

#define CAIRN_INSTANTIATE(Dim)                                                        \
  template void write_particles(const Simulation<Dim>&, const std::filesystem::path&, \
                                const std::vector<std::string>&);                     \
  template void write_grains(const Simulation<Dim>&, const std::filesystem::path&);   \
  template void write_contacts(const Simulation<Dim>&, const std::filesystem::path&, double);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
