#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <set>

#include "cairn/io/folder_lock.hpp"
#include "cairn/io/own_files.hpp"
#include "cairn/io/result_files.hpp"
#include "cairn/io/run_record.hpp"

namespace cairn {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> results = {"bodies.csv",
                                       "checkpoint_000020.h5",
                                       "contacts_000001.h5",
                                       "grains_1234567.h5",
                                       "failure_particles.vtkhdf",
                                       "history.csv",
                                       "particles.hdf.series",
                                       "particles_000.vtkhdf",
                                       "particles_000012.vtkhdf",
                                       "run.json"};
const std::set<std::string> others = {"case.toml",       "notes.txt",           "history.csv.bak",
                                      "my_history.csv",  "particles_.vtkhdf",   "particles_a.vtkhdf",
                                      "grains_01.csv",   "checkpoint_1.h5.old", "summary.json",
                                      "shear_000001.h5", "view.hdf.series",     "case_grains_0.csv"};

/// Content as this program writes it.
std::string content_of(const std::string& name) {
  if (name == "history.csv") return "step,time,dt,kinetic_energy\n0,0,0,0\n";
  if (name == "bodies.csv") return "step,time,body,x,y\n";
  if (name == "run.json") return record_mark;
  if (name.ends_with(".series")) return "{\n  \"file-series-version\": \"1.0\",\n  \"files\": [\n  ]\n}\n";
  return std::string("\x89HDF\r\n\x1a\n") + std::string(100, 'x') + std::string("kind\0", 5);
}

TEST(ResultFiles, NamesAreRecognised) {
  for (const auto& name : results) EXPECT_TRUE(is_result_name(name)) << name;
  for (const auto& name : others) EXPECT_FALSE(is_result_name(name)) << name;
}

TEST(ResultFiles, ExactlyTheResultsAreFoundAndRemoved) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("cairn_results_{}", getpid());
  EXPECT_TRUE(find_results(folder).empty()) << "a folder that does not exist holds none";
  fs::create_directories(folder / "grains_000001.h5.d");
  fs::create_directory(folder / "grains_000002.h5");  // a folder is no result, whatever its name
  for (const auto& name : results) std::ofstream(folder / name) << content_of(name);
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

TEST(ResultFiles, WhatThisProgramDidNotWriteIsForeign) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("cairn_foreign_{}", getpid());
  fs::create_directories(folder);
  for (const auto& name : results) {
    const fs::path file = folder / name;
    EXPECT_EQ(foreign_result(file), "") << "nothing is there";
    std::ofstream(file) << "";
    EXPECT_EQ(foreign_result(file), "") << "nothing is in it";
    std::ofstream(file) << content_of(name);
    EXPECT_EQ(foreign_result(file), "") << name;
    std::ofstream(file) << "x,y,r\n1,1,1\n";
    EXPECT_NE(foreign_result(file), "") << name;
    EXPECT_NE(remove_results(folder), "") << name;
    EXPECT_TRUE(fs::exists(file)) << name;
    fs::remove(file);
    std::ofstream(folder / "own") << content_of(name);
    fs::create_symlink(folder / "own", file);
    EXPECT_NE(foreign_result(file), "") << name << ": a link";
    fs::remove(file);
  }
  for (const char* name : {"case.toml", "case_grains_0.csv"}) {
    std::ofstream(folder / name) << "title = \"mine\"\n";
    EXPECT_NE(foreign_result(folder / name), "") << name;
    std::ofstream(folder / name) << (name == std::string("case.toml") ? case_mark : table_mark) << "\n";
    EXPECT_EQ(foreign_result(folder / name), "") << name;
  }
  fs::remove_all(folder);
}

/// With the system's locks and without: one holder at a time; a holder that is gone is no obstacle.
TEST(FolderLock, OneAtATime) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("cairn_lock_{}", getpid());
  fs::create_directories(folder);
  const auto message = [&](bool system) -> std::string {
    try {
      FolderLock other(folder, system);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  };
  for (const bool system : {true, false}) {
    {
      FolderLock lock(folder, system);
      EXPECT_NE(message(system).find(fmt::format("process {} on ", getpid())), std::string::npos) << message(system);
      FolderLock moved = std::move(lock);
      EXPECT_NE(message(system), "");
    }
    EXPECT_TRUE(fs::is_empty(folder)) << "the lock's file is gone with it";
    EXPECT_EQ(message(system), "");
    const pid_t child = fork();
    if (child == 0) {
      new FolderLock(folder, system);
      _exit(0);  // without giving it back
    }
    waitpid(child, nullptr, 0);
    EXPECT_TRUE(fs::exists(folder / ".cairn.lock"));
    EXPECT_EQ(message(system), "") << "of a process that is gone";
    EXPECT_TRUE(fs::is_empty(folder));
  }
  std::ofstream(folder / ".cairn.lock") << "process 1 on another.host\n";
  EXPECT_NE(message(false).find("process 1 on another.host; if it has ended, remove"), std::string::npos);
  EXPECT_EQ(message(true), "") << "the system knows that nobody has it";
  fs::create_symlink("/dev/null", folder / ".cairn.lock");
  EXPECT_NE(message(true), "") << "a link is not followed";
  fs::remove_all(folder);
}

}  // namespace
}  // namespace cairn
