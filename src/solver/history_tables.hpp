#pragma once
/// history.csv, bodies.csv, forces.csv and tips.csv of a run, written by rank 0.

#include <filesystem>
#include <string>
#include <vector>

#include "cairn/io/history.hpp"
#include "cairn/solver/run_state.hpp"

namespace cairn {

std::vector<std::string> history_columns(int dimension);
std::vector<std::string> body_columns(int dimension);
std::vector<std::string> force_columns();
std::vector<std::string> tip_columns(int dimension);

template <int Dim>
class HistoryTables {
 public:
  /// `track`: bodies of bodies.csv; `forces`, `tips`: whether there is a forces.csv and a tips.csv.
  HistoryTables(std::filesystem::path out, std::vector<int> track, bool forces, bool tips)
      : out_(std::move(out)), track_(std::move(track)), with_forces_(forces), with_tips_(tips) {}

  /// Creates the files; or, where history.csv is there and `from` is given, goes on with them. Rank 0 only.
  void open(const RunState* from);

  /// Adds one row to history.csv and one for each tracked body to bodies.csv. Collective.
  void add(const Simulation<Dim>& simulation, const Totals& totals, double energy_error);

  /// Adds a row for each tip of a crack to tips.csv. Collective.
  void add_tips(Simulation<Dim>& simulation);
  /// Adds a row for each tool that is there to forces.csv. Collective.
  void add_forces(const Simulation<Dim>& simulation);

  /// Has the files flushed to disk.
  void flush() { history_.flush(), bodies_.flush(), forces_.flush(), tips_.flush(); }
  /// Notes how far the files go.
  void note_positions(RunState& state) const;
  /// The first error, empty if there was none.
  const std::string& error() const {
    for (const CsvWriter* table : {&history_, &bodies_})
      if (!table->error().empty()) return table->error();
    if (!forces_.error().empty()) return forces_.error();
    return tips_.error();
  }

 private:
  void add_bodies(const Simulation<Dim>& simulation);

  std::filesystem::path out_;
  std::vector<int> track_;
  bool with_forces_, with_tips_;
  CsvWriter history_, bodies_, forces_, tips_;
};

}  // namespace cairn
