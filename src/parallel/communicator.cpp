#include "cairn/parallel/communicator.hpp"

#include <algorithm>
#include <exception>
#include <limits>

#include "cairn/core/error.hpp"

namespace cairn {
namespace {

constexpr int exchange_tag = 11;

}  // namespace

NeighbourExchange::NeighbourExchange(MPI_Comm comm, std::vector<int> neighbours)
    : comm_(comm),
      neighbours_(std::move(neighbours)),
      outgoing_(neighbours_.size() + 1),
      incoming_(neighbours_.size() + 1) {
  MPI_Comm_rank(comm_, &rank_);
}

NeighbourExchange::~NeighbourExchange() {
  if (std::uncaught_exceptions() == 0) {
    wait();
    return;
  }
  // On the way out of an error of this rank alone nobody may be there to receive what was sent.
  constexpr double patience = 1;  // [s]
  int sent = 0;
  for (const double start = MPI_Wtime(); !sent && MPI_Wtime() - start < patience;)
    MPI_Testall(static_cast<int>(requests_.size()), requests_.data(), &sent, MPI_STATUSES_IGNORE);
  if (!sent) new std::vector<Message>(std::move(outgoing_));  // kept for MPI to the end
}

std::size_t NeighbourExchange::slot(int rank) const {
  if (rank == rank_) return neighbours_.size();
  const auto at = std::lower_bound(neighbours_.begin(), neighbours_.end(), rank);
  if (at == neighbours_.end() || *at != rank) throw RunError("a message is addressed to a rank that is no neighbour");
  return static_cast<std::size_t>(at - neighbours_.begin());
}

void NeighbourExchange::wait() {
  MPI_Waitall(static_cast<int>(requests_.size()), requests_.data(), MPI_STATUSES_IGNORE);
  requests_.clear();
}

void NeighbourExchange::begin() {
  wait();
  for (auto& message : outgoing_) message.clear();
}

void NeighbourExchange::start() {
  requests_.resize(neighbours_.size());
  for (std::size_t i = 0; i < neighbours_.size(); ++i) {
    auto& words = outgoing_[i].words();
    if (words.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
      throw RunError("a message to a neighbour exceeds 16 GiB: use more ranks");
    MPI_Isend(words.data(), static_cast<int>(words.size()), MPI_DOUBLE, neighbours_[i], exchange_tag, comm_,
              &requests_[i]);
    ++traffic_.messages;
    traffic_.bytes += static_cast<std::int64_t>(words.size()) * 8;
  }
}

void NeighbourExchange::finish() {
  for (std::size_t i = 0; i < neighbours_.size(); ++i) {
    MPI_Message handle;
    MPI_Status status;
    int count = 0;
    MPI_Mprobe(neighbours_[i], exchange_tag, comm_, &handle, &status);
    MPI_Get_count(&status, MPI_DOUBLE, &count);
    incoming_[i].words().resize(static_cast<std::size_t>(count));
    MPI_Mrecv(incoming_[i].words().data(), count, MPI_DOUBLE, &handle, MPI_STATUS_IGNORE);
  }
  std::swap(incoming_.back(), outgoing_.back());
}

}  // namespace cairn
