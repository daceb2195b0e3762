#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <set>

#include "cairn/io/result_files.hpp"

namespace cairn {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> results = {
    "bodies.csv",  "checkpoint_000020.h5", "contacts_000001.h5",   "grains_1234567.h5",
    "history.csv", "particles.hdf.series", "particles_000.vtkhdf", "particles_000012.vtkhdf"};
const std::set<std::string> others = {
    "case.toml",          "notes.txt",     "history.csv.bak",     "my_history.csv", "particles_.vtkhdf",
    "particles_a.vtkhdf", "grains_01.csv", "checkpoint_1.h5.old", "summary.json",   "shear_000001.h5"};

TEST(ResultFiles, NamesAreRecognised) {
  for (const auto& name : results) EXPECT_TRUE(is_result_name(name)) << name;
  for (const auto& name : others) EXPECT_FALSE(is_result_name(name)) << name;
}

TEST(ResultFiles, ExactlyTheResultsAreFoundAndRemoved) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("cairn_results_{}", getpid());
  EXPECT_TRUE(find_results(folder).empty()) << "a folder that does not exist holds none";
  fs::create_directories(folder / "grains_000001.h5.d");
  fs::create_directory(folder / "grains_000002.h5");  // a folder is no result, whatever its name
  for (const auto& name : results) std::ofstream(folder / name) << name;
  for (const auto& name : others) std::ofstream(folder / name) << name;

  std::set<std::string> found;
  for (const auto& file : find_results(folder)) found.insert(file.filename().string());
  EXPECT_EQ(found, results);
  EXPECT_EQ(remove_results(folder), "");
  EXPECT_TRUE(find_results(folder).empty());
  for (const auto& name : others) EXPECT_TRUE(fs::exists(folder / name)) << name;
  EXPECT_TRUE(fs::is_directory(folder / "grains_000002.h5"));
  EXPECT_EQ(remove_results(folder), "") << "nothing to remove is no error";
  fs::remove_all(folder);
}

}  // namespace
}  // namespace cairn
