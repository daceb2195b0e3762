#include "cairn/contact/sweep.hpp"

#include <limits>

namespace cairn {
namespace {

template <int Dim>
using ConstNode = Eigen::Map<const Vec<Dim>>;
template <int Dim>
using Node = Eigen::Map<Vec<Dim>>;

template <int Dim>
Node<Dim> momentum_of(Piece<Dim>& piece, int node) {
  return Node<Dim>(piece.nodes.sums.data() + static_cast<std::size_t>(node) * NodeSums<Dim>::width +
                   NodeSums<Dim>::momentum);
}

template <int Dim>
Node<Dim> vector_of(AlignedDoubles& vectors, int node) {
  return Node<Dim>(vectors.data() + static_cast<std::size_t>(node) * vector_width);
}

template <int Dim>
const double* sums_at(const Piece<Dim>& piece, int node) {
  return piece.nodes.sums.data() + static_cast<std::size_t>(node) * NodeSums<Dim>::width;
}

/// Bodies with less than this share of a node's mass are not in contact there (Nairn 2013, section 3.1).
constexpr double least_mass_share = 1e-6;
/// Normal tractions below this share of the longitudinal modulus count as none.
constexpr double stress_free_share = 1e-9;

/// Size of a gradient in shares of the volume `room`, for cells of size 1.
template <int Dim>
double share_of(const Vec<Dim>& gradient, const Lattice<Dim>& lattice, double room) {
  return gradient.cwiseProduct(lattice.spacing()).norm() / room;
}

bool merges(ContactLaw law) { return law == ContactLaw::none || law == ContactLaw::stick; }

}  // namespace

template <int Dim>
ContactSettings<Dim> ContactSettings<Dim>::make(const ContactOptions& options, std::vector<ContactMaterial> materials,
                                                const std::array<FaceType, 6>& faces) {
  ContactSettings s;
  s.options = options;
  s.materials = std::move(materials);
  const std::size_t n = s.materials.size();
  const auto friction_of = [](ContactLaw law, double mu) { return law == ContactLaw::frictionless ? 0.0 : mu; };
  s.pairs.assign(n * n, {options.law, friction_of(options.law, options.friction)});
  for (const auto& pair : options.pairs) {
    if (pair.material_a < 0 || pair.material_b < 0) continue;
    const PairLaw law{pair.law, friction_of(pair.law, pair.friction)};
    s.pairs[pair.material_a * n + pair.material_b] = s.pairs[pair.material_b * n + pair.material_a] = law;
  }
  s.faces = faces;
  return s;
}

template <int Dim>
double ContactSettings<Dim>::distance(const double* sums, const Lattice<Dim>& lattice, double room) const {
  using N = NodeSums<Dim>;
  const double volume = sums[N::volume] / room;
  double gradient = share_of<Dim>(ConstNode<Dim>(sums + N::gradient), lattice, room);
  if (options.normals != NormalSource::volume_gradient) gradient *= sums[N::volume] / sums[N::mass];  // it is of mass
  return contact::distance_to_surface(volume, gradient);
}

template <int Dim>
void ContactSweep<Dim>::find(const Patch<Dim>& patch, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings,
                             const std::vector<Body>& bodies) {
  box_ = patch.nodes;
  count_bodies(patch);
  list_entries(patch, lattice, settings, bodies);
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
  }
}

template <int Dim>
void ContactSweep<Dim>::list_entries(const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                     const ContactSettings<Dim>& settings, const std::vector<Body>& bodies) {
  shared_.clear();
  int total = 0;
  int at = 0;
  for_each(box_, [&](const Index<Dim>& i) {
    std::int32_t& slot = bodies_at_[at++];
    if (slot < 2) return void(slot = -1);
    shared_.push_back({total, slot, 0, i, lattice.owns_node(patch.id, i) ? 1.0 : 0.0});
    total += slot;
    slot = static_cast<std::int32_t>(shared_.size()) - 1;
  });
  entries_.assign(total, {});
  turning_.clear();
  std::vector<int> filled(shared_.size(), 0);
  for (std::size_t k = 0; k < patch.pieces.size(); ++k) {
    const auto& piece = patch.pieces[k];
    const Body& body = bodies[piece.body];
    const bool turns = settings.chords && body.rigid && body.angular_velocity != Vec3::Zero();
    if (turns) turning_.push_back(body);
    int node = 0;
    for_each_row(piece.nodes.box, box_, [&](int row, int n) {
      for (int i = 0; i < n; ++i, ++node) {
        const int shared = bodies_at_[row + i];
        if (shared < 0) continue;
        const double mass = sums_at(piece, node)[NodeSums<Dim>::mass];
        if (!(mass > 0)) continue;
        auto& entry = entries_[shared_[shared].first + filled[shared]++];
        entry.piece = static_cast<int>(k), entry.node = node, entry.mass = mass, entry.rigid = body.rigid;
        if (turns) entry.turning = static_cast<int>(turning_.size()) - 1;
      }
    });
  }
  for (auto& node : shared_) prepare(node, patch, lattice, settings, bodies);
}

template <int Dim>
void ContactSweep<Dim>::prepare(SharedNode& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                const ContactSettings<Dim>& settings, const std::vector<Body>& bodies) {
  const Index<Dim>& place = node.place;
  ContactEntry<Dim>* entry = &entries_[node.first];
  double room = lattice.cell_volume();
  bool fixed = false;
  for (int d = 0; d < Dim; ++d)
    for (int side = 0; side < 2; ++side) {
      if (lattice.periodic(d) || (side == 0 ? place[d] > 0 : place[d] < lattice.cells()[d])) continue;
      const FaceType face = settings.faces[2 * d + side];
      fixed = fixed || face == FaceType::fixed;
      if (face == FaceType::fixed || face == FaceType::wall) room *= 0.5;
      // On a symmetry plane sums hold both halves; beyond it they are the image of those inside.
      if (face == FaceType::symmetry) node.share *= place[d] == 0 || place[d] == lattice.cells()[d] ? 0.5 : 0.0;
    }
  double total = 0;
  for (int i = 0; i < node.count; ++i) {
    total += entry[i].mass;
    const auto& best = entry[node.partner];
    if (entry[i].rigid != best.rigid ? entry[i].rigid : entry[i].mass > best.mass) node.partner = i;
  }
  const int partner_material = bodies[patch.pieces[entry[node.partner].piece].body].material;
  for (int i = 0; i < node.count; ++i) {
    entry[i].law = settings.pair(bodies[patch.pieces[entry[i].piece].body].material, partner_material);
    const bool heavy_enough = entry[i].mass >= least_mass_share * total;
    entry[i].open = !fixed && !entry[i].rigid && (merges(entry[i].law.law) || heavy_enough);
  }
  if (settings.options.release == Release::reaction && settings.options.fill > 0)
    set_gaps(node, patch, lattice, settings, room);
  set_normals(node, patch, lattice, settings.options.normal_choice);
  set_gates(node, patch, lattice, settings, bodies);
}

/// Shuts contact for bodies that are too far from the nearest other one.
template <int Dim>
void ContactSweep<Dim>::set_gaps(const SharedNode& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                 const ContactSettings<Dim>& settings, double room) {
  ContactEntry<Dim>* entry = &entries_[node.first];
  const double largest = contact::largest_gap(settings.options.fill);
  distances_.resize(node.count);
  for (int i = 0; i < node.count; ++i) {
    const double* sums = sums_at(patch.pieces[entry[i].piece], entry[i].node);
    distances_[i] = settings.distance(sums, lattice, room);
  }
  for (int i = 0; i < node.count; ++i) {
    if (merges(entry[i].law.law)) continue;
    double nearest = std::numeric_limits<double>::infinity();
    for (int j = 0; j < node.count; ++j)
      if (j != i) nearest = std::min(nearest, distances_[j]);
    if (distances_[i] + nearest > largest) entry[i].open = false;
  }
}

template <int Dim>
void ContactSweep<Dim>::set_normals(const SharedNode& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                    NormalChoice choice) {
  ContactEntry<Dim>* entry = &entries_[node.first];
  const auto gradient = [&](const ContactEntry<Dim>& e) -> Vec<Dim> {
    return ConstNode<Dim>(sums_at(patch.pieces[e.piece], e.node) + NodeSums<Dim>::gradient);
  };
  const auto flatness = [&](const ContactEntry<Dim>& e, const Vec<Dim>& g) {
    const double volume = sums_at(patch.pieces[e.piece], e.node)[NodeSums<Dim>::volume] / lattice.cell_volume();
    const double flat = std::sqrt(2 * std::clamp(std::min(volume, 1 - volume), 0.0, 0.5));
    const double size = share_of<Dim>(g, lattice, lattice.cell_volume());
    return size < 0.1 ? size : size / (flat + 0.02);
  };
  const auto& partner = entry[node.partner];
  const Vec<Dim> of_partner = gradient(partner);
  const double partner_flatness = flatness(partner, of_partner);
  for (int i = 0; i < node.count; ++i) {
    Vec<Dim> g = gradient(entry[i]);
    if (choice == NormalChoice::common && partner_flatness > flatness(entry[i], g)) g = -of_partner;
    const double size = g.norm();
    if (size > 0)
      entry[i].normal = g / size;
    else if (!merges(entry[i].law.law))
      entry[i].open = false;
  }
}

template <int Dim>
void ContactSweep<Dim>::set_gates(const SharedNode& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                  const ContactSettings<Dim>& settings, const std::vector<Body>& bodies) {
  using E = NodeExtras<Dim>;
  const auto& options = settings.options;
  if (options.release != Release::traction && options.separation <= 0) return;
  ContactEntry<Dim>* entry = &entries_[node.first];
  const auto extras = [&](const ContactEntry<Dim>& e) {
    const auto& all = patch.pieces[e.piece].nodes.extras;
    return all.empty() ? nullptr : all.data() + static_cast<std::size_t>(e.node) * E::width;
  };
  const auto volume = [&](const ContactEntry<Dim>& e) {
    return sums_at(patch.pieces[e.piece], e.node)[NodeSums<Dim>::volume];
  };
  const auto traction = [&](const ContactEntry<Dim>& e, const Vec<Dim>& n) {
    const double* s = extras(e);
    if (s == nullptr) return 0.0;
    if constexpr (Dim == 2)
      return n[0] * n[0] * s[0] + n[1] * n[1] * s[1] + 2 * n[0] * n[1] * s[2];
    else
      return n[0] * n[0] * s[0] + n[1] * n[1] * s[1] + n[2] * n[2] * s[2] +
             2 * (n[0] * n[1] * s[3] + n[1] * n[2] * s[4] + n[0] * n[2] * s[5]);
  };
  const auto& partner = entry[node.partner];
  for (int i = 0; i < node.count; ++i) {
    if (!entry[i].open || merges(entry[i].law.law)) continue;
    double t_n = 0, tolerance = 0;
    for (int j = 0; j < node.count; ++j) {
      if (options.gate == Gate::body && j != i) continue;
      const auto& material = settings.materials[bodies[patch.pieces[entry[j].piece].body].material];
      t_n += traction(entry[j], entry[i].normal);
      tolerance += stress_free_share * material.longitudinal_modulus * volume(entry[j]);
    }
    entry[i].compressive = t_n < -tolerance;
    entry[i].stress_free = std::abs(t_n) <= tolerance;
    if (options.separation > 0 && i != node.partner && extras(entry[i]) != nullptr && extras(partner) != nullptr) {
      const Vec<Dim> mine = ConstNode<Dim>(extras(entry[i]) + E::position) / volume(entry[i]);
      const Vec<Dim> theirs = ConstNode<Dim>(extras(partner) + E::position) / volume(partner);
      if ((theirs - mine).dot(entry[i].normal) >= options.separation * lattice.smallest_spacing())
        entry[i].open = false;
    }
  }
}

template <int Dim>
Vec<Dim> ContactSweep<Dim>::impulse(ContactEntry<Dim>& entry, const Vec<Dim>& P, const Vec<Dim>& F,
                                    const ContactSettings<Dim>& settings, double dt, Pass pass) const {
  using namespace contact;
  if (!entry.open) return Vec<Dim>::Zero();
  if (merges(entry.law.law)) return -P;
  const double mu = entry.law.friction;
  switch (settings.options.release) {
    case Release::approach:
      return approach_impulse<Dim>(P, entry.normal, mu);
    case Release::traction:
      return traction_impulse<Dim>(P, entry.normal, mu, entry.compressive, entry.stress_free,
                                   settings.options.departing_friction);
    case Release::reaction:
      break;
  }
  if (pass == Pass::first) entry.decision = decide_by_reaction<Dim>(P, F, entry.normal, mu, dt);
  if (pass == Pass::second) return reaction_impulse<Dim>(P, entry.normal, entry.decision, mu);
  return hold_impulse<Dim>(P, entry.normal, entry.decision);
}

template <int Dim>
void ContactSweep<Dim>::resolve(const SharedNode& node, const Lattice<Dim>& lattice,
                                const ContactSettings<Dim>& settings, double dt, Pass pass) {
  ContactEntry<Dim>* entry = &entries_[node.first];
  const auto& partner = entry[node.partner];
  double mass = 0;
  Vec<Dim> momentum = Vec<Dim>::Zero(), force = Vec<Dim>::Zero();
  for (int i = 0; i < node.count; ++i) mass += entry[i].mass, momentum += momenta_[i], force += forces_[i];
  if (partner.rigid) mass = partner.mass, momentum = momenta_[node.partner], force = forces_[node.partner];
  const bool own = settings.options.normal_choice == NormalChoice::own;
  Vec<Dim> sum = Vec<Dim>::Zero();
  for (int i = 0; i < node.count; ++i) {
    impulses_[i].setZero();
    if (entry[i].rigid || (i == node.partner && !(own && !merges(entry[i].law.law)))) continue;
    const Vec<Dim> P = momenta_[i] - entry[i].mass / mass * momentum;
    const Vec<Dim> F = forces_[i] - entry[i].mass / mass * force;
    impulses_[i] = impulse(entry[i], P, F, settings, dt, pass);
    const double rest = partner.rigid ? std::numeric_limits<double>::infinity() : mass - entry[i].mass;
    impulses_[i] *= contact::impulse_scale<Dim>(impulses_[i], entry[i].mass, rest, lattice.spacing(),
                                                settings.options.impulse_limit, dt);
    sum += impulses_[i];
  }
  if (!own || merges(partner.law.law)) impulses_[node.partner] = -sum;
}

template <int Dim>
void ContactSweep<Dim>::load_node(const SharedNode& node, const Patch<Dim>& patch, Pass pass, double dt) {
  const std::size_t n = node.count;
  if (momenta_.size() < n) momenta_.resize(n), forces_.resize(n), impulses_.resize(n);
  for (int i = 0; i < node.count; ++i) {
    const auto& entry = entries_[node.first + i];
    const auto& nodes = patch.pieces[entry.piece].nodes;
    const std::size_t vector = static_cast<std::size_t>(entry.node) * vector_width;
    forces_[i] = ConstNode<Dim>(nodes.force.data() + vector);
    momenta_[i] =
        ConstNode<Dim>(pass == Pass::repeat ? nodes.velocity.data() + vector
                                            : sums_at(patch.pieces[entry.piece], entry.node) + NodeSums<Dim>::momentum);
    if (entry.rigid) forces_[i].setZero();
    if (entry.turning >= 0) {
      const auto course = contact::course_of<Dim>(turning_[entry.turning], momenta_[i] / entry.mass, dt);
      momenta_[i] = entry.mass * course.velocity, forces_[i] = entry.mass / dt * course.change;
    }
    if (pass == Pass::second || (pass == Pass::repeat && entry.rigid)) momenta_[i] += dt * forces_[i];
  }
}

template <int Dim>
void ContactSweep<Dim>::first_pass(Patch<Dim>& patch, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings,
                                   double dt) {
  for (const auto& node : shared_) {
    load_node(node, patch, Pass::first, dt);
    resolve(node, lattice, settings, dt, Pass::first);
    for (int i = 0; i < node.count; ++i) {
      auto& entry = entries_[node.first + i];
      entry.record.projected = momenta_[i];
      if (entry.rigid || settings.options.passes == Passes::after) continue;
      entry.record.first = impulses_[i];
      momentum_of(patch.pieces[entry.piece], entry.node) += impulses_[i];
    }
  }
}

template <int Dim>
void ContactSweep<Dim>::second_pass(Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                    const ContactSettings<Dim>& settings, double dt, bool last) {
  const bool only_first = settings.options.passes == Passes::before;
  patch.ledger.contact_nodes = 0;
  for (const auto& node : shared_) {
    load_node(node, patch, Pass::second, dt);
    if (!only_first) resolve(node, lattice, settings, dt, Pass::second);
    bool touched = false;
    for (int i = 0; i < node.count; ++i) {
      auto& entry = entries_[node.first + i];
      if (entry.rigid) {  // its work is counted with the mean over the step
        entry.record.projected += 0.5 * dt * forces_[i];
        continue;
      }
      auto& piece = patch.pieces[entry.piece];
      if (only_first) {  // its impulse goes to the points, and no longer to the nodes
        impulses_[i] = entry.record.first;
        momentum_of(piece, entry.node) -= impulses_[i];
      }
      entry.record.force = forces_[i];
      entry.record.second = impulses_[i];
      vector_of<Dim>(piece.nodes.force, entry.node) += impulses_[i] / dt;
      touched = touched || !impulses_[i].isZero(0);
    }
    patch.ledger.contact_nodes += touched && node.share > 0;
    if (node.share > 0 && settings.keep_contacts) keep_pairs(node, patch, lattice);
    if (last) keep_ledger(node, patch, dt, false);
  }
}

template <int Dim>
void ContactSweep<Dim>::repeat_pass(Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                    const ContactSettings<Dim>& settings, double dt) {
  for (const auto& node : shared_) {
    load_node(node, patch, Pass::repeat, dt);
    resolve(node, lattice, settings, dt, Pass::repeat);
    for (int i = 0; i < node.count; ++i) {
      const auto& entry = entries_[node.first + i];
      if (!entry.rigid) vector_of<Dim>(patch.pieces[entry.piece].nodes.velocity, entry.node) += impulses_[i];
    }
    keep_ledger(node, patch, dt, true);
  }
}

template <int Dim>
void ContactSweep<Dim>::keep_ledger(const SharedNode& node, Patch<Dim>& patch, double dt, bool projected_again) const {
  if (node.share == 0) return;
  const auto& partner = entries_[node.first + node.partner];
  for (int i = 0; i < node.count; ++i) {
    const auto& entry = entries_[node.first + i];
    if (entry.rigid) continue;
    const double given = projected_again ? entry.record.given(entry.mass, dt, momenta_[i], impulses_[i])
                                         : entry.record.given(entry.mass, dt);
    const double driven = partner.rigid ? entry.record.second.dot(partner.record.projected) / partner.mass : 0.0;
    patch.ledger.contact_dissipation += node.share * (driven - given);
    patch.ledger.boundary_work += node.share * driven;
  }
}

template <int Dim>
void ContactSweep<Dim>::keep_pairs(const SharedNode& node, Patch<Dim>& patch, const Lattice<Dim>& lattice) const {
  const auto& partner = entries_[node.first + node.partner];
  for (int i = 0; i < node.count; ++i) {
    const auto& entry = entries_[node.first + i];
    const double size = node.share * impulses_[i].norm();
    if (i == node.partner || !(size > 0)) continue;
    const int body = patch.pieces[entry.piece].body, other = patch.pieces[partner.piece].body;
    const double sign = body < other ? 1.0 : -1.0;  // impulse on the lower body, normal towards the higher
    double* sum = patch.contacts[std::minmax(body, other)].values.data();
    sum[0] += size;
    for (int d = 0; d < Dim; ++d) {
      sum[1 + d] += sign * node.share * impulses_[i][d];
      sum[1 + Dim + d] += size * lattice.node_position(d, node.place[d]);
      sum[1 + 2 * Dim + d] += sign * size * entry.normal[d];
    }
  }
}

template struct ContactSettings<2>;
template struct ContactSettings<3>;
template class ContactSweep<2>;
template class ContactSweep<3>;

}  // namespace cairn
