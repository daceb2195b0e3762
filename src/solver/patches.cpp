// Which patches a rank has: new ones, blank ones, and their balance.

#include <algorithm>
#include <set>

#include "cairn/parallel/balance.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {

/// Points are in patches that had none before: their neighbours have to exist before nodes are exchanged.
template <int Dim>
void Simulation<Dim>::add_new_patches() {
  const auto time = timers_.measure(Stage::migrate);
  maxima_[5] = 0;
  for (const PatchId id : table_.fill(gather_on_all(migration_->entered(), comm_)))
    if (table_.owner(id) == rank_) patches_.emplace_back(id, lattice_);
  std::ranges::sort(patches_, {}, &Patch<Dim>::id);
  connect_patches();
}

template <int Dim>
void Simulation<Dim>::connect_patches() {
  std::set<int> neighbours;
  for (const auto& patch : patches_)
    for (const auto& link : patch.links)
      if (table_.find(link.patch) >= 0) neighbours.insert(table_.owner(link.patch));
  neighbours.erase(rank_);
  sweeps_.assign(patches_.size(), {}), segments_.assign(patches_.size(), {});
  face_motions_.assign(patches_.size(), {}), row_forces_.assign(patches_.size(), {});
  const Traffic traffic = messages_ ? messages_->traffic() : Traffic{};
  messages_ = std::make_unique<NeighbourExchange>(comm_, std::vector<int>(neighbours.begin(), neighbours.end()));
  messages_->traffic() = traffic;
  traction_messages_ =
      std::make_unique<NeighbourExchange>(comm_, std::vector<int>(neighbours.begin(), neighbours.end()), 1);
  exchange_ = std::make_unique<NodeExchange<Dim>>(*messages_, table_, patches_);
  beside_others_.clear();
  for (std::size_t p = 0; p < patches_.size(); ++p) beside_others_.push_back(exchange_->beside_others(p));
  Exits<Dim> exits;
  for (int face = 0; face < 2 * Dim; ++face)
    exits.open[face] = contact_.faces[face].type == FaceType::free && contact_.faces[face].leaving == Leaving::remove;
  exits.drop_lost = solver_.lost_points == LostPoints::drop;
  exits.book = [this](auto&&... departing) { book_departures(departing...); };
  migration_ = std::make_unique<Migration<Dim>>(*messages_, table_, std::move(exits));
}

/// Bodies that move on leave empty patches behind. Where these have become many, those without a history go.
template <int Dim>
void Simulation<Dim>::forget_blank_patches() {
  enum : std::uint8_t { blank, kept, filled };
  std::vector<std::uint8_t> uses(table_.size(), blank);
  for (const auto& patch : patches_)
    uses[table_.find(patch.id)] = patch.point_count() > 0 ? filled : patch.blank() ? blank : kept;
  MPI_Allreduce(MPI_IN_PLACE, uses.data(), static_cast<int>(uses.size()), MPI_UINT8_T, MPI_MAX, comm_);
  constexpr std::size_t few = 64;
  if (static_cast<std::size_t>(std::ranges::count(uses, blank)) < 2 * blank_before_ + few) return;
  std::vector<PatchId> with_points, others;
  for (std::size_t p = 0; p < uses.size(); ++p)
    if (uses[p] != blank) (uses[p] == filled ? with_points : others).push_back(table_.patches()[p]);
  table_.restrict_to(with_points, others);
  blank_before_ = table_.size() - with_points.size() - others.size();
  std::erase_if(patches_, [&](const Patch<Dim>& patch) { return table_.find(patch.id) < 0; });
  connect_patches();
}

/// Looks at the work of all ranks since the last time, and deals the patches out anew where that evens it out.
template <int Dim>
void Simulation<Dim>::balance() {
  const auto time = timers_.measure(Stage::migrate);
  finish_speed_reduction();
  forget_blank_patches();
  if (ranks_ == 1 || parallel_.partition == Partition::round_robin) return;
  std::vector<std::int64_t> work(table_.size(), 0);
  for (auto& patch : patches_) work[table_.find(patch.id)] = static_cast<std::int64_t>(patch.seconds * 1e9);
  MPI_Allreduce(MPI_IN_PLACE, work.data(), static_cast<int>(work.size()), MPI_INT64_T, MPI_SUM, comm_);
  const std::vector<int> before = table_.owners();
  const double now = imbalance_of(work, before, ranks_);
  // A rank that was held up once is no reason to move: half of the time before counts on.
  for (auto& patch : patches_) patch.seconds *= 0.5;
  if (now < parallel_.imbalance || looks_to_skip_-- > 0) return;
  const double start = MPI_Wtime();
  const auto parts = distribute_patches(lattice_, table_.patches(), work, ranks_, parallel_.partition, before);
  const auto owner = keep_in_place(parts, before, work, ranks_);
  if (imbalance_of(work, owner, ranks_) > 0.95 * now) {  // in vain: the next tries come ever later
    looks_skipped_ = std::min(2 * looks_skipped_ + 1, 31);
    looks_to_skip_ = looks_skipped_;
    return;
  }
  looks_skipped_ = looks_to_skip_ = 0;
  move_patches(patches_, table_, owner, lattice_, comm_);
  for (auto& patch : patches_) patch.seconds = 0;
  connect_patches();
  ++times_balanced_;
  seconds_balancing_ += MPI_Wtime() - start;
}

#define CAIRN_INSTANTIATE(Dim)                           \
  template void Simulation<Dim>::add_new_patches();      \
  template void Simulation<Dim>::connect_patches();      \
  template void Simulation<Dim>::forget_blank_patches(); \
  template void Simulation<Dim>::balance();
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
