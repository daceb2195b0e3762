#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "cairn/io/progress.hpp"

namespace {

using namespace cairn;

const Progress halfway = {.fraction = 0.42,
                          .time = 1.234e-6,
                          .step = 1234,
                          .dt = 1.2e-9,
                          .points = 12345,
                          .point_steps_per_second_rank = 4.56e6,
                          .energy_error = 1.2e-5,
                          .wall_left = 3723.5};

/// What is printed while `print` runs with a stream.
template <class Print>
std::string printed(const Print& print) {
  std::FILE* stream = std::tmpfile();
  print(stream);
  std::rewind(stream);
  std::array<char, 4096> text{};
  const std::size_t length = std::fread(text.data(), 1, text.size(), stream);
  std::fclose(stream);
  return {text.data(), length};
}

TEST(ProgressLine, SaysEverything) {
  EXPECT_EQ(format_progress(halfway),
            " 42.0 %  t 1.234e-06 s  step 1234  dt 1.2e-09 s  12345 points  4.56 M point-steps/s/rank  "
            "energy error 1.2e-05  left 1:02:04");
}

TEST(ProgressLine, TimeLeft) {
  EXPECT_DOUBLE_EQ(estimate_wall_left(0.25, 0.0, 10.0), 30.0);
  EXPECT_DOUBLE_EQ(estimate_wall_left(0.75, 0.5, 10.0), 10.0);  // after a restart halfway
  EXPECT_LT(estimate_wall_left(0.0, 0.0, 10.0), 0.0);
  EXPECT_NE(format_progress({}).find("left 0:00:00"), std::string::npos);
  EXPECT_NE(format_progress({.wall_left = -1}).find("left ?"), std::string::npos);
}

TEST(ProgressDisplay, IntoAFileWholeLinesTenSecondsApart) {
  const std::string line = format_progress(halfway) + "\n";
  const std::string text = printed([](std::FILE* stream) {
    ProgressDisplay display(stream);  // a temporary file is no terminal
    for (double wall = 0; wall < 20.5; wall += 1) display.show(halfway, wall);
    display.finish();
  });
  EXPECT_EQ(text, line + line + line);  // at 0, 10 and 20 s
}

TEST(ProgressDisplay, OnATerminalOneLineIsRewritten) {
  const std::string text = printed([](std::FILE* stream) {
    ProgressDisplay display(stream, true);
    display.show(halfway, 0.0);
    display.show(halfway, 0.1);  // too soon
    display.show({}, 1.0);
    display.finish();
    display.finish();
  });
  const std::string first = format_progress(halfway), second = format_progress({});
  ASSERT_LT(second.size(), first.size());
  EXPECT_EQ(text, "\r" + first + "\r" + second + std::string(first.size() - second.size(), ' ') + "\n");
}

TEST(RunSummary, IsOneLineForMachines) {
  const RunSummary summary = {.steps = 100,
                              .points = 2000,
                              .time = 9.6e-6,
                              .wall = 1.5,
                              .step_wall = 1.25,
                              .point_steps = 2e5,
                              .energy_error = 1.25e-4,
                              .ranks = 4};
  EXPECT_EQ(format_summary(summary),
            "done steps=100 points=2000 time=9.6e-06 wall=1.500 step_wall=1.250 point_steps_per_s=160000 "
            "energy_error=0.000125 ranks=4");
  EXPECT_NE(format_summary({}).find("point_steps_per_s=0 "), std::string::npos);
}

}  // namespace
