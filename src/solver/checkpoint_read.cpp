#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <sstream>
#include <type_traits>

#include "cairn/io/checksum.hpp"
#include "cairn/solver/checkpoint.hpp"
#include "checkpoint_checks.hpp"
#include "checkpoint_columns.hpp"

namespace cairn {

namespace {

using namespace checkpoint;

/// This rank's patches that the checkpoint holds.
template <int Dim>
using PatchList = std::vector<Patch<Dim>*>;

/// Reads columns in the order in which they were written and compares each patch's part with its checksum. What is
/// wrong on this rank is kept until `settle`, so that all ranks stay together.
template <int Dim>
class ColumnReader {
 public:
  ColumnReader(const CheckpointReader& reader, const PatchList<Dim>& patches, const Layout& layout, int columns)
      : reader_(reader), patches_(patches), layout_(layout), one_each_(layout.one_each()), columns_(columns) {
    const RowBlocks rows = layout_.rows_of(one_each_);
    sums_.resize(patches_.size() * static_cast<std::size_t>(columns_));
    reader_.table().read(checksums_name, columns_, rows, std::span(sums_));
  }

  template <class T>
  std::vector<T> read(const std::string& name, int components, const Counts& counts) {
    const RowBlocks rows = layout_.rows_of(counts);
    reader_.require(reader_.rows_of(name) == rows.total_rows
                        ? ""
                        : fmt::format("its column {} does not have the {} rows of its patches", name, rows.total_rows));
    std::vector<T> values(static_cast<std::size_t>(rows.local_rows() * components));
    reader_.table().read(name, components, rows, std::span(values));
    std::size_t at = 0;
    for (std::size_t p = 0; p < patches_.size(); ++p) {
      const auto size = static_cast<std::size_t>(counts[layout_.here[p]] * components);
      const std::uint64_t sum = checksum(std::span<const T>(values).subspan(at, size));
      if (std::bit_cast<std::int64_t>(sum) != sums_[p * columns_ + column_])
        require(false,
                fmt::format("damaged: column {} of patch {} does not match its checksum", name, patches_[p]->id));
      at += size;
    }
    ++column_;
    return values;
  }
  template <class T>
  std::vector<T> read_patches(const std::string& name) {
    return read<T>(name, 1, one_each_);
  }

  void require(bool good, const std::string& problem) {
    if (!good && problem_.empty()) problem_ = problem;
  }
  /// \throws InputError on every rank if anything was wrong on any
  void settle() const { reader_.require(problem_); }

 private:
  const CheckpointReader& reader_;
  const PatchList<Dim>& patches_;
  const Layout& layout_;
  Counts one_each_;
  int columns_, column_ = 0;
  std::vector<std::int64_t> sums_;
  std::string problem_;
};

template <int Dim>
void read_ledgers(ColumnReader<Dim>& in, const PatchList<Dim>& patches) {
  // The counts are known, and shown here to be what was written.
  for (const char* name : {"patch_id", "patch_points", "patch_pieces", "patch_contacts", "patch_tools"})
    in.template read_patches<std::int64_t>(name);
  for (const auto& column : ledger_columns) {
    const auto values = in.template read_patches<double>(column.name);
    for (std::size_t p = 0; p < patches.size(); ++p) {
      patches[p]->ledger.*column.value = values[p];
      in.require(std::isfinite(values[p]), fmt::format("its column {} is not finite", column.name));
    }
  }
  in.settle();
}

/// Makes the pieces with room for their points.
template <int Dim>
void read_pieces(ColumnReader<Dim>& in, const PatchList<Dim>& patches, const Layout& layout,
                 const std::vector<Body>& bodies, const std::vector<SolverMaterial>& materials) {
  const auto body = in.template read<std::int32_t>("piece_body", 1, layout.pieces);
  const auto count = in.template read<std::int64_t>("piece_points", 1, layout.pieces);
  const auto states = in.template read<std::int32_t>("piece_states", 1, layout.pieces);
  in.settle();
  std::size_t row = 0;
  for (std::size_t at = 0; at < patches.size(); ++at) {
    Patch<Dim>& patch = *patches[at];
    const std::size_t place = layout.here[at];
    std::int64_t points = 0;
    for (std::int64_t i = 0; i < layout.pieces[place]; ++i, ++row) {
      const bool known = body[row] >= 0 && body[row] < std::ssize(bodies);
      in.require(known, fmt::format("it holds a body {}; the case has {} bodies", body[row], bodies.size()));
      const bool ascending = patch.pieces.empty() || patch.pieces.back().body < body[row];
      in.require(ascending, fmt::format("the bodies of patch {} are not in their order", patch.id));
      const bool fits = count[row] > 0 && count[row] <= layout.points[place] - points &&
                        count[row] <= std::numeric_limits<int>::max();
      in.require(fits, fmt::format("body {} in patch {} has {} points; {} are left there", body[row], patch.id,
                                   count[row], layout.points[place] - points));
      if (!known || !ascending || !fits) continue;
      const auto& material = materials[bodies[body[row]].material];
      in.require(states[row] == std::ssize(material.state_names),
                 fmt::format("body {} has {} state variables, material {} has {}", body[row], states[row],
                             material.name, material.state_names.size()));
      patch.pieces.emplace_back(body[row], static_cast<int>(material.state_names.size()));
      patch.pieces.back().points.resize(static_cast<int>(count[row]));
      points += count[row];
    }
    in.require(points == layout.points[place], fmt::format("the pieces of patch {} do not hold its points", patch.id));
  }
  in.settle();
}

template <int Dim>
void read_contacts(ColumnReader<Dim>& in, const PatchList<Dim>& patches, const Layout& layout, std::size_t body_count) {
  constexpr std::size_t size = ContactSum<Dim>::size;
  const auto pairs = in.template read<std::int32_t>("contact_bodies", 2, layout.contacts);
  const auto sums = in.template read<double>("contact_sums", size, layout.contacts);
  in.settle();
  std::size_t row = 0;
  for (std::size_t at = 0; at < patches.size(); ++at) {
    Patch<Dim>& patch = *patches[at];
    for (std::int64_t i = 0; i < layout.contacts[layout.here[at]]; ++i, ++row) {
      const std::pair<int, int> pair(pairs[2 * row], pairs[2 * row + 1]);
      in.require(patch.contacts.empty() || patch.contacts.rbegin()->first < pair,
                 fmt::format("the contacts of patch {} are not in their order", patch.id));
      ContactSum<Dim> sum;
      std::copy_n(&sums[row * size], size, sum.values.begin());
      const std::string problem = problem_of(pair, sum, body_count, body_count + 2 * Dim);
      in.require(problem.empty(), problem);
      patch.contacts[pair] = sum;
    }
  }
  in.settle();
}

template <int Dim>
void read_tools(ColumnReader<Dim>& in, const PatchList<Dim>& patches, const Layout& layout, std::size_t tool_count) {
  const auto numbers = in.template read<std::int32_t>("tool_number", 1, layout.tools);
  const auto sums = in.template read<double>("tool_sums", ToolSum::size, layout.tools);
  in.settle();
  std::size_t row = 0;
  for (std::size_t at = 0; at < patches.size(); ++at)
    for (std::int64_t i = 0; i < layout.tools[layout.here[at]]; ++i, ++row) {
      Patch<Dim>& patch = *patches[at];
      const int tool = numbers[row];
      in.require(tool >= 0 && tool < static_cast<int>(tool_count) &&
                     (patch.tools.empty() || patch.tools.rbegin()->first < tool),
                 fmt::format("the tools of patch {} are not in their order, or not those of the case", patch.id));
      auto& total = patch.tools[tool].total;
      std::copy_n(&sums[row * ToolSum::size], ToolSum::size, total.begin());
      for (const double number : total)
        in.require(std::isfinite(number), fmt::format("the sums of tool {} are not finite", tool));
    }
  in.settle();
}

template <int Dim>
void read_points(ColumnReader<Dim>& in, const PatchList<Dim>& patches, const Layout& layout, int states) {
  {
    const auto ids = in.template read<std::int64_t>("id", 1, layout.points);
    const auto images = in.template read<std::int32_t>("image", image_components, layout.points);
    std::size_t row = 0;
    for (auto* patch : patches)
      for (auto& piece : patch->pieces)
        for (int p = 0; p < piece.points.size(); ++p, ++row) {
          piece.points.ids()[p] = ids[row];
          Image image{};
          std::copy_n(&images[row * image_components], image_components, image.begin());
          piece.points.images()[p] = image;
        }
  }
  for (const Quantity& q : quantities<Dim>(states)) {
    const auto values = in.template read<double>(q.name, q.components, layout.points);
    const double* from = values.data();
    for (auto* patch : patches)
      for (auto& piece : patch->pieces) {
        Points<Dim>& points = piece.points;
        const int components = std::min(q.components, points.columns() - q.first);
        for (int c = 0; c < components; ++c)
          for (int p = 0; p < points.size(); ++p)
            points.column(q.first + c)[p] = from[static_cast<std::ptrdiff_t>(p) * q.components + c];
        from += static_cast<std::ptrdiff_t>(points.size()) * q.components;
      }
  }
  in.settle();
}

/// What crack points hold of triangles.
void read_triangles(ColumnReader<3>& in, const PatchList<3>& patches, const Layout& layout,
                    const std::vector<Crack>& cracks) {
  in.settle();
  const auto numbers = in.read<std::int32_t>("crack_triangles", held_numbers, layout.cracks);
  const std::int32_t* n = numbers.data();
  for (auto* patch : patches)
    for (auto& point : patch->cracks) {
      point.tip = n[0] != 0, point.held = n[1];
      in.require(n[1] >= 0 && n[1] <= CrackHeld<3>::most, "it holds crack points with too many triangles");
      n += 2;
      for (CrackTriangle& t : point.triangles) {
        t = {n[0], n[1], n[2] & 63};
        for (const std::int32_t other : {t.second, t.third})
          in.require(other >= 0 && other <= cracks[point.crack].ends[1], "it holds triangles of unknown crack points");
        n += 3;
      }
    }
}

template <int Dim>
void read_cracks(ColumnReader<Dim>& in, const PatchList<Dim>& patches, const Layout& layout,
                 const Lattice<Dim>& lattice, const std::vector<Crack>& cracks) {
  if (layout.cracks.empty()) return;
  in.template read_patches<std::int64_t>(patch_cracks_name);
  const auto numbers = in.template read<std::int32_t>("crack_numbers", crack_numbers, layout.cracks);
  const auto bonds = in.template read<double>("crack_bonds", bond_numbers, layout.cracks);
  in.settle();
  const std::int32_t* n = numbers.data();
  const double* bond = bonds.data();
  for (std::size_t at = 0; at < patches.size(); ++at)
    for (std::int64_t i = 0; i < layout.cracks[layout.here[at]]; ++i, n += crack_numbers, bond += bond_numbers) {
      Patch<Dim>& patch = *patches[at];
      if (n[crack_of] < 0 || n[crack_of] >= std::ssize(cracks)) {
        in.require(false, fmt::format("it holds a point of crack {}; the case has {}", n[crack_of], cracks.size()));
        continue;
      }
      const std::string problem = problem_of(n, bond, cracks[n[crack_of]], lattice);
      in.require(problem.empty(), problem);
      CrackPoint<Dim> point;
      point.crack = n[crack_of], point.index = n[crack_index], point.next = n[crack_next];
      point.filled = n[crack_filled] != 0, point.faces_filled = n[crack_faces_filled];
      point.bond = {Bond::State{n[bond_state]}, bond[0], {bond[1], bond[2]}, bond[3]};
      std::copy_n(n + crack_image, image_components, point.image.begin());
      in.require(patch.cracks.empty() || patch.cracks.back() < point,
                 fmt::format("the crack points of patch {} are not in their order", patch.id));
      patch.cracks.push_back(point);
    }
  if constexpr (Dim == 3) read_triangles(in, patches, layout, cracks);
  in.settle();
  for (const auto& vector : crack_vectors<Dim>) {
    const auto values = in.template read<double>(vector.name, Dim, layout.cracks);
    const double* from = values.data();
    for (auto* patch : patches)
      for (auto& point : patch->cracks)
        for (int d = 0; d < Dim; ++d) (point.*vector.value)[d] = *from++;
  }
  for (const auto* patch : patches)
    for (const auto& point : patch->cracks) {
      const std::string problem = problem_of(point, lattice, *patch);
      in.require(problem.empty(), problem);
    }
  in.settle();
}

/// Each point is there once, and where it can be.
template <int Dim>
void check_points(ColumnReader<Dim>& in, const PatchList<Dim>& patches, const Lattice<Dim>& lattice) {
  std::vector<std::int64_t> ids;
  for (const auto* patch : patches)
    for (const auto& piece : patch->pieces) {
      const std::string problem = problem_of(piece, lattice, patch->id);
      in.require(problem.empty(), problem);
      ids.insert(ids.end(), piece.points.ids().begin(), piece.points.ids().end());
    }
  std::ranges::sort(ids);
  const auto twice = std::ranges::adjacent_find(ids);
  in.require(twice == ids.end(), fmt::format("it holds point {} twice", twice == ids.end() ? 0 : *twice));
  in.settle();
}

RunState read_state(const CheckpointReader& reader) {
  RunState state;
  for_each_number(state, [&]<class T>(const std::string& name, T& value) {
    if constexpr (std::is_same_v<T, std::uint64_t>) {
      std::int64_t bits = 0;
      reader.read(name, bits);
      value = std::bit_cast<std::uint64_t>(bits);
    } else {
      reader.read(name, value);
    }
  });
  state.step.time = reader.table().time(), state.step.steps = reader.table().step();
  state.stage = reader.column<double>("stage_state");
  state.pouring = reader.column<double>("pouring_state");
  state.tools = reader.column<double>("tool_state", tool_state_size);
  state.cracks = reader.column<double>("crack_state", Crack::state_size);
  state.parts = reader.column<double>("part_of");
  state.spared = reader.column<double>("crack_spared", 2);
  const auto times = reader.column<double>("series_time");
  std::istringstream names(reader.text("series_names"));
  std::size_t listed = 0;
  for (std::string name; std::getline(names, name); ++listed)
    if (listed < times.size()) state.series.push_back({name, times[listed]});
  reader.require(listed == times.size() ? "" : "its list of particle files has not as many names as times");
  reader.require(problem_of(state));
  return state;
}

/// The numbers and texts are those that were written together.
void check_numbers(const CheckpointReader& reader, const RunState& state, const std::string& case_text) {
  std::int64_t sum = 0;
  reader.read(numbers_checksum_name, sum);
  reader.require(std::bit_cast<std::uint64_t>(sum) == checksum_of(state, case_text)
                     ? ""
                     : "damaged: its numbers, case or list of particle files do not match their checksum");
}

}  // namespace

Checkpoint::Checkpoint(const std::filesystem::path& file, MPI_Comm comm)
    : reader_(file, comm),
      comm_(comm),
      state_(read_state(reader_)),
      case_text_(reader_.text("case")),
      patches_(reader_.column<std::int64_t>("patch_id")),
      points_(reader_.column<std::int64_t>("patch_points")),
      pieces_(reader_.column<std::int64_t>("patch_pieces")),
      contacts_(reader_.column<std::int64_t>("patch_contacts")),
      tools_(reader_.column<std::int64_t>("patch_tools")) {
  check_numbers(reader_, state_, case_text_);
  const std::size_t patches = patches_.size();
  const bool consistent =
      points_.size() == patches && pieces_.size() == patches && contacts_.size() == patches && tools_.size() == patches;
  reader_.require(consistent ? "" : "damaged: the tables of patches do not fit together");
  const std::int64_t rows = reader_.rows_of("id");
  reader_.require(rows == reader_.table().rows() ? "" : "damaged: it has more or fewer points than it says");
  reader_.require(problem_of("patch_points", points_, rows));
  reader_.require(problem_of("patch_pieces", pieces_, reader_.rows_of("piece_body")));
  if (reader_.table().rows_of(patch_cracks_name) >= 0) {
    cracks_ = reader_.column<std::int64_t>(patch_cracks_name);
    reader_.require(cracks_.size() == points_.size() ? "" : "damaged: the tables of patches do not fit together");
    reader_.require(problem_of(patch_cracks_name, cracks_, reader_.rows_of("crack_numbers")));
  }
  reader_.require(problem_of("patch_contacts", contacts_, reader_.rows_of("contact_bodies")));
  reader_.require(problem_of("patch_tools", tools_, reader_.rows_of("tool_number")));
}

template <int Dim>
void Checkpoint::check_layout(const Lattice<Dim>& lattice) const {
  std::int64_t dimension = 0;
  reader_.read("dimension", dimension);
  reader_.require(dimension == Dim ? "" : fmt::format("it is of a case in {} dimensions, not {}", dimension, Dim));
  std::int64_t patches = 0;
  reader_.read("patches", patches);
  reader_.require(
      patches == lattice.patch_count()
          ? ""
          : fmt::format("it divides the domain into {} patches, the case into {}", patches, lattice.patch_count()));
  for (int d = 0; d < Dim; ++d) {
    const double upper = state_.step.upper[d];
    const bool fits = upper == lattice.upper()[d] || (lattice.periodic(d) && upper > lattice.lower()[d]);
    reader_.require(fits ? "" : fmt::format("its domain ends at {} in direction {}", upper, "xyz"[d]));
  }
  const bool ordered = std::ranges::adjacent_find(patches_, std::greater_equal{}) == patches_.end() &&
                       (patches_.empty() || (patches_.front() >= 0 && patches_.back() < lattice.patch_count()));
  reader_.require(ordered ? "" : "its patches are not in their order, or not those of the case");
}

template <int Dim>
void Checkpoint::fill(std::vector<Patch<Dim>>& patches, const Lattice<Dim>& lattice, const std::vector<Body>& bodies,
                      const std::vector<SolverMaterial>& materials, const std::vector<Crack>& cracks) const {
  Layout layout{patches_, points_, pieces_, contacts_, tools_, {}, cracks_};
  reader_.require(cracks_.empty() == cracks.empty() ? "" : "it has cracks where the case has none, or the other way");
  const PatchList<Dim> held = layout.find(patches);
  const int states = most_states(materials);
  constexpr int columns_besides_quantities = 14 + static_cast<int>(std::size(ledger_columns));
  const int columns = columns_besides_quantities + static_cast<int>(quantities<Dim>(states).size()) +
                      (cracks.empty() ? 0 : crack_columns<Dim>);
  ColumnReader<Dim> in(reader_, held, layout, columns);
  read_ledgers(in, held);
  read_pieces(in, held, layout, bodies, materials);
  read_contacts(in, held, layout, bodies.size());
  read_tools(in, held, layout, state_.tools.size() / tool_state_size);
  read_points(in, held, layout, states);
  read_cracks(in, held, layout, lattice, cracks);
  check_points(in, held, lattice);
}

template void Checkpoint::check_layout(const Lattice<2>&) const;
template void Checkpoint::check_layout(const Lattice<3>&) const;
template void Checkpoint::fill(std::vector<Patch<2>>&, const Lattice<2>&, const std::vector<Body>&,
                               const std::vector<SolverMaterial>&, const std::vector<Crack>&) const;
template void Checkpoint::fill(std::vector<Patch<3>>&, const Lattice<3>&, const std::vector<Body>&,
                               const std::vector<SolverMaterial>&, const std::vector<Crack>&) const;

}  // namespace cairn
