#include "cairn/parallel/balance.hpp"

#include <algorithm>
#include <bit>
#include <map>

#include "cairn/parallel/communicator.hpp"
#include "cairn/parallel/crack_exchange.hpp"

namespace cairn {
namespace {

constexpr int move_tag = 12;

template <int Dim>
void put_piece(const Piece<Dim>& piece, Message& message) {
  const Points<Dim>& points = piece.points;
  for (std::int64_t value : {piece.body, points.size(), points.columns()}) message.put(value);
  for (int c = 0; c < points.columns(); ++c)
    std::copy_n(points.column(c), points.size(), message.extend(points.size()));
  for (auto id : points.ids()) message.put(id);
  for (const auto& image : points.images())
    for (const std::int64_t word : std::bit_cast<ImageWords>(image)) message.put(word);
}

/// Pieces with points only: ghosts come back with the next exchange.
template <int Dim>
void put_patch(const Patch<Dim>& patch, Message& message) {
  message.put(patch.id);
  for (const auto& column : ledger_columns) message.put(patch.ledger.*column.value);
  message.put(static_cast<std::int64_t>(patch.tools.size()));
  for (const auto& [tool, sum] : patch.tools) {
    message.put(std::int64_t{tool});
    for (double value : sum.total) message.put(value);
    for (double value : sum.last) message.put(value);
  }
  message.put(static_cast<std::int64_t>(patch.contacts.size()));
  for (const auto& [pair, sum] : patch.contacts) {
    message.put(std::int64_t{pair.first}), message.put(std::int64_t{pair.second});
    for (double value : sum.values) message.put(value);
  }
  message.put(static_cast<std::int64_t>(std::count_if(patch.pieces.begin(), patch.pieces.end(),
                                                      [](const auto& piece) { return piece.points.size() > 0; })));
  for (const auto& piece : patch.pieces)
    if (piece.points.size() > 0) put_piece(piece, message);
  message.put(static_cast<std::int64_t>(patch.cracks.size()));
  for (const auto& point : patch.cracks) put_crack_point(point, message);
}

template <int Dim>
Patch<Dim> take_patch(const Message& message, std::size_t& at, const Lattice<Dim>& lattice) {
  Patch<Dim> patch(message.integer(at++), lattice);
  for (const auto& column : ledger_columns) patch.ledger.*column.value = *message.data(at++);
  for (std::int64_t n = message.integer(at++); n > 0; --n) {
    auto& sum = patch.tools[static_cast<int>(message.integer(at++))];
    for (double& value : sum.total) value = *message.data(at++);
    for (double& value : sum.last) value = *message.data(at++);
  }
  for (std::int64_t n = message.integer(at++); n > 0; --n) {
    const int a = static_cast<int>(message.integer(at++)), b = static_cast<int>(message.integer(at++));
    auto& sum = patch.contacts[{a, b}];
    for (double& value : sum.values) value = *message.data(at++);
  }
  for (std::int64_t n = message.integer(at++); n > 0; --n) {
    const int body = static_cast<int>(message.integer(at++)), count = static_cast<int>(message.integer(at++));
    const int columns = static_cast<int>(message.integer(at++));
    auto& points = patch.piece_of(body, columns - PointColumns<Dim>::state).points;
    points.resize(count);
    for (int c = 0; c < columns; ++c, at += count) std::copy_n(message.data(at), count, points.column(c));
    for (auto& id : points.ids()) id = message.integer(at++);
    for (auto& image : points.images()) {
      image = std::bit_cast<Image>(ImageWords{message.integer(at), message.integer(at + 1)});
      at += 2;
    }
  }
  for (std::int64_t n = message.integer(at++); n > 0; --n) patch.cracks.push_back(take_crack_point<Dim>(message, at));
  return patch;
}

}  // namespace

double imbalance_of(const std::vector<std::int64_t>& work, const std::vector<int>& owner, int ranks) {
  std::vector<double> load(ranks, 0);
  double total = 0;
  for (std::size_t p = 0; p < work.size(); ++p) load[owner[p]] += work[p], total += work[p];
  return total > 0 ? *std::max_element(load.begin(), load.end()) * ranks / total : 1.0;
}

std::vector<int> keep_in_place(const std::vector<int>& parts, const std::vector<int>& owner,
                               const std::vector<std::int64_t>& work, int ranks) {
  std::map<std::pair<int, int>, std::int64_t> overlaps;  // work of a part that a rank has already
  for (std::size_t p = 0; p < parts.size(); ++p) overlaps[{parts[p], owner[p]}] += 1 + work[p];
  std::vector<std::pair<std::int64_t, std::pair<int, int>>> largest;
  for (const auto& [pair, sum] : overlaps) largest.emplace_back(-sum, pair);
  std::ranges::sort(largest);
  std::vector<int> rank_of(ranks, -1);
  std::vector<bool> taken(ranks, false);
  for (const auto& [sum, pair] : largest)
    if (const auto [part, rank] = pair; rank_of[part] < 0 && !taken[rank]) rank_of[part] = rank, taken[rank] = true;
  int free = 0;
  for (int& rank : rank_of) {
    if (rank >= 0) continue;
    while (taken[free]) ++free;
    rank = free++;
  }
  std::vector<int> renamed(parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p) renamed[p] = rank_of[parts[p]];
  return renamed;
}

template <int Dim>
void move_patches(std::vector<Patch<Dim>>& patches, PatchTable<Dim>& table, const std::vector<int>& new_owner,
                  const Lattice<Dim>& lattice, MPI_Comm comm) {
  const std::vector<int> owner = table.owners();
  table.assign(new_owner);
  int rank = 0, ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  std::vector<Message> outgoing(ranks);
  for (const auto& patch : patches)
    if (const int to = table.owner(patch.id); to != rank) put_patch(patch, outgoing[to]);
  std::erase_if(patches, [&](const auto& patch) { return table.owner(patch.id) != rank; });

  // Every rank knows from the two tables whom it will hear from.
  std::vector<bool> hears_from(ranks, false);
  for (std::size_t p = 0; p < owner.size(); ++p)
    if (new_owner[p] == rank && owner[p] != rank) hears_from[owner[p]] = true;
  std::vector<MPI_Request> requests;
  for (int r = 0; r < ranks; ++r)
    if (outgoing[r].size() > 0)
      MPI_Isend(outgoing[r].data(0), static_cast<int>(outgoing[r].size()), MPI_DOUBLE, r, move_tag, comm,
                &requests.emplace_back());
  for (int r = 0; r < ranks; ++r) {
    if (!hears_from[r]) continue;
    MPI_Status status;
    int count = 0;
    MPI_Probe(r, move_tag, comm, &status);
    MPI_Get_count(&status, MPI_DOUBLE, &count);
    Message message;
    MPI_Recv(message.extend(count), count, MPI_DOUBLE, r, move_tag, comm, MPI_STATUS_IGNORE);
    for (std::size_t at = 0; at < message.size();) patches.push_back(take_patch(message, at, lattice));
  }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
  std::sort(patches.begin(), patches.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
}

template void move_patches(std::vector<Patch<2>>&, PatchTable<2>&, const std::vector<int>&, const Lattice<2>&,
                           MPI_Comm);
template void move_patches(std::vector<Patch<3>>&, PatchTable<3>&, const std::vector<int>&, const Lattice<3>&,
                           MPI_Comm);

}  // namespace cairn
