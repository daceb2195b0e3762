#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "cairn/io/history.hpp"

namespace {

using namespace cairn;
namespace fs = std::filesystem;

class History : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("cairn_history_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string text() const {
    std::ifstream stream(folder_ / "h.csv");
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  fs::path folder_;
};

TEST_F(History, EveryRowIsOnDiskAtOnce) {
  CsvWriter csv(folder_ / "h.csv", {"step", "time", "energy"});
  EXPECT_EQ(text(), "step,time,energy\n");
  csv.add_row(std::vector<CsvValue>{std::int64_t{10}, 1e-7, 0.1});
  EXPECT_EQ(text(), "step,time,energy\n10,1e-07,0.1\n");
  csv.add_row(std::vector<CsvValue>{std::int64_t{20}, 2.0, -1.0 / 3.0});
  EXPECT_EQ(text(), "step,time,energy\n10,1e-07,0.1\n20,2,-0.3333333333333333\n");
  EXPECT_TRUE(csv.ok());
}

TEST_F(History, NumbersReadBackToTheSameBits) {
  const std::vector<double> values = {0.1,  1.0 / 3.0,          5e-324, std::numeric_limits<double>::max(),
                                      -0.0, 123456789.123456789};
  CsvWriter csv(folder_ / "h.csv", {"x"});
  for (const double v : values) csv.add_row(std::vector<CsvValue>{v});
  std::ifstream stream(folder_ / "h.csv");
  std::string line;
  std::getline(stream, line);
  for (const double v : values) {
    ASSERT_TRUE(std::getline(stream, line));
    const double back = std::strtod(line.c_str(), nullptr);
    EXPECT_EQ(back, v);
    EXPECT_EQ(std::signbit(back), std::signbit(v));
  }
}

TEST_F(History, AWriterWithoutFileDoesNothing) {
  CsvWriter csv;
  csv.add_row(std::vector<CsvValue>{1.0});
  EXPECT_TRUE(csv.ok());
}

TEST_F(History, AWrongNumberOfValuesIsRefused) {
  CsvWriter csv(folder_ / "h.csv", {"a", "b"});
  EXPECT_THROW(csv.add_row(std::vector<CsvValue>{1.0}), std::logic_error);
  EXPECT_EQ(text(), "a,b\n");
}

TEST_F(History, FailureToCreateIsKept) {
  CsvWriter csv(folder_ / "missing" / "h.csv", {"a"});
  EXPECT_FALSE(csv.ok());
  EXPECT_NE(csv.error().find("No such file or directory"), std::string::npos) << csv.error();
  csv.add_row(std::vector<CsvValue>{1.0});
}

TEST_F(History, FailureToWriteLeavesWholeLines) {
  CsvWriter csv(folder_ / "h.csv", {"a"});
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit = {10, before.rlim_max};  // the header, two rows of three bytes, and part of the next
  setrlimit(RLIMIT_FSIZE, &limit);
  for (int i = 0; i < 4; ++i) csv.add_row(std::vector<CsvValue>{10.0 + i});
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(text(), "a\n10\n11\n");
  EXPECT_FALSE(csv.ok());
  csv.add_row(std::vector<CsvValue>{14.0});  // dropped: a gap in the middle would go unnoticed
  EXPECT_EQ(text(), "a\n10\n11\n");
}

TEST_F(History, MovesKeepTheFile) {
  CsvWriter csv;
  csv = CsvWriter(folder_ / "h.csv", {"a"});
  csv.add_row(std::vector<CsvValue>{1.5});
  EXPECT_EQ(text(), "a\n1.5\n");
}

}  // namespace
