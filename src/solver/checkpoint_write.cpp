#include <algorithm>
#include <bit>
#include <numeric>
#include <type_traits>

#include "cairn/io/checksum.hpp"
#include "cairn/solver/checkpoint.hpp"
#include "checkpoint_checks.hpp"
#include "checkpoint_columns.hpp"

namespace cairn {

namespace {

using namespace checkpoint;

/// Writes columns in patch order and gathers the checksum of each patch's part of them.
template <int Dim>
class ColumnWriter {
 public:
  ColumnWriter(CheckpointWriter& writer, const std::vector<const Patch<Dim>*>& patches, const Layout& layout)
      : writer_(writer), patches_(patches), layout_(layout), one_each_(layout.one_each()), sums_(patches.size()) {}

  /// `counts`: rows of every patch of the layout; `values`: of this rank's patches.
  template <class T>
  void write(const std::string& name, int components, const Counts& counts, const std::vector<T>& values) {
    const std::span<const T> all(values);
    writer_.write({name, components, all}, layout_.rows_of(counts));
    std::size_t at = 0;
    for (std::size_t p = 0; p < sums_.size(); ++p) {
      const auto size = static_cast<std::size_t>(counts[layout_.here[p]] * components);
      sums_[p].push_back(std::bit_cast<std::int64_t>(checksum(all.subspan(at, size))));
      at += size;
    }
    ++columns_;
  }

  /// Writes one number of every patch.
  template <class T, class F>
  void write_patches(const std::string& name, F&& value_of) {
    std::vector<T> values;
    for (const auto* patch : patches_) values.push_back(value_of(*patch));
    write(name, 1, one_each_, values);
  }

  void write_checksums() {
    std::vector<std::int64_t> all;
    for (const auto& sums : sums_) all.insert(all.end(), sums.begin(), sums.end());
    writer_.write({checksums_name, columns_, std::span<const std::int64_t>(all)}, layout_.rows_of(one_each_));
  }

 private:
  CheckpointWriter& writer_;
  const std::vector<const Patch<Dim>*>& patches_;
  const Layout& layout_;
  Counts one_each_;                              // rows of tables with one row for each patch
  std::vector<std::vector<std::int64_t>> sums_;  // for each patch, of each column
  int columns_ = 0;
};

/// Patches that are not blank, with their points, pieces with points and contacts. Collective.
template <int Dim>
Layout layout_of(const Simulation<Dim>& simulation) {
  const PatchTable<Dim>& table = simulation.table();
  enum { present, points, pieces, contacts, tools, numbers };
  Counts counts(table.size() * numbers, 0);
  for (const auto& patch : simulation.patches()) {
    if (patch.blank()) continue;
    std::int64_t* count = &counts[table.find(patch.id) * numbers];
    count[present] = 1, count[contacts] = std::ssize(patch.contacts), count[tools] = std::ssize(patch.tools);
    for_filled(patch, [&](const Piece<Dim>& piece) { count[points] += piece.points.size(), ++count[pieces]; });
  }
  MPI_Allreduce(MPI_IN_PLACE, counts.data(), static_cast<int>(counts.size()), MPI_INT64_T, MPI_SUM,
                simulation.communicator());
  Layout layout;
  for (std::size_t p = 0; p < table.size(); ++p) {
    const std::int64_t* count = &counts[p * numbers];
    if (!count[present]) continue;
    layout.patches.push_back(table.patches()[p]);
    layout.points.push_back(count[points]), layout.pieces.push_back(count[pieces]);
    layout.contacts.push_back(count[contacts]), layout.tools.push_back(count[tools]);
  }
  if (simulation.cracks().empty()) return layout;
  layout.cracks.assign(layout.patches.size(), 0);
  for (const auto& patch : simulation.patches()) {
    const auto at = std::ranges::lower_bound(layout.patches, patch.id);
    if (at != layout.patches.end() && *at == patch.id)
      layout.cracks[at - layout.patches.begin()] = std::ranges::count_if(patch.cracks, &CrackPoint<Dim>::own);
  }
  MPI_Allreduce(MPI_IN_PLACE, layout.cracks.data(), static_cast<int>(layout.cracks.size()), MPI_INT64_T, MPI_SUM,
                simulation.communicator());
  return layout;
}

template <int Dim>
using PatchList = std::vector<const Patch<Dim>*>;

/// Writes how many rows of some table every patch has.
template <int Dim>
void write_counts(ColumnWriter<Dim>& out, const Layout& layout, const char* name, const Counts& counts) {
  std::vector<std::int64_t> mine;
  for (const std::size_t place : layout.here) mine.push_back(counts[place]);
  out.write(name, 1, layout.one_each(), mine);
}

template <int Dim>
void write_patches(ColumnWriter<Dim>& out, const PatchList<Dim>& patches, const Layout& layout) {
  using P = Patch<Dim>;
  out.template write_patches<std::int64_t>("patch_id", [](const P& p) { return p.id; });
  write_counts(out, layout, "patch_points", layout.points), write_counts(out, layout, "patch_pieces", layout.pieces);
  write_counts(out, layout, "patch_contacts", layout.contacts), write_counts(out, layout, "patch_tools", layout.tools);
  for (const auto& column : ledger_columns)
    out.template write_patches<double>(column.name, [&](const P& p) { return p.ledger.*column.value; });

  std::vector<std::int32_t> body, states, pairs, tools;
  std::vector<std::int64_t> count;
  std::vector<double> sums, pressed;
  for (const P* patch : patches) {
    for_filled(*patch, [&](const Piece<Dim>& piece) {
      body.push_back(piece.body), count.push_back(piece.points.size());
      states.push_back(piece.points.columns() - PointColumns<Dim>::state);
    });
    for (const auto& [pair, sum] : patch->contacts) {
      pairs.push_back(pair.first), pairs.push_back(pair.second);
      sums.insert(sums.end(), sum.values.begin(), sum.values.end());
    }
    for (const auto& [tool, sum] : patch->tools) {
      tools.push_back(tool);
      pressed.insert(pressed.end(), sum.total.begin(), sum.total.end());
    }
  }
  out.write("piece_body", 1, layout.pieces, body);
  out.write("piece_points", 1, layout.pieces, count);
  out.write("piece_states", 1, layout.pieces, states);
  out.write("contact_bodies", 2, layout.contacts, pairs);
  out.write("contact_sums", ContactSum<Dim>::size, layout.contacts, sums);
  out.write("tool_number", 1, layout.tools, tools);
  out.write("tool_sums", ToolSum::size, layout.tools, pressed);
}

/// One quantity at a time, so that little memory is needed beside the points.
template <int Dim>
void write_points(ColumnWriter<Dim>& out, const PatchList<Dim>& patches, const Layout& layout, int states) {
  std::vector<std::int64_t> ids;
  std::vector<std::int32_t> images;
  for (const auto* patch : patches)
    for_filled(*patch, [&](const Piece<Dim>& piece) {
      ids.insert(ids.end(), piece.points.ids().begin(), piece.points.ids().end());
      for (const Image& image : piece.points.images())
        images.insert(images.end(), image.begin(), image.begin() + image_components);
    });
  out.write("id", 1, layout.points, ids);
  out.write("image", image_components, layout.points, images);
  for (const Quantity& q : quantities<Dim>(states)) {
    std::vector<double> values(ids.size() * static_cast<std::size_t>(q.components), 0.0);
    double* to = values.data();
    for (const auto* patch : patches)
      for_filled(*patch, [&](const Piece<Dim>& piece) {
        const Points<Dim>& points = piece.points;
        const int components = std::min(q.components, points.columns() - q.first);
        for (int c = 0; c < components; ++c)
          for (int p = 0; p < points.size(); ++p)
            to[static_cast<std::ptrdiff_t>(p) * q.components + c] = points.column(q.first + c)[p];
        to += static_cast<std::ptrdiff_t>(points.size()) * q.components;
      });
    out.write(q.name, q.components, layout.points, values);
  }
}

template <int Dim>
void write_cracks(ColumnWriter<Dim>& out, const PatchList<Dim>& patches, const Layout& layout) {
  if (layout.cracks.empty()) return;
  std::vector<std::int32_t> numbers;
  std::vector<double> values;
  const auto for_own = [&](auto&& f) {
    for (const auto* patch : patches)
      for (const auto& point : patch->cracks)
        if (point.own) f(point);
  };
  for_own([&](const CrackPoint<Dim>& p) {
    numbers.insert(numbers.end(), {p.crack, p.index, p.next, p.filled, p.faces_filled, p.bond.state, p.image[0],
                                   p.image[1], p.image[2]});
    values.insert(values.end(), {p.bond.length, p.bond.peak[0], p.bond.peak[1], p.bond.dissipated});
  });
  write_counts(out, layout, patch_cracks_name, layout.cracks);
  out.write("crack_numbers", crack_numbers, layout.cracks, numbers);
  out.write("crack_bonds", bond_numbers, layout.cracks, values);
  if constexpr (Dim == 3) {
    numbers.clear();
    for_own([&](const CrackPoint<3>& p) {
      numbers.insert(numbers.end(), {p.tip, p.held});
      for (const CrackTriangle& t : p.triangles) numbers.insert(numbers.end(), {t.second, t.third, t.edges});
    });
    out.write("crack_triangles", held_numbers, layout.cracks, numbers);
  }
  for (const auto& vector : crack_vectors<Dim>) {
    values.clear();
    for_own([&](const CrackPoint<Dim>& p) {
      const Vec<Dim>& v = p.*vector.value;
      values.insert(values.end(), v.data(), v.data() + Dim);
    });
    out.write(vector.name, Dim, layout.cracks, values);
  }
}

/// A table that every rank knows and rank 0 writes.
void write_on_first(CheckpointWriter& writer, const char* name, int components, const std::vector<double>& values,
                    MPI_Comm comm) {
  RowBlocks rows{{}, std::ssize(values) / components};
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  if (rank == 0 && !values.empty()) rows.blocks.push_back({0, rows.total_rows});
  writer.write({name, components, std::span<const double>(values).first(rank == 0 ? values.size() : 0)}, rows);
}

void write_state(CheckpointWriter& writer, const RunState& state, MPI_Comm comm) {
  for_each_number(state, [&]<class T>(const std::string& name, const T& value) {
    if constexpr (std::is_same_v<T, std::uint64_t>)
      writer.add(name, std::bit_cast<std::int64_t>(value));
    else
      writer.add(name, value);
  });
  std::vector<double> times;
  std::string names;
  for (const auto& entry : state.series) times.push_back(entry.time), names += entry.name + "\n";
  write_on_first(writer, "series_time", 1, times, comm);
  write_on_first(writer, "stage_state", 1, state.stage, comm);
  write_on_first(writer, "pouring_state", 1, state.pouring, comm);
  write_on_first(writer, "tool_state", tool_state_size, state.tools, comm);
  write_on_first(writer, "crack_state", Crack::state_size, state.cracks, comm);
  write_on_first(writer, "part_of", 1, state.parts, comm);
  write_on_first(writer, "crack_spared", 2, state.spared, comm);
  writer.add_text("series_names", names);
}

/// Bytes of all columns, a little more than they are.
template <int Dim>
std::int64_t bytes_of(const Layout& layout, int states, std::size_t texts) {
  const auto sum = [](const Counts& counts) { return std::accumulate(counts.begin(), counts.end(), std::int64_t{0}); };
  constexpr std::int64_t point = 8 + 4 * image_components, piece = 16, patch = 8 * 50;
  return sum(layout.points) * (point + 8 * (PointColumns<Dim>::state + states)) + sum(layout.pieces) * piece +
         sum(layout.contacts) * (8 + 8 * ContactSum<Dim>::size) + sum(layout.tools) * (4 + 8 * ToolSum::size) +
         std::ssize(layout.points) * patch + static_cast<std::int64_t>(texts);
}

}  // namespace

template <int Dim>
void write_checkpoint(const std::filesystem::path& file, const Simulation<Dim>& simulation, const RunState& state,
                      const std::string& case_text) {
  const MPI_Comm comm = simulation.communicator();
  Layout layout = layout_of(simulation);
  const PatchList<Dim> patches = layout.find(simulation.patches());
  const int states = most_states(simulation.materials());
  const std::int64_t bytes = bytes_of<Dim>(layout, states, case_text.size() + 64 * state.series.size());
  const std::int64_t points = std::accumulate(layout.points.begin(), layout.points.end(), std::int64_t{0});
  CheckpointWriter writer(file, comm, bytes, points, state.step.time, state.step.steps);
  writer.add("dimension", std::int64_t{Dim});
  writer.add("patches", simulation.lattice().patch_count());
  write_state(writer, state, comm);
  writer.add_text("case", case_text);
  writer.add(numbers_checksum_name, std::bit_cast<std::int64_t>(checksum_of(state, case_text)));
  ColumnWriter<Dim> out(writer, patches, layout);
  write_patches(out, patches, layout);
  write_points(out, patches, layout, states);
  write_cracks(out, patches, layout);
  out.write_checksums();
  writer.finish();
}

template void write_checkpoint(const std::filesystem::path&, const Simulation<2>&, const RunState&, const std::string&);
template void write_checkpoint(const std::filesystem::path&, const Simulation<3>&, const RunState&, const std::string&);

}  // namespace cairn
