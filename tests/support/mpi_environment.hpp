#pragma once
/// Starts MPI before the tests of an executable and ends it after them, where nobody else does. Include once.

#include <gtest/gtest.h>
#include <mpi.h>

namespace cairn::test {

class MpiEnvironment : public testing::Environment {
 public:
  void SetUp() override {
    int running = 0;
    MPI_Initialized(&running);
    if (running) return;
    MPI_Init(nullptr, nullptr);
    started_ = true;
  }
  void TearDown() override {
    if (started_) MPI_Finalize();
  }

 private:
  bool started_ = false;
};

inline testing::Environment* const mpi_environment = testing::AddGlobalTestEnvironment(new MpiEnvironment);

}  // namespace cairn::test
