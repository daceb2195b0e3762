#pragma once
/// A folder for case files, and what reading them says.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <random>

#include "cairn/core/error.hpp"
#include "cairn/io/case.hpp"
#include "cairn/io/pack_spec.hpp"

namespace cairn::test {

namespace fs = std::filesystem;

inline const std::string base = R"([domain]
upper = [1.0, 1.0]
cells = [20, 10]
[time]
end = 0.1
[materials.soft]
model = "neo_hookean"
density = 1000.0
shear_modulus = 1.0e5
bulk_modulus = 2.0e5
[[bodies]]
shape = { type = "disk", centre = [0.5, 0.5], radius = 0.2 }
material = "soft"
)";

inline std::string replaced(std::string text, const std::string& old, const std::string& with) {
  const auto at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return at == std::string::npos ? text : text.replace(at, old.size(), with);
}

/// A folder of its own for each test.
class CaseFile : public ::testing::Test {
 protected:
  CaseFile()
      : folder_(fs::temp_directory_path() /
                fmt::format("cairn_case_{}_{}", getpid(),
                            ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::create_directories(folder_);
  }
  ~CaseFile() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  Case read(const std::string& text, const std::vector<Override>& overrides = {}) const {
    return read_case(write("case.toml", text), overrides);
  }
  /// The error lines of a wrong case, without the folder.
  std::vector<std::string> errors(const std::string& text, const std::vector<Override>& overrides = {}) const {
    try {
      read(text, overrides);
    } catch (const InputError& error) {
      auto lines = error.messages();
      for (auto& line : lines)
        if (line.starts_with(folder_.string())) line.erase(0, folder_.string().size() + 1);
      return lines;
    }
    return {};
  }
  void expect_error(const std::string& text, const std::string& start, const std::string& remedy,
                    const std::vector<Override>& overrides = {}) const {
    const auto lines = errors(text, overrides);
    ASSERT_EQ(lines.size(), 1u) << start << "\n" << fmt::format("{}", fmt::join(lines, "\n"));
    EXPECT_TRUE(lines[0].starts_with(start)) << lines[0] << "\nexpected " << start;
    EXPECT_NE(lines[0].find(remedy), std::string::npos) << lines[0] << "\nexpected " << remedy;
  }
  fs::path folder_;
};

}  // namespace cairn::test
