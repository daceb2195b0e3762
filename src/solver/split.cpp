// Parts that cracks cut off become bodies of their own: contact between bodies takes over, which knows them wherever
// they go, and the cracks between them are forgotten.
// Rows on the two sides of a crack are one where its faces are bound: by their law, or by crack points that hold each
// other.

#include <set>
#include <utility>

#include "body_parts.hpp"
#include "cairn/core/error.hpp"

namespace cairn {
namespace {

constexpr double bond_reach = 1.5;  // cells around a crack point in which it binds the sides

/// The sets of sides of a piece's further rows, without the cracks whose faces are bound there.
template <int Dim>
std::vector<SideSet> united_sides(const Patch<Dim>& patch, const Piece<Dim>& piece, const Lattice<Dim>& lattice,
                                  const ContactSettings<Dim>& contact) {
  std::vector<SideSet> sides;
  for (const auto& row : piece.nodes.further.rows)
    sides.push_back(row.sides.only([&](int c) {
      if (contact.cracks[c].law.binds() || contact.cracks[c].tie != CrackContact::Tie::none) return false;
      return std::ranges::none_of(patch.cracks, [&](const CrackPoint<Dim>& point) {
        if (point.crack != c || point.bond.state != Bond::holds || !(point.bond.length > 0)) return false;
        for (int d = 0; d < Dim; ++d)
          if (std::abs(lattice.scaled(d, point.plane[d]) - row.place[d]) > bond_reach) return false;
        return true;
      });
    }));
  return sides;
}

/// Walls are counted behind all bodies: contacts with them, where a body comes in front.
template <int Dim>
void renumber_walls(Patch<Dim>& patch, int body) {
  const auto before = std::exchange(patch.contacts, {});
  for (const auto& [pair, sum] : before)
    patch.contacts.emplace(std::pair(pair.first, pair.second + (pair.second >= body)), sum);
}

}  // namespace

template <int Dim>
void Simulation<Dim>::split_bodies() {
  if (split_every_ == 0 || cracks_.empty() || steps_ == 0 || steps_ % split_every_ != 0) return;
  finish_speed_reduction();
  std::vector<std::int64_t> mine;
  for (auto& patch : patches_)
    for (auto& piece : patch.pieces) {
      if (patch.cracks.empty() || is_rigid(piece) || piece.points.size() == 0) continue;
      find_cracks(patch), lay_out(patch, piece);
      if (!piece.nodes.further.rows.empty()) mine.push_back(piece.body);
    }
  const auto all = gather_on_all(mine, comm_);
  const std::set<std::int64_t> cut(all.begin(), all.end());
  if (cut.empty()) return;

  // The parts within patches, then those that share rows.
  std::vector<std::map<int, PieceParts<Dim>>> parts(patches_.size());
  std::vector<std::int64_t> rows;
  for (std::size_t p = 0; p < patches_.size(); ++p)
    for (auto& piece : patches_[p].pieces) {
      if (!cut.contains(piece.body) || piece.points.size() == 0) continue;
      if (patches_[p].cracks.empty()) lay_out(patches_[p], piece);
      piece.projected = false;
      const auto united = united_sides<Dim>(patches_[p], piece, lattice_, contact_);
      const auto at = parts[p].emplace(piece.body, PieceParts<Dim>(piece, lattice_, united)).first;
      at->second.tell_shared_rows(patches_[p], lattice_, rows);
    }
  const JoinedParts joined = join_parts(gather_on_all(rows, comm_));

  // The part with the smallest id keeps the body's number; the others get new ones in the order of theirs.
  std::map<std::int64_t, int> number;  // of parts, by their label
  std::set<int> split;
  for (const std::int64_t body : cut) {
    bool first = true;
    for (const auto& [label, part] : joined) {
      if (part.body != body || part.label != label) continue;
      number[label] = first ? static_cast<int>(body) : add_part(static_cast<int>(body));
      if (!first) split.insert({static_cast<int>(body), number[label]});
      first = false;
    }
  }
  if (split.empty()) return;
  for (std::size_t p = 0; p < patches_.size(); ++p)
    for (const auto& [body, here] : parts[p]) {
      std::map<int, std::vector<int>> points;
      for (std::size_t i = 0; i < here.labels().size(); ++i)
        points[number.at(joined.at(here.labels()[i]).label)].push_back(static_cast<int>(i));
      const Points<Dim> before = patches_[p].piece_of(body, 0).points;
      const int states = before.columns() - PointColumns<Dim>::state;
      for (const auto& [to, chosen] : points) {
        Piece<Dim>& piece = patches_[p].piece_of(to, states);
        piece.points = before, piece.points.select(chosen), piece.projected = false;
      }
      if (!points.contains(body)) patches_[p].piece_of(body, states).points.resize(0);
    }
  spare_parted({split.begin(), split.end()});
  tell_contact_of_cracks();
}

/// One more body, a part of another: whatever is kept for each body gets its own.
template <int Dim>
int Simulation<Dim>::add_part(int of) {
  const auto part = static_cast<int>(bodies_.size());
  parts_.push_back(of);
  bodies_.push_back(Body(bodies_[of]));
  crack_densities_.push_back(double{crack_densities_[of]});
  for (auto* transfer : {&transfer_, &transfer_of_turning_})
    if (!transfer->stretch.empty()) transfer->stretch.push_back(transfer->stretch_of(of));
  for (auto& patch : patches_) renumber_walls(patch, part);
  contact_.bodies = part + 1;
  for (Crack& crack : cracks_) {
    if (std::ranges::find(crack.bodies, of) != crack.bodies.end()) crack.bodies.push_back(part);
    if (std::ranges::find(crack.spared, of) != crack.spared.end()) crack.spared.push_back(part);
  }
  return part;
}

/// Cracks of whose two sides a body lies on one alone do not cut it any more.
template <int Dim>
void Simulation<Dim>::spare_parted(const std::vector<int>& bodies) {
  std::vector<std::int64_t> mine;
  for (auto& patch : patches_)
    for (auto& piece : patch.pieces) {
      if (!std::ranges::binary_search(bodies, piece.body) || piece.points.size() == 0 || patch.cracks.empty()) continue;
      lay_out(patch, piece);
      std::vector<SideSet> sides;
      for (const auto& row : piece.nodes.further.rows) sides.push_back(row.sides);
      PieceParts<Dim>(piece, lattice_, sides).for_rows([&](const Index<Dim>& place, SideSet here, std::int64_t) {
        mine.insert(mine.end(), {piece.body, name_of_node<Dim>(lattice_, place), here.key()});
      });
    }
  const auto all = gather_on_all(mine, comm_);
  std::set<RowName> rows;
  for (std::size_t i = 0; i < all.size(); i += 3) rows.insert({all[i], all[i + 1], all[i + 2]});
  std::set<std::pair<int, int>> beside, across;  // body and crack
  for (const RowName& row : rows)
    for (int n = 0; n < SideSet::most; ++n) {
      const int c = SideSet(row.sides).crack(n);
      if (c < 0) continue;
      beside.insert({static_cast<int>(row.body), c});
      if (rows.contains({row.body, row.place, SideSet(row.sides).without(c).key()}))
        across.insert({static_cast<int>(row.body), c});
    }
  // A crack without tips cuts nothing anew: it is done with parts that it lies away from too.
  for (const int body : bodies)
    for (std::size_t c = 0; c < cracks_.size(); ++c)
      if (cracks_[c].open[0] && cracks_[c].open[1]) beside.insert({body, static_cast<int>(c)});
  for (const auto& [body, c] : beside)
    if (!across.contains({body, c}) && cracks_[c].cuts(body)) cracks_[c].spared.push_back(body);
}

/// Contact knows by their numbers which bodies cracks cut.
template <int Dim>
void Simulation<Dim>::tell_contact_of_cracks() {
  for (std::size_t k = 0; k < cracks_.size(); ++k) {
    CrackContact& contact = contact_.cracks[k];
    contact.all_bodies = false, contact.bodies.clear();
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      if (!bodies_[b].rigid && cracks_[k].cuts(static_cast<int>(b))) contact.bodies.push_back(static_cast<int>(b));
    cracks_[k].idle = contact.bodies.empty();
  }
}

template <int Dim>
std::vector<double> Simulation<Dim>::spared() const {
  std::vector<double> pairs;
  for (std::size_t k = 0; k < cracks_.size(); ++k)
    for (const int body : cracks_[k].spared)
      pairs.insert(pairs.end(), {static_cast<double>(k), static_cast<double>(body)});
  return pairs;
}

template <int Dim>
void Simulation<Dim>::restore_parts(const std::vector<double>& parts, const std::vector<double>& spared) {
  const auto is_below = [](double x, std::size_t n) {
    return x >= 0 && x < static_cast<double>(n) && x == std::floor(x);
  };
  bool whole = parts.empty() || !cracks_.empty();
  for (std::size_t i = 0; whole && i < parts.size(); ++i) {
    whole = is_below(parts[i], bodies_.size());
    if (whole) add_part(static_cast<int>(parts[i]));
  }
  for (std::size_t i = 0; whole && i + 1 < spared.size(); i += 2) {
    whole = is_below(spared[i], cracks_.size()) && is_below(spared[i + 1], bodies_.size());
    if (whole) cracks_[static_cast<int>(spared[i])].spared.push_back(static_cast<int>(spared[i + 1]));
  }
  if (!whole) throw InputError("the checkpoint's bodies are not those of the case's, nor parts of them");
  if (!cracks_.empty()) tell_contact_of_cracks();
}

#define CAIRN_INSTANTIATE(Dim)                                  \
  template void Simulation<Dim>::split_bodies();                \
  template void Simulation<Dim>::tell_contact_of_cracks();      \
  template std::vector<double> Simulation<Dim>::spared() const; \
  template void Simulation<Dim>::restore_parts(const std::vector<double>&, const std::vector<double>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
