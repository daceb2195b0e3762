// Points that no step can go on from stop the run on every rank, which names them.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <mpi.h>
#include <unistd.h>

#include <filesystem>
#include <limits>

#include "../../src/solver/stage_keeper.hpp"
#include "../support/cases.hpp"
#include "cairn/core/error.hpp"
#include "cairn/io/case_changes.hpp"
#include "cairn/solver/checkpoint.hpp"
#include "cairn/solver/run.hpp"

namespace cairn {
namespace {

using namespace test;
namespace fs = std::filesystem;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Sets one number of one point, wherever it lives; returns the point's body, on every rank. Collective.
template <int Dim>
int set_number(Simulation<Dim>& simulation, std::int64_t id, int column, double value) {
  int body = -1;
  for (auto& patch : simulation.patches())
    for (auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size(); ++p)
        if (piece.points.ids()[p] == id) piece.points.column(column)[p] = value, body = piece.body;
  MPI_Allreduce(MPI_IN_PLACE, &body, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  return body;
}

/// What the run says when it steps on; empty where it goes on.
template <int Dim>
std::string failure_of(Simulation<Dim>& simulation) {
  try {
    simulation.step(1e300);
    simulation.notice();
  } catch (const RunError& error) {
    return error.what();
  }
  return {};
}

/// One number of one point is spoilt after three steps; on any number of ranks, dealt out in any way, every rank names
/// the point.
template <int Dim>
void check_fault(Case c, int column, double value, const std::string& expected) {
  for (Partition partition : {Partition::metis, Partition::round_robin})
    for (std::int64_t id : {7, 150}) {
      c.parallel.partition = partition;
      Simulation<Dim> simulation(c, MPI_COMM_WORLD);
      for (int i = 0; i < 3; ++i) ASSERT_EQ(failure_of(simulation), "");
      const int body = set_number(simulation, id, column, value);
      const std::string text = failure_of(simulation);
      EXPECT_TRUE(text.starts_with(fmt::format("step 4: point {} of body {} at (", id, body))) << text;
      EXPECT_NE(text.find(expected), std::string::npos) << text;
    }
}

template <int Dim>
Case two_balls() {
  Case c = colliding_balls(Dim, Dim == 2 ? 16 : 10, 4);
  c.time.dt = 1e-4;  // nothing but the guard looks at the speeds
  return c;
}

TEST(FaultsOnRanks, InvertedPoint) {
  check_fault<2>(two_balls<2>(), PointColumns<2>::deformation, -1, "is inverted: det F = -");
  check_fault<3>(two_balls<3>(), PointColumns<3>::deformation, -1, "is inverted: det F = -");
}
TEST(FaultsOnRanks, VelocityThatIsNoNumber) {
  check_fault<2>(two_balls<2>(), PointColumns<2>::velocity + 1, nan, "is not finite: velocity (");
  check_fault<3>(two_balls<3>(), PointColumns<3>::velocity, nan, "is not finite: velocity (");
}
TEST(FaultsOnRanks, DeformationThatIsNotFinite) {
  check_fault<2>(two_balls<2>(), PointColumns<2>::deformation + 4, nan, "is not finite: det F = (nan)");
  check_fault<3>(two_balls<3>(), PointColumns<3>::deformation, std::numeric_limits<double>::infinity(),
                 "is not finite");
}
TEST(FaultsOnRanks, StressThatIsNotFinite) {
  Case c = two_balls<2>();
  c.materials[0].model = "hypoelastic";  // whose stress follows from the stress before
  check_fault<2>(c, PointColumns<2>::stress, nan, "is not finite: stress (nan");
}
TEST(FaultsOnRanks, EveryStressUpdateStops) {
  for (StressUpdate update : {StressUpdate::first, StressUpdate::last, StressUpdate::modified_last}) {
    Case c = two_balls<2>();
    c.solver.stress_update = update;
    Simulation<2> simulation(c, MPI_COMM_WORLD);
    set_number(simulation, 7, PointColumns<2>::velocity, nan);
    EXPECT_TRUE(failure_of(simulation).starts_with("step 1: point ")) << static_cast<int>(update);
  }
}
TEST(FaultsOnRanks, RunLeavesTheState) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  int process = static_cast<int>(getpid());
  MPI_Bcast(&process, 1, MPI_INT, 0, MPI_COMM_WORLD);
  const fs::path out = fs::temp_directory_path() / fmt::format("cairn_fault_{}", process);
  if (rank == 0) fs::create_directories(out);
  MPI_Barrier(MPI_COMM_WORLD);
  Case c = two_balls<2>();
  c.time.steps = 100;
  {
    Simulation<2> simulation(c, MPI_COMM_WORLD);
    simulation.step(1e300);
    RunState state;
    note_simulation(simulation, state);
    state.stage = StageKeeper(c, nullptr).state(), state.bodies = bodies_checksum(c);
    set_number(simulation, 150, PointColumns<2>::velocity, 1e8);  // a state that may be, but not for long
    write_checkpoint(out / "checkpoint_000000.h5", simulation, state, c.resolved);
    set_number(simulation, 150, PointColumns<2>::deformation, -1);  // one that may not
    write_checkpoint(out / "inverted.h5", simulation, state, c.resolved);
  }
  RunSettings settings;
  settings.out = out, settings.restart = out / "inverted.h5";
  EXPECT_THROW(run_case(c, settings, MPI_COMM_WORLD), InputError);
  settings.restart = "latest";
  std::string text;
  try {
    run_case(c, settings, MPI_COMM_WORLD);
  } catch (const RunError& error) {
    text = error.what();
  }
  EXPECT_TRUE(text.starts_with("step 2: point ")) << text;
  EXPECT_NE(text.find("; the state then is in failure_particles.vtkhdf"), std::string::npos) << text;
  EXPECT_TRUE(fs::exists(out / "failure_particles.vtkhdf"));
  MPI_Barrier(MPI_COMM_WORLD);
  if (rank == 0) fs::remove_all(out);
}

}  // namespace
}  // namespace cairn
