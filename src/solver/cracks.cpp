// Cracks of a run: what they are, where they begin, and how patches come to know of them.

#include <fmt/format.h>

#include <map>

#include "cairn/core/error.hpp"
#include "cairn/io/agreement.hpp"
#include "cairn/parallel/crack_exchange.hpp"
#include "cairn/solver/simulation.hpp"
#include "tractions.hpp"

namespace cairn {
namespace {

constexpr double on_crack = 1e-3, beside = 0.25;  // cells from a crack at which a point lies on it, or beside it
constexpr double most_on_crack = 0.1;             // of the points beside it

/// How faces meet. An interface that is perfect in a direction binds them there.
CrackContact contact_of(const CrackSpec& spec) {
  using Tie = CrackContact::Tie;
  CrackContact contact;
  contact.law = {ContactLaw::friction, spec.friction};
  if (spec.law == CrackLaw::frictionless || spec.law == CrackLaw::interface) contact.law.friction = 0;
  if (spec.law == CrackLaw::stick) contact.law = {ContactLaw::stick, 0};
  if (spec.law == CrackLaw::free) contact.meets = false;
  if (spec.law != CrackLaw::interface) return contact;
  const bool opens = std::isfinite(spec.interface.opening), slips = std::isfinite(spec.interface.sliding);
  contact.meets = opens && !std::isfinite(spec.interface.closing);
  if (!opens && slips) contact.tie = Tie::normal;
  if (opens && !slips) contact.tie = Tie::slip;
  if (!opens && !slips) contact.meets = true, contact.law = {ContactLaw::stick, 0};
  return contact;
}

}  // namespace

template <int Dim>
void Simulation<Dim>::define_cracks(const Case& c) {
  if (c.cracks.empty()) return;
  specs_ = c.materials, j_radius_ = c.crack.j_radius;
  for (const Body& body : bodies_) crack_densities_.push_back(body.rigid ? 0.0 : materials_[body.material].density);
  for (const CrackSpec& spec : c.cracks) {
    Crack crack;
    crack.ends = {0, initial_crack_points<Dim>(c, &spec - c.cracks.data(), lattice_.smallest_spacing()).back().index};
    if (Dim == 2) crack.open = {spec.ends[0] == CrackEnd::open, spec.ends[1] == CrackEnd::open};
    crack.all_bodies = spec.cuts_all();
    for (std::size_t b = 0; b < c.bodies.size() && !crack.all_bodies; ++b)
      if (spec.cuts(static_cast<int>(b), c.bodies[b].group)) crack.bodies.push_back(static_cast<int>(b));
    contact_.cracks.push_back(contact_of(spec));
    cracks_.push_back(std::move(crack)), growth_.push_back(spec.growth);
  }
  split_every_ = c.crack.split;
  tell_contact_of_cracks();
  define_tractions(c);
}

/// Calls f(point, patch) for every point of the case's cracks, with the patch whose cells hold it.
template <int Dim>
template <class F>
void Simulation<Dim>::for_crack_points(const Case& c, F&& f) const {
  for (std::size_t k = 0; k < c.cracks.size(); ++k)
    for (const auto& point : initial_crack_points<Dim>(c, k, lattice_.smallest_spacing())) {
      Index<Dim> cell;
      for (int d = 0; d < Dim; ++d)
        cell[d] =
            std::clamp(static_cast<int>(std::floor(lattice_.scaled(d, point.plane[d]))), 0, lattice_.cells()[d] - 1);
      f(point, lattice_.patch_of_cell(cell));
    }
}

template <int Dim>
std::vector<PatchId> Simulation<Dim>::patches_of_cracks(const Case& c) const {
  std::vector<PatchId> patches;
  for_crack_points(c, [&](const CrackPoint<Dim>&, PatchId patch) { patches.push_back(patch); });
  std::ranges::sort(patches);
  // std::ranges::unique does not compile with Clang 14 and the library of GCC 12.
  patches.erase(std::unique(patches.begin(), patches.end()), patches.end());
  return patches;
}

/// Gives every crack point to the patch whose cells hold it.
template <int Dim>
void Simulation<Dim>::place_cracks(const Case& c) {
  for_crack_points(c, [&](const CrackPoint<Dim>& point, PatchId id) {
    const auto patch = std::ranges::lower_bound(patches_, id, {}, &Patch<Dim>::id);
    if (patch != patches_.end() && patch->id == id) patch->cracks.push_back(point);
  });
  bind_faces(c);
  receive_cracks();
  check_points_on_cracks(c);
}

/// A crack along a row of points would part nothing there: no rule can say on which side they are. One point on a crack
/// at a slant does no harm, and some are always there; so those count that make up a good part of the nearest ones of a
/// patch.
template <int Dim>
void Simulation<Dim>::check_points_on_cracks(const Case& c) {
  if (cracks_.empty()) return;
  struct Count {
    int on = 0, beside = 0;
    Vec<Dim> first = Vec<Dim>::Zero();
  };
  std::string error;
  const double h = lattice_.smallest_spacing();
  for (auto& patch : patches_) {
    find_cracks(patch);
    const auto& segments = segments_of(patch);
    std::map<std::pair<int, int>, Count> counts;  // by crack and body
    for (const auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size() && !is_rigid(piece); ++p) {
        Vec<Dim> x;
        for (int d = 0; d < Dim; ++d) x[d] = piece.points.column(d)[p];
        for (const int s : segments.near(x, lattice_)) {
          const auto& segment = segments.all()[s];
          const double away = segment.distance_to(x);
          if (!cracks_[segment.crack].cuts(piece.body) || !(away < beside * h)) continue;
          Count& count = counts[{segment.crack, piece.body}];
          if (away < on_crack * h && count.on++ == 0) count.first = x;
          ++count.beside;
        }
      }
    for (const auto& [at, count] : counts)
      if (error.empty() && count.on > 1 && count.on > most_on_crack * count.beside)
        error = fmt::format(
            "{}: crack {} goes along material points of body {}, from {:.6g}, {:.6g} m on, and would not part it "
            "there; "
            "shift the crack by {:.3g} m across its line",
            c.cracks[at.first].source, at.first, at.second, count.first[0], count.first[1], 0.1 * h);
  }
  const std::string common = common_error(comm_, error);
  if (!common.empty()) throw InputError(common);
}

template <int Dim>
void Simulation<Dim>::find_cracks(Patch<Dim>& patch) {
  if (!cracks_.empty()) segments_of(patch) = CrackSegments<Dim>(patch, lattice_, cracks_);
}

/// Cracks go with the material, as it moves in this step.
template <int Dim>
void Simulation<Dim>::move_cracks() {
  if (cracks_.empty()) return;
  exchange_face_velocities(*messages_, table_, patches_, lattice_, face_motions_);
  for (auto& patch : patches_) {
    borrow_face_velocities(patch.cracks);
    keep_idle_bonds_closed(patch.cracks);
    for (auto& point : patch.cracks)
      if (point.own) point.move(dt_);
  }
  for (auto& told : face_motions_) told.clear();
  receive_cracks();
}

template <int Dim>
void Simulation<Dim>::receive_cracks() {
  if (cracks_.empty()) return;
  const std::string failure = exchange_cracks(*messages_, table_, patches_, lattice_);
  if (fault_urgency_ == 0 && !failure.empty()) fault_urgency_ = 1, fault_ = failure;
  for (auto& patch : patches_)
    if (!patch.cracks.empty())
      for (auto& piece : patch.pieces) piece.projected = false;
  follow_openings();
}

template <int Dim>
void Simulation<Dim>::restore_cracks(const std::vector<double>& states) {
  bool whole = states.size() == cracks_.size() * Crack::state_size;
  for (std::size_t k = 0; whole && k < cracks_.size(); ++k) {
    const double* state = &states[k * Crack::state_size];
    whole = std::all_of(state, state + Crack::state_size, [](double x) { return std::abs(x) < 1e9; });
    if (whole) cracks_[k].restore(state);
    whole = whole && cracks_[k].ends[0] < cracks_[k].ends[1];
  }
  if (!whole) throw InputError("the checkpoint's cracks are not those of the case");
}

template <int Dim>
std::vector<double> Simulation<Dim>::crack_states() const {
  std::vector<double> states(cracks_.size() * Crack::state_size);
  for (std::size_t k = 0; k < cracks_.size(); ++k) cracks_[k].state_of(&states[k * Crack::state_size]);
  return states;
}

#define CAIRN_INSTANTIATE(Dim)                                                         \
  template void Simulation<Dim>::define_cracks(const Case&);                           \
  template std::vector<PatchId> Simulation<Dim>::patches_of_cracks(const Case&) const; \
  template void Simulation<Dim>::place_cracks(const Case&);                            \
  template void Simulation<Dim>::check_points_on_cracks(const Case&);                  \
  template void Simulation<Dim>::find_cracks(Patch<Dim>&);                             \
  template void Simulation<Dim>::move_cracks();                                        \
  template void Simulation<Dim>::restore_cracks(const std::vector<double>&);           \
  template std::vector<double> Simulation<Dim>::crack_states() const;                  \
  template void Simulation<Dim>::receive_cracks();
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
