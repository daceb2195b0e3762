#include "report.hpp"

#include <fmt/format.h>
#include <mpi.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <thread>

#include "cairn/core/error.hpp"
#include "cairn/core/printable.hpp"
#include "commands.hpp"

namespace cairn::app {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto patience = std::chrono::seconds(5), patience_alone = std::chrono::seconds(1);
constexpr int failed_tag = 13;

/// A communicator of its own, so that reports never meet messages of the work.
MPI_Comm report_communicator() {
  static const MPI_Comm comm = [] {
    MPI_Comm copy = MPI_COMM_NULL;
    MPI_Comm_dup(MPI_COMM_WORLD, &copy);
    return copy;
  }();
  return comm;
}

void print(const Failure& failure) {
  std::fflush(stdout);
  std::fputs((printable(failure.text, true) + "\n").c_str(), stderr);
  std::fflush(stderr);
}

/// Whether a rank below this one has failed alone as well, and speaks for all. Ranks that fail at the same time hear of
/// each other.
bool lower_rank_speaks() {
  const MPI_Comm comm = report_communicator();
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  for (int higher = rank() + 1; higher < ranks; ++higher) {
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Isend(nullptr, 0, MPI_BYTE, higher, failed_tag, comm, &request);
    MPI_Request_free(&request);
  }
  int heard = 0;
  for (const auto start = Clock::now(); !heard && Clock::now() - start < std::chrono::milliseconds(500);) {
    MPI_Iprobe(MPI_ANY_SOURCE, failed_tag, comm, &heard, MPI_STATUS_IGNORE);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return heard != 0;
}

/// Ends the job where ranks failed that the others wait for.
void end_job(const Failure& failure) {
  if (lower_rank_speaks())
    std::this_thread::sleep_for(patience);  // its end is that of all
  else
    print(failure);
  MPI_Abort(MPI_COMM_WORLD, failed);
}

/// Waits for all ranks; those that failed end the job when the others do not come in time.
void wait_for_all(MPI_Request& request, const std::optional<Failure>& failure) {
  const auto start = Clock::now();
  for (int arrived = 0; !arrived;) {
    MPI_Test(&request, &arrived, MPI_STATUS_IGNORE);
    if (arrived) return;
    if (failure && Clock::now() - start > (failure->alone ? patience_alone : patience)) end_job(*failure);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// Memory set aside for the report that there is none; MPI_Abort, too, needs some.
std::vector<char>& reserve() {
  static std::vector<char> bytes;
  return bytes;
}

bool out_of_memory = false;

/// Ends the job where memory runs out on one of several ranks: the others would wait for it for ever, and it could not
/// even take its objects apart, whose messages they do not answer.
void end_job_without_memory() {
  std::vector<char>().swap(reserve());
  out_of_memory = true;
  std::fputs("cairn failed: a rank is out of memory; use fewer points, or more ranks on more machines\n", stderr);
  MPI_Abort(MPI_COMM_WORLD, failed);
}

}  // namespace

void prepare_for_failures() {
  int ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  if (ranks == 1) return;
  reserve().reserve(std::size_t{8} << 20);
  // MPI_Abort may find too little memory to say what it does, and then ends the program with a code of its own.
  std::atexit([] {
    if (out_of_memory) std::_Exit(failed);
  });
  std::set_new_handler(end_job_without_memory);
}

int rank() {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}

std::optional<Failure> attempt(const std::function<void()>& work) {
  try {
    work();
    return std::nullopt;
  } catch (const InputError& error) {
    const std::size_t count = error.messages().size();
    return Failure{wrong_input, fmt::format("{}\ncairn: {} error{} in the input; nothing was created", error.what(),
                                            count, count == 1 ? "" : "s")};
  } catch (const RunError& error) {
    return Failure{failed, fmt::format("cairn failed: {}", error.what())};
  } catch (const RankError& error) {
    return Failure{failed, fmt::format("cairn failed: {}", error.what()), true};
  } catch (const std::bad_alloc&) {
    return Failure{failed, "cairn failed: out of memory; use fewer points or more ranks"};
  } catch (const std::exception& error) {
    return Failure{failed, fmt::format("cairn failed: {}", error.what())};
  }
}

int settle(const std::optional<Failure>& failure) {
  const MPI_Comm comm = report_communicator();
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  const int candidate = failure ? rank() : ranks;
  int first = ranks;  // lowest rank that failed
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallreduce(&candidate, &first, 1, MPI_INT, MPI_MIN, comm, &request);
  wait_for_all(request, failure);
  if (first == ranks) return done;
  if (rank() == first) print(*failure);
  int code = failure ? failure->code : done;
  MPI_Bcast(&code, 1, MPI_INT, first, comm);
  return code;
}

int on_first_rank(const std::function<void()>& work) { return settle(rank() == 0 ? attempt(work) : std::nullopt); }

void print_warnings(const std::vector<std::string>& warnings) {
  if (rank() != 0) return;
  for (const auto& warning : warnings) std::fputs(("warning: " + printable(warning) + "\n").c_str(), stderr);
}

}  // namespace cairn::app
