#include "cairn/parallel/communicator.hpp"

#include <algorithm>
#include <exception>
#include <limits>
#include <numeric>

#include "cairn/core/error.hpp"

namespace cairn {
namespace {

constexpr int exchange_tag = 11;

/// Keeps what MPI may still read or write until the program ends.
template <class T>
void keep_to_the_end(T buffers) {
  static std::vector<T> kept;
  kept.push_back(std::move(buffers));
}

}  // namespace

bool wait_or_leave(std::span<MPI_Request> requests) {
  constexpr double patience = 1;  // [s]
  const bool failing = std::uncaught_exceptions() > 0;
  int done = 0;
  for (const double start = MPI_Wtime(); !done && !(failing && MPI_Wtime() - start > patience);)
    MPI_Testall(static_cast<int>(requests.size()), requests.data(), &done, MPI_STATUSES_IGNORE);
  return done != 0;
}

namespace {

template <class T>
std::vector<T> gather_first(std::span<const T> mine, MPI_Datatype type, MPI_Comm comm) {
  int rank = 0, ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  std::vector<int> counts(ranks), starts(ranks, 0);
  const int count = static_cast<int>(mine.size());
  MPI_Gather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, comm);
  std::partial_sum(counts.begin(), counts.end() - 1, starts.begin() + 1);
  std::vector<T> all(rank == 0 ? starts.back() + counts.back() : 0);
  MPI_Gatherv(mine.data(), count, type, all.data(), counts.data(), starts.data(), type, 0, comm);
  return all;
}

template <class T>
std::vector<T> gather_all(std::span<const T> mine, MPI_Datatype type, MPI_Comm comm) {
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  std::vector<int> counts(ranks), starts(ranks, 0);
  const int count = static_cast<int>(mine.size());
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, comm);
  std::partial_sum(counts.begin(), counts.end() - 1, starts.begin() + 1);
  std::vector<T> all(starts.back() + counts.back());
  MPI_Allgatherv(mine.data(), count, type, all.data(), counts.data(), starts.data(), type, comm);
  return all;
}

}  // namespace

std::vector<std::int64_t> gather_on_first(std::span<const std::int64_t> mine, MPI_Comm comm) {
  return gather_first(mine, MPI_INT64_T, comm);
}
std::vector<double> gather_on_first(std::span<const double> mine, MPI_Comm comm) {
  return gather_first(mine, MPI_DOUBLE, comm);
}

std::vector<std::int64_t> gather_on_all(std::span<const std::int64_t> mine, MPI_Comm comm) {
  return gather_all(mine, MPI_INT64_T, comm);
}
std::vector<double> gather_on_all(std::span<const double> mine, MPI_Comm comm) {
  return gather_all(mine, MPI_DOUBLE, comm);
}

RollCall::RollCall(MPI_Comm comm) { MPI_Comm_dup(comm, &comm_); }

RollCall::~RollCall() {
  if (std::uncaught_exceptions() == 0) MPI_Comm_free(&comm_);
}

bool RollCall::all_here() {
  constexpr double patience = 2;  // [s]
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibarrier(comm_, &request);
  int here = 0;
  for (const double start = MPI_Wtime(); !here && MPI_Wtime() - start < patience;)
    MPI_Test(&request, &here, MPI_STATUS_IGNORE);
  return here != 0;
}

void MaximumReduction::start(std::span<const double> mine, MPI_Comm comm) {
  std::copy(mine.begin(), mine.end(), mine_.begin());
  MPI_Iallreduce(mine_.data(), largest_.data(), static_cast<int>(mine_.size()), MPI_DOUBLE, MPI_MAX, comm, &request_);
}

MaximumReduction::~MaximumReduction() {
  if (wait_or_leave({&request_, 1})) return;
  keep_to_the_end(std::move(mine_));
  keep_to_the_end(std::move(largest_));
}

NeighbourExchange::NeighbourExchange(MPI_Comm comm, std::vector<int> neighbours, int channel)
    : comm_(comm),
      tag_(exchange_tag + channel),
      neighbours_(std::move(neighbours)),
      outgoing_(neighbours_.size() + 1),
      incoming_(neighbours_.size() + 1) {
  MPI_Comm_rank(comm_, &rank_);
}

NeighbourExchange::~NeighbourExchange() {
  if (!wait_or_leave(requests_)) keep_to_the_end(std::move(outgoing_));
}

std::size_t NeighbourExchange::slot(int rank) const {
  if (rank == rank_) return neighbours_.size();
  const auto at = std::lower_bound(neighbours_.begin(), neighbours_.end(), rank);
  if (at == neighbours_.end() || *at != rank) throw RankError("a message is addressed to a rank that is no neighbour");
  return static_cast<std::size_t>(at - neighbours_.begin());
}

void NeighbourExchange::start() {
  requests_.resize(neighbours_.size());
  for (std::size_t i = 0; i < neighbours_.size(); ++i) {
    auto& words = outgoing_[i].words();
    if (words.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
      throw RankError("a message to a neighbour exceeds 16 GiB: use more ranks");
    MPI_Isend(words.data(), static_cast<int>(words.size()), MPI_DOUBLE, neighbours_[i], tag_, comm_, &requests_[i]);
    ++traffic_.messages;
    traffic_.bytes += static_cast<std::int64_t>(words.size()) * 8;
  }
  std::swap(incoming_.back(), outgoing_.back());
  under_way_ = true;
}

bool NeighbourExchange::receive() {
  if (!under_way_) return false;
  for (std::size_t i = 0; i < neighbours_.size(); ++i) {
    MPI_Message handle;
    MPI_Status status;
    int count = 0;
    MPI_Mprobe(neighbours_[i], tag_, comm_, &handle, &status);
    MPI_Get_count(&status, MPI_DOUBLE, &count);
    incoming_[i].words().resize(static_cast<std::size_t>(count));
    MPI_Mrecv(incoming_[i].words().data(), count, MPI_DOUBLE, &handle, MPI_STATUS_IGNORE);
  }
  MPI_Waitall(static_cast<int>(requests_.size()), requests_.data(), MPI_STATUSES_IGNORE);
  for (std::size_t i = 0; i < neighbours_.size(); ++i) outgoing_[i].clear();
  under_way_ = false;
  return true;
}

}  // namespace cairn
