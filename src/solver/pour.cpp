// Bodies that come into a running simulation, and those that are taken away. Which body comes, where and when follows
// from the case and the step alone.

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "cairn/core/error.hpp"
#include "cairn/solver/body_states.hpp"
#include "filler.hpp"
#include "point_budget.hpp"

namespace cairn {
namespace {

constexpr int draws = 20;  // of places for a body before it waits for the next attempt

/// Uniform in [0, 1), the same for the same three numbers (SplitMix64, Steele, Lea & Flood 2014).
double uniform(std::uint64_t seed, std::uint64_t body, std::uint64_t draw) {
  std::uint64_t x = seed;
  for (const std::uint64_t number : {body, draw}) {
    x += 0x9e3779b97f4a7c15ULL * (number + 1);
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    x ^= x >> 31;
  }
  return static_cast<double>(x >> 11) * 0x1p-53;
}

}  // namespace

template <int Dim>
void Simulation<Dim>::define_pouring(const Case& c) {
  pouring_.inserts = c.inserts, pouring_.removes = c.removes;
  poured_.assign(c.inserts.size(), {});
  for (std::size_t i = 0; i < c.inserts.size(); ++i) poured_[i].next = c.inserts[i].start;
  if (c.inserts.empty()) return;
  pouring_.domain = c.domain, pouring_.solver = c.solver;
  first_poured_ = c.inserts.front().first;
  pouring_.bodies.assign(c.bodies.begin() + first_poured_, c.bodies.end());
}

/// No point of another body within the shape, or nearer to it than a cell, and no moving wall.
template <int Dim>
bool Simulation<Dim>::has_room(const Shape& shape) const {
  const Bounds box = bounds(shape);
  const Vec3 middle = centre(shape);
  const auto* ball = std::get_if<Ball>(&shape);
  const double margin = lattice_.smallest_spacing();
  bool free = true;
  for (int face = 0; face < 2 * Dim; ++face) {
    const int d = face / 2;
    if (!contact_.faces[face].moves) continue;
    free = free && (face % 2 ? box.upper[d] <= contact_.faces[face].plane : box.lower[d] >= contact_.faces[face].plane);
  }
  for (const auto& patch : patches_)
    for (const auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size() && free; ++p) {
        double outside = 0, squared = 0;
        for (int d = 0; d < Dim; ++d) {
          const double x = piece.points.column(d)[p], way = x - middle[d] - lattice_.periods_between(d, x, middle[d]);
          outside = std::max({outside, middle[d] + way - box.upper[d], box.lower[d] - middle[d] - way});
          squared += way * way;
        }
        free = ball ? squared > std::pow(ball->radius + margin, 2) : outside > margin;
      }
  int everywhere = free ? 1 : 0;
  MPI_Allreduce(MPI_IN_PLACE, &everywhere, 1, MPI_INT, MPI_MIN, comm_);
  return everywhere == 1;
}

/// Every rank counts the points of all patches that the body reaches: it is one body, and numbers need no messages.
template <int Dim>
void Simulation<Dim>::place_body(int number, const Shape& shape) {
  Case one;
  one.domain = pouring_.domain, one.solver = pouring_.solver;
  one.bodies = {pouring_.bodies[number - first_poured_]};
  one.bodies[0].shape = shape, one.bodies[0].insert = -1;
  std::vector<Body> body = {bodies_[number]};
  body[0].centre = centre(shape);
  const Filler<Dim> filler(one, lattice_, body, materials_);
  std::vector<PatchId> filled;
  std::vector<std::int64_t> counts;
  for (const PatchId patch : filler.patches()) {
    std::int64_t count = 0;
    filler.for_points(patch, [&](int, const Vec3&, double, const Vec3&) { ++count; });
    if (count > 0) filled.push_back(patch), counts.push_back(count);
  }
  if (filled.empty())
    throw RunError(
        fmt::format("step {}: body {} holds no material point where it is to come; use smaller cells", steps_, number));
  for (const PatchId id : table_.fill(filled))
    if (table_.owner(id) == rank_) patches_.emplace_back(id, lattice_);
  std::ranges::sort(patches_, {}, &Patch<Dim>::id);
  connect_patches();
  for (std::size_t i = 0; i < filled.size(); next_id_ += counts[i++]) {
    if (table_.owner(filled[i]) != rank_) continue;
    Patch<Dim>& patch = *std::ranges::find(patches_, filled[i], &Patch<Dim>::id);
    filler.fill(patch, next_id_, number);
    Piece<Dim>& piece = patch.piece_of(number, 0);
    piece.projected = false;
    PatchLedger& ledger = patch.ledger;
    for_budgets(
        piece, material_of(piece), false, lattice_, transfer_, piece.points.size(), [](int p) { return p; },
        [&](int, const PointBudget& b) {
          ledger.mass_left -= b.mass, ledger.energy_left -= b.energy(), ledger.blended_and_spun += b.spin;
          ledger.momentum_left_x -= b.momentum[0], ledger.momentum_left_y -= b.momentum[1];
          ledger.momentum_left_z -= b.momentum[2];
        });
  }
  total_points_ += std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
  const Bounds box = bounds(shape);
  const BodySpec& spec = one.bodies[0];
  maxima_[1] =
      std::max(maxima_[1], spec.velocity.norm() + spec.angular_velocity.norm() * (box.upper - box.lower).norm());
}

template <int Dim>
void Simulation<Dim>::insert_bodies() {
  // Steps are as short as the bodies to come need them, be there others or not.
  for (std::size_t i = 0; i < poured_.size(); ++i) {
    const Insert& insert = pouring_.inserts[i];
    if (poured_[i].placed == insert.count) continue;
    finish_speed_reduction();
    for (int b = insert.first + poured_[i].placed; b < insert.first + insert.count; ++b) {
      const SolverMaterial& material = materials_[bodies_[b].material];
      maxima_[0] = std::max(maxima_[0], std::sqrt(material.longitudinal_modulus / material.density));
    }
  }
  for (std::size_t i = 0; i < poured_.size(); ++i) {
    const Insert& insert = pouring_.inserts[i];
    Pouring& state = poured_[i];
    if (steps_ % insert.every != 0) continue;
    int failed = 0;
    while (state.placed < insert.count && time_ >= state.next && failed < draws) {
      finish_speed_reduction();
      const int number = insert.first + state.placed;
      const Shape& given = pouring_.bodies[number - first_poured_].shape;
      Vec3 way = Vec3::Zero();
      if (insert.drawn) {
        const Bounds box = bounds(given);
        for (int d = 0; d < Dim; ++d) {
          const double low = insert.lower[d] - box.lower[d], high = insert.upper[d] - box.upper[d];
          way[d] = low + (high - low) * uniform(insert.seed, number, static_cast<std::uint64_t>(state.drawn) * Dim + d);
        }
        ++state.drawn;
      }
      const Shape shape = shifted(given, way);
      if (!has_room(shape)) {
        failed += insert.drawn ? 1 : draws;
        continue;
      }
      place_body(number, shape);
      ++state.placed;
      state.next = std::max(state.next + insert.interval, time_ - insert.interval);
    }
  }
}

template <int Dim>
void Simulation<Dim>::remove_bodies() {
  const auto due = [&](const Remove& r) { return steps_ % r.every == 0 && time_ >= r.start && time_ <= r.end; };
  if (std::ranges::none_of(pouring_.removes, due)) return;
  finish_speed_reduction();
  std::vector<std::int64_t> mine;
  for (const BodyState& body : body_states(*this))
    for (const Remove& r : pouring_.removes)
      if (!bodies_[body.body].rigid && due(r) && contains(r.region, body.centre)) {
        mine.push_back(body.body);
        break;
      }
  const std::vector<std::int64_t> all = gather_on_all(mine, comm_);
  if (all.empty()) return;
  const std::set<std::int64_t> leaving(all.begin(), all.end());
  for (auto& patch : patches_)
    for (auto& piece : patch.pieces) {
      if (!leaving.contains(piece.body) || piece.points.size() == 0) continue;
      std::vector<Departure> points;
      for (int p = 0; p < piece.points.size(); ++p) points.push_back({p, {}});
      book_departures(patch, piece, points);
      piece.points.resize(0);
      piece.projected = false;
    }
}

template <int Dim>
std::vector<double> Simulation<Dim>::pouring() const {
  std::vector<double> state = {static_cast<double>(next_id_)};
  for (const Pouring& p : poured_)
    state.insert(state.end(), {static_cast<double>(p.placed), static_cast<double>(p.drawn), p.next});
  return state;
}

/// \throws InputError on every rank where it is no state of the case's [[insert]], or further points would have the ids
/// of those that are there
template <int Dim>
void Simulation<Dim>::restore_pouring(const std::vector<double>& state) {
  const auto counts_up_to = [](double x, double most) { return x >= 0 && x <= most && x == std::floor(x); };
  std::int64_t largest_id = -1;
  for (const auto& patch : patches_)
    for (const auto& piece : patch.pieces)
      for (const std::int64_t id : piece.points.ids()) largest_id = std::max(largest_id, id);
  MPI_Allreduce(MPI_IN_PLACE, &largest_id, 1, MPI_INT64_T, MPI_MAX, comm_);
  bool whole = state.size() == 1 + 3 * poured_.size() && counts_up_to(state[0], 0x1p53) &&
               largest_id < static_cast<std::int64_t>(state[0]);
  for (std::size_t i = 0; whole && i < poured_.size(); ++i) {
    const double* from = &state[1 + 3 * i];
    whole = counts_up_to(from[0], pouring_.inserts[i].count) && counts_up_to(from[1], std::numeric_limits<int>::max());
    if (whole) poured_[i] = {static_cast<int>(from[0]), static_cast<int>(from[1]), from[2]};
  }
  if (!whole) throw InputError("the checkpoint's [[insert]] are not those of the case");
  next_id_ = static_cast<std::int64_t>(state[0]);
}

#define CAIRN_INSTANTIATE(Dim)                                   \
  template void Simulation<Dim>::define_pouring(const Case&);    \
  template bool Simulation<Dim>::has_room(const Shape&) const;   \
  template void Simulation<Dim>::place_body(int, const Shape&);  \
  template void Simulation<Dim>::insert_bodies();                \
  template void Simulation<Dim>::remove_bodies();                \
  template std::vector<double> Simulation<Dim>::pouring() const; \
  template void Simulation<Dim>::restore_pouring(const std::vector<double>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
