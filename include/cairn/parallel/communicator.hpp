#pragma once
/// The ranks of a run, and messages made of eight-byte words.

#include <mpi.h>

#include <bit>
#include <cstdint>
#include <vector>

#include "cairn/core/aligned.hpp"

namespace cairn {

/// A message under construction or received: integers and doubles, eight bytes each.
class Message {
 public:
  void clear() { words_.clear(); }
  void put(std::int64_t value) { words_.push_back(std::bit_cast<double>(value)); }
  void put(double value) { words_.push_back(value); }
  /// Room for n more doubles; valid until the next change.
  double* extend(std::size_t n) {
    words_.resize(words_.size() + n);
    return words_.data() + words_.size() - n;
  }
  std::int64_t integer(std::size_t at) const { return std::bit_cast<std::int64_t>(words_[at]); }
  const double* data(std::size_t at) const { return words_.data() + at; }
  AlignedDoubles& words() { return words_; }
  std::size_t size() const { return words_.size(); }

 private:
  AlignedDoubles words_;
};

/// Counts of what was sent, for the cost model.
struct Traffic {
  std::int64_t messages = 0, bytes = 0;
};

/// One message to and from each neighbouring rank, and one to itself that never leaves memory.
/// Protocol: every exchange sends exactly one message (possibly empty) to each neighbour; its length travels with it.
/// Messages between two ranks stay in order, so exchanges need no tags of their own.
class NeighbourExchange {
 public:
  NeighbourExchange(MPI_Comm comm, std::vector<int> neighbours);  // neighbours: ascending, without the rank itself
  ~NeighbourExchange();
  NeighbourExchange(const NeighbourExchange&) = delete;
  NeighbourExchange& operator=(const NeighbourExchange&) = delete;
  NeighbourExchange(NeighbourExchange&&) = delete;
  NeighbourExchange& operator=(NeighbourExchange&&) = delete;

  /// The message for a rank (a neighbour or this rank), emptied by `begin`.
  Message& outgoing(int rank) { return outgoing_[slot(rank)]; }
  /// What the last `finish` received; it stays while the next messages are written.
  const Message& incoming(int rank) const { return incoming_[slot(rank)]; }
  const std::vector<int>& neighbours() const { return neighbours_; }
  int rank() const { return rank_; }
  Traffic& traffic() { return traffic_; }

  /// Empties the outgoing messages (waiting for those still under way).
  void begin();
  /// Starts sending.
  void start();
  /// Receives one message from each neighbour.
  void finish();

 private:
  std::size_t slot(int rank) const;
  void wait();

  MPI_Comm comm_;
  int rank_ = 0;
  std::vector<int> neighbours_;
  std::vector<Message> outgoing_, incoming_;  // by neighbour, and this rank's own at the end
  std::vector<MPI_Request> requests_;
  Traffic traffic_;
};

}  // namespace cairn
