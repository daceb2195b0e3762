#pragma once
/// Columns of result files under construction, and their rows.

#include <deque>
#include <tuple>
#include <variant>
#include <vector>

#include "cairn/io/table_file.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {

/// Columns under construction; keeps their numbers alive until the file is written.
class Columns {
 public:
  std::vector<double>& add_doubles(const std::string& name, int components) { return add(name, components, doubles_); }
  std::vector<std::int32_t>& add_ints(const std::string& name, int components) { return add(name, components, ints_); }

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
  using Values = std::variant<const std::vector<double>*, const std::vector<std::int32_t>*>;
  std::deque<std::vector<double>> doubles_;
  std::deque<std::vector<std::int32_t>> ints_;
  std::vector<std::tuple<std::string, int, Values>> columns_;
};

/// Rows of this rank's patches, of which each has count_of(patch): in the file they lie in patch order. Collective.
template <int Dim, class F>
RowBlocks patch_rows(const Simulation<Dim>& simulation, F&& count_of) {
  const PatchTable<Dim>& table = simulation.table();
  std::vector<std::int64_t> counts(table.size(), 0);
  for (const auto& patch : simulation.patches()) counts[table.find(patch.id)] = count_of(patch);
  MPI_Allreduce(MPI_IN_PLACE, counts.data(), static_cast<int>(counts.size()), MPI_INT64_T, MPI_SUM,
                simulation.communicator());
  RowBlocks rows;
  auto patch = simulation.patches().begin();
  for (std::size_t i = 0; i < counts.size(); rows.total_rows += counts[i], ++i)
    if (patch != simulation.patches().end() && patch->id == table.patches()[i]) {
      if (counts[i] > 0) rows.blocks.push_back({rows.total_rows, counts[i]});
      ++patch;
    }
  return rows;
}

inline void append(std::vector<double>& out, const Vec3& v) { out.insert(out.end(), v.data(), v.data() + 3); }

}  // namespace cairn
