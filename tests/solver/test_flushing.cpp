// However a run ends, the disk holds its files then.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <set>

#include "../support/cases.hpp"
#include "../support/mpi_environment.hpp"
#include "cairn/core/error.hpp"
#include "cairn/io/result_files.hpp"
#include "cairn/solver/run.hpp"

namespace {

std::map<std::string, std::int64_t> flushed_bytes;  // of each file when it was flushed last

}  // namespace

/// Takes the place of the system's call in this program, and notes what is flushed.
extern "C" int fsync(int descriptor) {
  std::error_code error;
  const auto file = std::filesystem::read_symlink(fmt::format("/proc/self/fd/{}", descriptor), error);
  if (std::filesystem::is_regular_file(file, error))
    flushed_bytes[file.filename().string()] = static_cast<std::int64_t>(std::filesystem::file_size(file, error));
  return static_cast<int>(syscall(SYS_fsync, descriptor));
}

namespace cairn::test {
namespace {

namespace fs = std::filesystem;

class Flushing : public testing::Test {
 protected:
  Flushing() : folder_(fs::temp_directory_path() / fmt::format("cairn_flushing_{}", getpid())) {
    flushed_bytes.clear();
    fs::create_directories(folder_);
    settings_.out = folder_;
    case_.time.steps = 12;
    case_.output.history.every = 5, case_.output.particles.every = 4, case_.output.grains.every = 6;
    case_.output.track = {0};
  }
  ~Flushing() override { fs::remove_all(folder_); }

  void expect_all_flushed(const std::set<std::string>& expected) const {
    std::set<std::string> found;
    for (const auto& file : find_results(folder_)) found.insert(file.filename().string());
    for (const auto& name : expected) EXPECT_TRUE(fs::exists(folder_ / name)) << name;
    found.insert(expected.begin(), expected.end());
    for (const auto& name : found) {
      // The index and checkpoints are flushed under another name, before they get their own.
      const std::string at_work = flushed_bytes.contains(name) ? name : "." + name + ".part";
      ASSERT_TRUE(flushed_bytes.contains(at_work)) << name;
      EXPECT_EQ(flushed_bytes[at_work], static_cast<std::int64_t>(fs::file_size(folder_ / name))) << name;
    }
  }

  fs::path folder_;
  Case case_ = colliding_balls(2, 20, 10);
  RunSettings settings_;
};

TEST_F(Flushing, AtTheEnd) {
  EXPECT_EQ(run_case(case_, settings_, MPI_COMM_WORLD), 0);
  expect_all_flushed({"history.csv", "bodies.csv", "particles_000003.vtkhdf", "grains_000002.h5"});
}

TEST_F(Flushing, WhereAGuardFailsTheRun) {
  case_.solver.energy_limit = 1e-300;
  EXPECT_THROW(run_case(case_, settings_, MPI_COMM_WORLD), RunError);
  expect_all_flushed({"history.csv", "particles_000001.vtkhdf", "failure_particles.vtkhdf"});
}

TEST_F(Flushing, WhereTheRunIsStopped) {
  case_.time.wall_limit = 1e-9;
  EXPECT_EQ(run_case(case_, settings_, MPI_COMM_WORLD), 4);
  expect_all_flushed({"history.csv", "particles_000000.vtkhdf", "checkpoint_000000.h5"});
}

}  // namespace
}  // namespace cairn::test
