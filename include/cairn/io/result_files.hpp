#pragma once
/// The files in which a run leaves its results, so that none are overwritten unasked.

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace cairn {

/// The points at the moment of a failure.
inline constexpr const char* failure_file = "failure_particles.vtkhdf";
/// Which program wrote the results, and when.
inline constexpr const char* record_file = "run.json";

/// True for the names of result files: history.csv, bodies.csv, forces.csv, particles_N.vtkhdf, grains_N.h5,
/// contacts_N.h5 and checkpoint_N.h5 with N a number, particles.hdf.series and failure_particles.vtkhdf. What a run
/// reads again, case.toml and the copies of its grain tables, is none.
bool is_result_name(const std::string& name);

/// The result files in `folder`, sorted; none if there is no such folder. Not collective.
/// \throws InputError if the folder cannot be read.
std::vector<std::filesystem::path> find_results(const std::filesystem::path& folder);

/// Removes exactly the result files in `folder` that this program wrote; returns the first error, which other files
/// with such names are (own_files.hpp). Not collective.
std::string remove_results(const std::filesystem::path& folder);

struct NumberedFile {
  std::int64_t number;
  std::filesystem::path file;
};

/// The result files KIND_N of a folder, ascending in N; KIND is particles, grains, contacts or checkpoint. Not
/// collective.
std::vector<NumberedFile> numbered_files(const std::filesystem::path& folder, const std::string& kind);

/// KIND_N with at least six digits and the ending of its kind.
std::string numbered_name(const std::string& kind, std::int64_t number);

/// Removes what a program that was killed left under temporary names. Not collective.
void remove_leftovers(const std::filesystem::path& folder);

/// Has the system put a file and its name on the disk; returns the error, empty if none. Not collective.
std::string flush_to_disk(const std::filesystem::path& file);

/// Files that may still be in the system's memory. They are flushed to disk at the latest when the object goes out of
/// scope, so that a run that fails leaves them there, too. Not collective.
class UnflushedFiles {
 public:
  UnflushedFiles() = default;
  UnflushedFiles(const UnflushedFiles&) = delete;
  UnflushedFiles& operator=(const UnflushedFiles&) = delete;
  ~UnflushedFiles();

  void add(std::filesystem::path file) { files_.push_back(std::move(file)); }
  /// Flushes all of them and forgets them; returns the first error, empty if there was none.
  std::string flush();

 private:
  std::vector<std::filesystem::path> files_;
};

/// Gives a file this text, all of it or none: it is written under a temporary name, flushed to disk and renamed. What
/// is there is replaced, whoever wrote it (own_files.hpp). Returns the error, empty if none. Not collective.
std::string replace_file(const std::filesystem::path& file, const std::string& text);

}  // namespace cairn
