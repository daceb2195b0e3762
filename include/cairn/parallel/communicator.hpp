#pragma once
/// The ranks of a run, and messages made of eight-byte words.

#include <mpi.h>

#include <bit>
#include <cstdint>
#include <span>
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

/// Waits until all are done. On the way out of an error, which may be that of this rank alone, nobody may be there to
/// answer: then for a second at the most. False where some are not done: what they send and receive must stay to the
/// end.
bool wait_or_leave(std::span<MPI_Request> requests);

/// Tells whether an error is that of all ranks, or of some alone while others wait for them. Both calls collective.
class RollCall {
 public:
  explicit RollCall(MPI_Comm comm);
  ~RollCall();
  RollCall(const RollCall&) = delete;
  RollCall& operator=(const RollCall&) = delete;
  RollCall(RollCall&&) = delete;
  RollCall& operator=(RollCall&&) = delete;

  /// False where some rank does not call it within two seconds: nothing collective can follow then.
  bool all_here();

 private:
  MPI_Comm comm_ = MPI_COMM_NULL;  // of its own: what others wait in is never mistaken for the call
};

/// The numbers of all ranks one after the other, in the order of the ranks, on rank 0; none elsewhere. Collective.
std::vector<std::int64_t> gather_on_first(std::span<const std::int64_t> mine, MPI_Comm comm);
std::vector<double> gather_on_first(std::span<const double> mine, MPI_Comm comm);

/// The whole numbers of all ranks one after the other, in the order of the ranks. Collective.
std::vector<std::int64_t> gather_on_all(std::span<const std::int64_t> mine, MPI_Comm comm);
std::vector<double> gather_on_all(std::span<const double> mine, MPI_Comm comm);

/// The largest of each of a few numbers over all ranks, found while other work is done.
class MaximumReduction {
 public:
  explicit MaximumReduction(std::size_t size) : mine_(size, 0.0), largest_(size, 0.0) {}
  ~MaximumReduction();
  MaximumReduction(const MaximumReduction&) = delete;
  MaximumReduction& operator=(const MaximumReduction&) = delete;
  MaximumReduction(MaximumReduction&&) = delete;
  MaximumReduction& operator=(MaximumReduction&&) = delete;

  /// Starts with this rank's numbers, as many as at the construction. Collective, not while one is under way.
  void start(std::span<const double> mine, MPI_Comm comm);
  bool under_way() const { return request_ != MPI_REQUEST_NULL; }
  /// Collective.
  void finish() { MPI_Wait(&request_, MPI_STATUS_IGNORE); }
  /// The numbers that the last `finish` found.
  double operator[](std::size_t i) const { return largest_[i]; }
  double& operator[](std::size_t i) { return largest_[i]; }

 private:
  std::vector<double> mine_, largest_;
  MPI_Request request_ = MPI_REQUEST_NULL;
};

/// One message to and from each neighbouring rank, and one to itself that never leaves memory.
/// Protocol: every exchange sends exactly one message (possibly empty) to each neighbour; its length travels with it.
/// Messages between two ranks stay in order, so exchanges need no tags of their own.
class NeighbourExchange {
 public:
  /// \param neighbours  ascending, without the rank itself
  /// \param channel     exchanges of several objects may be under way at a time on channels of their own
  NeighbourExchange(MPI_Comm comm, std::vector<int> neighbours, int channel = 0);
  ~NeighbourExchange();
  NeighbourExchange(const NeighbourExchange&) = delete;
  NeighbourExchange& operator=(const NeighbourExchange&) = delete;
  NeighbourExchange(NeighbourExchange&&) = delete;
  NeighbourExchange& operator=(NeighbourExchange&&) = delete;

  /// The message for a rank: this one, emptied by `begin`, or a neighbour, emptied by `receive`.
  Message& outgoing(int rank) { return outgoing_[slot(rank)]; }
  /// The last message from a rank: this one, since `start`, or a neighbour, since `receive`. It stays while the next
  /// ones are written.
  const Message& incoming(int rank) const { return incoming_[slot(rank)]; }
  const std::vector<int>& neighbours() const { return neighbours_; }
  int rank() const { return rank_; }
  Traffic& traffic() { return traffic_; }

  /// Empties the message to this rank.
  void begin() { outgoing_.back().clear(); }
  /// Starts sending. The message to this rank has arrived.
  void start();
  /// Receives one message from each neighbour, and waits until its own are sent. Nothing where none is under way, and
  /// false then.
  bool receive();

 private:
  std::size_t slot(int rank) const;

  MPI_Comm comm_;
  int rank_ = 0, tag_;
  std::vector<int> neighbours_;
  std::vector<Message> outgoing_, incoming_;  // by neighbour, and this rank's own at the end
  std::vector<MPI_Request> requests_;
  bool under_way_ = false;
  Traffic traffic_;
};

}  // namespace cairn
