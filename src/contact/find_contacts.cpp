// Where something may touch: nodes, the bodies there, their pairs, normals, gaps and gates.

#include "cairn/contact/sweep.hpp"
#include "node_access.hpp"

namespace cairn {
namespace {

using contact::ConstNode;
using contact::sums_at;

/// Bodies with less than this share of a node's mass are not in contact there (Nairn 2013, section 3.1).
constexpr double least_mass_share = 1e-6;
/// Normal tractions below this share of the longitudinal modulus count as none.
constexpr double stress_free_share = 1e-9;

/// The face's normal out of the domain.
template <int Dim>
Vec<Dim> outward(int face) {
  Vec<Dim> n = Vec<Dim>::Zero();
  n[face / 2] = face % 2 == 0 ? -1 : 1;
  return n;
}

template <int Dim>
bool at_fixed_face(const Index<Dim>& place, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings) {
  for (int face = 0; face < 2 * Dim; ++face)
    if (settings.faces[face].type == FaceType::fixed && at_face<Dim>(place, face, lattice)) return true;
  return false;
}
template <int Dim>
bool at_any_wall(const Index<Dim>& place, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings) {
  for (int face = 0; face < 2 * Dim; ++face)
    if (at_wall<Dim>(place, face, settings.faces, lattice)) return true;
  return false;
}

}  // namespace

template <int Dim>
void ContactSweep<Dim>::find(const Patch<Dim>& patch, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings,
                             const std::vector<Body>& bodies) {
  box_ = {};
  for (const auto& piece : patch.pieces) box_ = hull(box_, piece.nodes.box);
  for (int face = 0; face < 2 * Dim; ++face) wall_velocities_[face] = settings.faces[face].velocity;
  count_bodies(patch);
  list_nodes(patch, lattice, settings);
  list_entries(patch, settings, bodies);
  pairs_.clear(), wholes_.clear();
  for (auto& node : nodes_) list_pairs(node, patch, lattice, settings);
}

template <int Dim>
void ContactSweep<Dim>::count_bodies(const Patch<Dim>& patch) {
  using N = NodeSums<Dim>;
  bodies_at_.assign(box_.size(), 0);
  for (const auto& piece : patch.pieces) {
    const double* sums = piece.nodes.sums.data();
    for_each_row(piece.nodes.box, box_, [&](int at, int n) {
      for (int i = 0; i < n; ++i, sums += N::width) bodies_at_[at + i] += sums[N::mass] > 0;
    });
    for (const auto& row : piece.nodes.further.rows) {
      bodies_at_[box_.offset(row.place)] += sums[N::mass] > 0;
      sums += N::width;
    }
  }
}

/// Nodes of several bodies, and of one on a wall or beyond. `bodies_at_` turns to their places in the list.
template <int Dim>
void ContactSweep<Dim>::list_nodes(const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                   const ContactSettings<Dim>& settings) {
  nodes_.clear();
  bool walled = false;
  for (int face = 0; face < 2 * Dim; ++face)
    walled = walled || at_wall<Dim>(face % 2 == 0 ? box_.lower : box_.upper, face, settings.faces, lattice);
  int total = 0, at = 0;
  for_each(box_, [&](const Index<Dim>& i) {
    std::int32_t& slot = bodies_at_[at++];
    const int count = slot;
    slot = -1;
    if (count < 2 && !(count == 1 && walled && at_any_wall<Dim>(i, lattice, settings))) return;
    slot = static_cast<std::int32_t>(nodes_.size());
    nodes_.push_back({total, count, 0, 0, 0, i, node_share<Dim>(patch.id, i, lattice, settings.faces)});
    total += count;
  });
  entries_.assign(total, {});
}

template <int Dim>
void ContactSweep<Dim>::list_entries(const Patch<Dim>& patch, const ContactSettings<Dim>& settings,
                                     const std::vector<Body>& bodies) {
  turning_.clear();
  std::vector<int> filled(nodes_.size(), 0);
  for (std::size_t k = 0; k < patch.pieces.size(); ++k) {
    const auto& piece = patch.pieces[k];
    const Body& body = bodies[piece.body];
    const bool turns =
        settings.chords && body.rigid && (body.angular_velocity != Vec3::Zero() || body.change != Vec3::Zero());
    if (turns) turning_.push_back(body);
    const auto list = [&](int place, int node, SideSet sides) {
      if (place < 0) return;
      const double mass = sums_at(piece, node)[NodeSums<Dim>::mass];
      if (!(mass > 0)) return;
      auto& entry = entries_[nodes_[place].first + filled[place]++];
      entry.piece = static_cast<int>(k), entry.node = node, entry.sides = sides, entry.mass = mass;
      entry.rigid = body.rigid, entry.material = body.material, entry.tool = body.tool;
      if (turns) entry.turning = static_cast<int>(turning_.size()) - 1;
    };
    int node = 0;
    for_each_row(piece.nodes.box, box_, [&](int row, int n) {
      for (int i = 0; i < n; ++i, ++node) list(bodies_at_[row + i], node, {});
    });
    for (const auto& row : piece.nodes.further.rows) list(bodies_at_[box_.offset(row.place)], node++, row.sides);
  }
}

template <int Dim>
void ContactSweep<Dim>::list_pairs(Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                   const ContactSettings<Dim>& settings) {
  const ContactEntry<Dim>* entry = &entries_[node.first];
  const bool own = settings.options.normal_choice == NormalChoice::own;
  const bool fixed = at_fixed_face<Dim>(node.place, lattice, settings);
  if (has_sides(node)) {
    node.first_pair = static_cast<int>(pairs_.size());
    list_sided_pairs(node, patch, lattice, settings, fixed);
    if (!fixed) add_wall_pairs(node, patch, lattice, settings);
    node.pair_count = static_cast<int>(pairs_.size()) - node.first_pair;
    return;
  }
  double deformable = 0;
  for (int i = 0; i < node.count; ++i) {
    if (!entry[i].rigid) deformable += entry[i].mass;
    const auto& best = entry[node.partner];
    if (entry[i].rigid != best.rigid ? entry[i].rigid : entry[i].mass > best.mass) node.partner = i;
  }
  node.first_pair = static_cast<int>(pairs_.size());
  for (int i = 0; i < node.count && node.count > 1; ++i) {
    const PairLaw& law = settings.pair(entry[i].material, entry[node.partner].material);
    // The partner takes the opposite of all others' impulses, unless each meets the rest along a normal of its own.
    const bool alone = own && !law.binds();
    if (entry[i].rigid || (i == node.partner && !alone)) continue;
    NodePair<Dim> pair;
    pair.a = i, pair.b = alone ? pair.none : node.partner, pair.law = law;
    pair.open = !fixed && (law.binds() || entry[i].mass >= least_mass_share * deformable);
    pairs_.push_back(pair);
  }
  node.pair_count = static_cast<int>(pairs_.size()) - node.first_pair;
  if (node.pair_count > 0) {
    set_normals(node, patch, lattice, settings);
    set_gaps(node, patch, lattice, settings);
    set_gates(node, patch, lattice, settings);
  }
  if (!fixed) add_wall_pairs(node, patch, lattice, settings);
  node.pair_count = static_cast<int>(pairs_.size()) - node.first_pair;
}

/// The sums of an entry's body at its node.
template <int Dim>
const double* ContactSweep<Dim>::sums_of(const ContactEntry<Dim>& entry, const Patch<Dim>& patch) const {
  return entry.whole >= 0 ? wholes_[entry.whole].data() : sums_at(patch.pieces[entry.piece], entry.node);
}

/// Nodes beyond a wall take the gap of the node on it, where material is seen from.
template <int Dim>
void ContactSweep<Dim>::add_wall_pairs(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                       const ContactSettings<Dim>& settings) {
  using N = NodeSums<Dim>;
  for (int face = 0; face < 2 * Dim; ++face) {
    const auto& wall = settings.faces[face];
    if (!at_wall<Dim>(node.place, face, settings.faces, lattice)) continue;
    const Index<Dim> on_wall = settings.node_at_walls(node.place, lattice);
    const double to_plane = wall.moves ? cells_to_plane<Dim>(on_wall, face, wall, lattice) : 0.0;
    for (int i = 0; i < node.count; ++i) {
      const auto& entry = entries_[node.first + i];
      if (entry.rigid) continue;
      const auto& piece = patch.pieces[entry.piece];
      NodePair<Dim> pair;
      pair.a = i, pair.face = face, pair.law = wall.friction[entry.material], pair.normal = outward<Dim>(face);
      if (!piece.nodes.box.contains(on_wall)) continue;
      pair.gap_node = piece.nodes.box.offset(on_wall);
      const auto whole = contact::whole_sums<Dim>(piece, on_wall);
      const double* sums = whole.data();
      if (!(sums[N::mass] > 0)) continue;
      pair.open = true;
      // The room of which contact/gap.hpp speaks is that without the wall. What lies beyond the wall has a gradient
      // that points back in: its size would read as a gap on this side.
      const bool beyond = pair.normal.dot(ConstNode<Dim>(sums + N::gradient)) < 0;
      const double room = settings.room(on_wall, lattice, face);
      pair.gap = beyond ? 0.0 : settings.distance(sums, pair.normal, lattice, room) + to_plane;
      pair.yield = contact::TouchingGap::yield(lattice.smallest_spacing(),
                                               settings.materials[entry.material].wave_speed, sums[N::mass]);
      pairs_.push_back(pair);
    }
  }
}

/// Of the two gradients of a pair, that of the flatter surface counts (docs/contact.md).
template <int Dim>
void ContactSweep<Dim>::set_normals(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                    const ContactSettings<Dim>& settings) {
  const bool common = settings.options.normal_choice == NormalChoice::common;
  const auto* entry = &entries_[node.first];
  const auto gradient = [&](int i) -> Vec<Dim> {
    return ConstNode<Dim>(sums_of(entry[i], patch) + NodeSums<Dim>::gradient);
  };
  const auto flatness = [&](int i) {
    const double* sums = sums_of(entry[i], patch);
    const double volume = sums[NodeSums<Dim>::volume] / lattice.cell_volume();
    const double flat = std::sqrt(2 * std::clamp(std::min(volume, 1 - volume), 0.0, 0.5));
    const double size = settings.gradient_share(sums, lattice, lattice.cell_volume()).norm();
    if (size < 0.1) return size;
    // Nothing is steeper than a flat surface but points whose squares overlap, as where a foot is pressed and spreads.
    const double likeness = size / (flat + 0.02);
    return likeness > 1 ? 1 / likeness : likeness;
  };
  const double of_partner = flatness(node.partner);
  for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p) {
    NodePair<Dim>& pair = pairs_[p];
    Vec<Dim> g = gradient(pair.a);
    if (common && of_partner > flatness(pair.a)) g = -gradient(node.partner);
    const double size = g.norm();
    if (size > 0)
      pair.normal = g / size;
    else if (!pair.law.binds())
      pair.open = false;
  }
}

/// The gap of a pair is that between its body and the nearest other one.
template <int Dim>
void ContactSweep<Dim>::set_gaps(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                 const ContactSettings<Dim>& settings) {
  if (settings.options.release != Release::reaction) return;
  const auto* entry = &entries_[node.first];
  const double room = settings.room(node.place, lattice);
  const auto distance = [&](int i, const Vec<Dim>& normal) {
    return settings.distance(sums_of(entry[i], patch), normal, lattice, room);
  };
  const auto yield = [&](int i) {
    const double speed = entry[i].rigid ? 0.0 : settings.materials[entry[i].material].wave_speed;
    return contact::TouchingGap::yield(lattice.smallest_spacing(), speed, entry[i].mass);
  };
  for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p) {
    NodePair<Dim>& pair = pairs_[p];
    double nearest = std::numeric_limits<double>::infinity();
    for (int j = 0; j < node.count; ++j)
      if (entry[j].piece != entry[pair.a].piece) nearest = std::min(nearest, distance(j, pair.normal));
    pair.gap = distance(pair.a, pair.normal) + nearest;
    pair.yield = yield(pair.a) + yield(pair.b == pair.none ? node.partner : pair.b);
  }
}

template <int Dim>
void ContactSweep<Dim>::set_gates(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                  const ContactSettings<Dim>& settings) {
  using E = NodeExtras<Dim>;
  const auto& options = settings.options;
  if (options.release != Release::traction && options.separation <= 0) return;
  const auto* entry = &entries_[node.first];
  const auto extras = [&](int i) {
    const auto& all = patch.pieces[entry[i].piece].nodes.extras;
    return all.empty() ? nullptr : all.data() + static_cast<std::size_t>(entry[i].node) * E::width;
  };
  const auto volume = [&](int i) {
    return sums_at(patch.pieces[entry[i].piece], entry[i].node)[NodeSums<Dim>::volume];
  };
  const auto traction = [&](int i, const Vec<Dim>& n) {
    const double* s = extras(i);
    if (s == nullptr) return 0.0;
    if constexpr (Dim == 2)
      return n[0] * n[0] * s[0] + n[1] * n[1] * s[1] + 2 * n[0] * n[1] * s[2];
    else
      return n[0] * n[0] * s[0] + n[1] * n[1] * s[1] + n[2] * n[2] * s[2] +
             2 * (n[0] * n[1] * s[3] + n[1] * n[2] * s[4] + n[0] * n[2] * s[5]);
  };
  for (int p = node.first_pair; p < node.first_pair + node.pair_count; ++p) {
    NodePair<Dim>& pair = pairs_[p];
    if (!pair.open || pair.law.binds()) continue;
    double t_n = 0, tolerance = 0;
    for (int j = 0; j < node.count; ++j) {
      if (options.gate == Gate::body && j != pair.a) continue;
      t_n += traction(j, pair.normal);
      tolerance += stress_free_share * settings.materials[entry[j].material].longitudinal_modulus * volume(j);
    }
    pair.compressive = t_n < -tolerance;
    pair.stress_free = std::abs(t_n) <= tolerance;
    if (options.separation > 0 && pair.a != node.partner && extras(pair.a) != nullptr &&
        extras(node.partner) != nullptr) {
      const Vec<Dim> mine = ConstNode<Dim>(extras(pair.a) + E::position) / volume(pair.a);
      const Vec<Dim> theirs = ConstNode<Dim>(extras(node.partner) + E::position) / volume(node.partner);
      if ((theirs - mine).dot(pair.normal) >= options.separation * lattice.smallest_spacing()) pair.open = false;
    }
  }
}

#define CAIRN_INSTANTIATE(Dim)                                                                               \
  template void ContactSweep<Dim>::find(const Patch<Dim>&, const Lattice<Dim>&, const ContactSettings<Dim>&, \
                                        const std::vector<Body>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
