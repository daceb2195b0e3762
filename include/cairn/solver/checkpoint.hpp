#pragma once
/// Checkpoints: everything needed to go on with the same bits on any number of ranks.
///
/// Points lie in patch order, within a patch piece by piece (ascending in body), within a piece in their own order; so
/// a file does not depend on the ranks that wrote it. For every patch and column it holds a checksum of the values as
/// they were in memory, besides the seal over the whole file (io/checkpoint_file.hpp). Layout: docs/restart.md.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "cairn/io/checkpoint_file.hpp"
#include "cairn/parallel/communicator.hpp"
#include "cairn/solver/run_state.hpp"

namespace cairn {

/// Writes a checkpoint. Collective.
/// \throws RunError on every rank if writing fails; then there is no file, or the one that was there before
template <int Dim>
void write_checkpoint(const std::filesystem::path& file, const Simulation<Dim>& simulation, const RunState& state,
                      const std::string& case_text);

/// A checkpoint, opened and found whole. Members are collective and throw InputError naming the file on every rank.
class Checkpoint {
 public:
  Checkpoint(const std::filesystem::path& file, MPI_Comm comm);

  const std::filesystem::path& file() const { return reader_.file(); }
  const RunState& state() const { return state_; }
  const std::string& case_text() const { return case_text_; }
  /// The patches that it holds, ascending, and the points of each, which may be none.
  const std::vector<PatchId>& patches() const { return patches_; }
  const std::vector<std::int64_t>& points() const { return points_; }

  /// \throws InputError if the file is of another dimension or another division into patches
  template <int Dim>
  void check_layout(const Lattice<Dim>& lattice) const;
  /// Gives this rank's patches (ascending, empty) their points, ledgers, contacts and crack points.
  /// \throws InputError if the content does not match its checksums or the case's bodies and materials, or is no state
  /// of a run: counts, order, points that are not finite, inverted, there twice or not in their patch
  template <int Dim>
  void fill(std::vector<Patch<Dim>>& patches, const Lattice<Dim>& lattice, const std::vector<Body>& bodies,
            const std::vector<SolverMaterial>& materials, const std::vector<Crack>& cracks) const;

 private:
  CheckpointReader reader_;
  MPI_Comm comm_;
  RunState state_;
  std::string case_text_;
  std::vector<PatchId> patches_;
  std::vector<std::int64_t> points_, pieces_, contacts_, tools_;  // of each
  std::vector<std::int64_t> cracks_;                              // crack points; empty where the case has no cracks
};

}  // namespace cairn
