#include "cairn/solver/body_states.hpp"

#include <bit>
#include <cmath>
#include <map>

#include "cairn/body/deformation.hpp"

namespace cairn {
namespace {

/// A record of doubles about a body, on its way to the rank that answers for the body.
struct Shares {
  std::int64_t bodies;
  int ranks;
  std::int64_t begin(int rank) const { return bodies * rank / ranks; }
  int rank_of(std::int64_t body) const {
    int r = static_cast<int>(body * ranks / bodies);
    while (body < begin(r)) --r;
    while (body >= begin(r + 1)) ++r;
    return r;
  }
};

/// Sends records of `width` doubles, the first of which names a body, to the rank that answers for it. Collective.
std::vector<double> send_home(const std::vector<double>& records, int width, const Shares& shares, MPI_Comm comm) {
  std::vector<int> send(shares.ranks, 0), receive(shares.ranks), send_at(shares.ranks, 0), receive_at(shares.ranks, 0);
  std::vector<std::vector<double>> by_rank(shares.ranks);
  for (std::size_t i = 0; i < records.size(); i += width) {
    auto& list = by_rank[shares.rank_of(static_cast<std::int64_t>(records[i]))];
    list.insert(list.end(), records.begin() + i, records.begin() + i + width);
  }
  std::vector<double> outgoing;
  for (int r = 0; r < shares.ranks; ++r) {
    send_at[r] = static_cast<int>(outgoing.size()), send[r] = static_cast<int>(by_rank[r].size());
    outgoing.insert(outgoing.end(), by_rank[r].begin(), by_rank[r].end());
  }
  MPI_Alltoall(send.data(), 1, MPI_INT, receive.data(), 1, MPI_INT, comm);
  for (int r = 1; r < shares.ranks; ++r) receive_at[r] = receive_at[r - 1] + receive[r - 1];
  std::vector<double> incoming(receive_at.back() + receive.back());
  MPI_Alltoallv(outgoing.data(), send.data(), send_at.data(), MPI_DOUBLE, incoming.data(), receive.data(),
                receive_at.data(), MPI_DOUBLE, comm);
  return incoming;
}

template <int Dim>
Shares shares_of(const Simulation<Dim>& simulation) {
  Shares shares{static_cast<std::int64_t>(simulation.bodies().size()), 1};
  MPI_Comm_size(simulation.communicator(), &shares.ranks);
  return shares;
}

/// Moments of a piece about its body's first centre: mass, m r, m v, m r x v, m r r^T (6), V sigma (6), V, and the
/// inertia of the points' own spin (3), the number of points, and their own second moment, of each as a cube.
struct Moments {
  static constexpr int size = 28;
  std::array<double, size> m{};
};

template <int Dim>
Moments moments_of(const Simulation<Dim>& simulation, const Piece<Dim>& piece) {
  using C = PointColumns<Dim>;
  const double density = simulation.material_of(piece).density;
  const Vec3& origin = simulation.bodies()[piece.body].centre;
  const Points<Dim>& points = piece.points;
  const auto inertia = spin_inertia(piece, simulation.lattice(), simulation.transfer());
  Moments sums;
  for (int p = 0; p < points.size(); ++p) {
    Vec3 r = Vec3::Zero(), v = Vec3::Zero();
    for (int d = 0; d < Dim; ++d) {
      r[d] = points.column(d)[p] + points.images()[p][d] * simulation.lattice().length(d) - origin[d];
      v[d] = points.column(C::velocity + d)[p];
    }
    const double volume0 = points.column(C::volume)[p], mass = density * volume0,
                 volume = volume0 * volume_ratio(points, p);
    const Vec3 spin = r.cross(v);
    double* m = sums.m.data();
    m[0] += mass, m[26] += 1, m[27] += mass * std::pow(volume, 2.0 / Dim) / 12;
    for (int i = 0; i < 3; ++i) m[1 + i] += mass * r[i], m[4 + i] += mass * v[i], m[7 + i] += mass * spin[i];
    for (int i = 0; i < 3; ++i) {
      m[10 + i] += mass * r[i] * r[i];
      m[13 + i] += mass * r[i] * r[(i + 1) % 3];  // xy, yz, zx
    }
    for (int i = 0; i < symmetric_size<Dim>; ++i) m[16 + i] += volume * points.column(C::stress + i)[p];
    m[22] += volume;
    for (int s = 0; s < spin_size<Dim>; ++s) {
      const int axis = Dim == 2 ? 2 : s;
      m[7 + axis] += mass * inertia[p][s] * points.column(C::spin + s)[p];
      m[23 + axis] += mass * inertia[p][s];
    }
  }
  return sums;
}

BodyState state_of(int body, const std::array<double, Moments::size>& m, const Vec3& origin, int dimension) {
  BodyState s;
  s.body = body, s.mass = m[0], s.points = static_cast<int>(m[26]);
  const Vec3 offset = Vec3(m[1], m[2], m[3]) / m[0];
  s.centre = origin + offset;
  s.velocity = Vec3(m[4], m[5], m[6]) / m[0];
  const Vec3 spin = Vec3(m[7], m[8], m[9]) - m[0] * offset.cross(s.velocity);
  Mat3 second;  // central second moments
  second << m[10], m[13], m[15], m[13], m[11], m[14], m[15], m[14], m[12];
  second -= m[0] * offset * offset.transpose();
  Mat3 inertia = second.trace() * Mat3::Identity() - second;
  for (int i = 0; i < 3; ++i) inertia(i, i) += m[23 + i];
  s.angular_momentum = spin, s.volume = m[22];
  for (int i = 0; i < 3; ++i) {
    s.second_moment[i] = (second(i, i) + (i < dimension ? m[27] : 0.0)) / m[0];
    s.second_moment[3 + i] = second(i == 2 ? 0 : i, i == 0 ? 1 : 2) / m[0];
  }
  if (dimension == 2)
    s.angular_velocity[2] = inertia(2, 2) > 0 ? spin[2] / inertia(2, 2) : 0.0;
  else
    s.angular_velocity = inertia.ldlt().solve(spin);
  for (int i = 0; i < 6; ++i) s.mean_stress[i] = m[16 + i] / m[22];
  return s;
}

}  // namespace

template <int Dim>
std::vector<BodyState> body_states(const Simulation<Dim>& simulation) {
  constexpr int width = 2 + Moments::size;
  const Shares shares = shares_of(simulation);
  int rank = 0;
  MPI_Comm_rank(simulation.communicator(), &rank);
  std::vector<double> records;
  for (const auto& patch : simulation.patches())
    for (const auto& piece : patch.pieces) {
      if (piece.points.size() == 0) continue;
      const Moments sums = moments_of(simulation, piece);
      records.push_back(piece.body), records.push_back(std::bit_cast<double>(patch.id));
      records.insert(records.end(), sums.m.begin(), sums.m.end());
    }
  const auto incoming = send_home(records, width, shares, simulation.communicator());
  std::map<std::pair<int, PatchId>, const double*> ordered;
  for (std::size_t i = 0; i < incoming.size(); i += width)
    ordered[{static_cast<int>(incoming[i]), std::bit_cast<PatchId>(incoming[i + 1])}] = &incoming[i + 2];
  std::map<int, std::array<double, Moments::size>> sums;
  for (const auto& [key, values] : ordered) {
    auto& sum = sums[key.first];
    for (int i = 0; i < Moments::size; ++i) sum[i] += values[i];
  }
  std::vector<BodyState> states;
  for (const auto& [body, sum] : sums) states.push_back(state_of(body, sum, simulation.bodies()[body].centre, Dim));

  // A body's contacts are counted once for each partner, wherever they were seen.
  std::vector<double> pairs;
  for (const auto& patch : simulation.patches())
    for (const auto& [pair, sum] : patch.contacts)
      if (pair.second < shares.bodies)  // not a wall
        for (const auto& [a, b] : {pair, std::pair(pair.second, pair.first)}) pairs.push_back(a), pairs.push_back(b);
  const auto seen = send_home(pairs, 2, shares, simulation.communicator());
  std::map<int, std::map<int, bool>> partners;
  for (std::size_t i = 0; i < seen.size(); i += 2)
    partners[static_cast<int>(seen[i])][static_cast<int>(seen[i + 1])] = true;
  for (auto& state : states) state.contacts = static_cast<int>(partners[state.body].size());
  return states;
}

template <int Dim>
std::vector<double> sizes_of_bodies(const Simulation<Dim>& simulation, const std::vector<PieceVector>& parts) {
  constexpr int width = 5;
  std::vector<double> records;
  for (const PieceVector& part : parts)
    records.insert(records.end(),
                   {double(part.body), std::bit_cast<double>(part.patch), part.value[0], part.value[1], part.value[2]});
  const auto incoming = send_home(records, width, shares_of(simulation), simulation.communicator());
  std::map<std::pair<int, PatchId>, Vec3> ordered;
  for (std::size_t i = 0; i < incoming.size(); i += width)
    ordered[{static_cast<int>(incoming[i]), std::bit_cast<PatchId>(incoming[i + 1])}] = Vec3(&incoming[i + 2]);
  std::map<int, Vec3> sums;
  for (const auto& [key, value] : ordered) sums.try_emplace(key.first, Vec3::Zero()).first->second += value;
  std::vector<double> sizes;
  for (const auto& [body, sum] : sums) sizes.push_back(sum.norm());
  return sizes;
}

template <int Dim>
std::vector<ContactState> contact_states(const Simulation<Dim>& simulation, double duration) {
  using S = ContactSum<Dim>;
  constexpr int width = 3 + S::size;
  std::vector<double> records;
  for (const auto& patch : simulation.patches())
    for (const auto& [pair, sum] : patch.contacts) {
      records.insert(records.end(), {double(pair.first), double(pair.second), std::bit_cast<double>(patch.id)});
      records.insert(records.end(), sum.values.begin(), sum.values.end());
    }
  const auto incoming = send_home(records, width, shares_of(simulation), simulation.communicator());
  std::map<std::tuple<int, int, PatchId>, const double*> ordered;
  for (std::size_t i = 0; i < incoming.size(); i += width)
    ordered[{static_cast<int>(incoming[i]), static_cast<int>(incoming[i + 1]),
             std::bit_cast<PatchId>(incoming[i + 2])}] = &incoming[i + 3];
  std::map<std::pair<int, int>, ContactSum<Dim>> sums;
  for (const auto& [key, values] : ordered) {
    auto& sum = sums[{std::get<0>(key), std::get<1>(key)}].values;
    // A contact may lie across a periodic boundary: bring the parts together before their positions are averaged.
    for (int d = 0; d < Dim; ++d) {
      const int at = S::place + d;
      if (!(sum[0] > 0)) continue;
      const double shift = simulation.lattice().periods_between(d, values[at] / values[0], sum[at] / sum[0]);
      sum[at] -= values[0] * shift;
      for (int i = 0; i < Dim; ++i) sum[S::moment + i * Dim + d] -= values[S::impulse + i] * shift;
    }
    for (int i = 0; i < ContactSum<Dim>::size; ++i) sum[i] += values[i];
  }
  std::vector<ContactState> states;
  for (const auto& [pair, sum] : sums) {
    ContactState s;
    const auto count = static_cast<int>(simulation.bodies().size());
    s.body_a = pair.first, s.body_b = pair.second < count ? pair.second : count - 1 - pair.second;
    const double* v = sum.values.data();
    for (int d = 0; d < Dim; ++d) {
      s.force[d] = v[S::impulse + d] / duration;
      s.point[d] = v[S::place + d] / v[0];
      s.normal[d] = v[S::normal + d];
      for (int j = 0; j < Dim; ++j) s.moment(d, j) = v[S::moment + d * Dim + j] / duration;
    }
    s.slip = v[S::slip] / v[0], s.friction_work = v[S::friction], s.sticking = v[S::stuck] / v[0];
    if (s.normal.norm() > 0) s.normal.normalize();
    states.push_back(s);
  }
  return states;
}

template std::vector<BodyState> body_states(const Simulation<2>&);
template std::vector<BodyState> body_states(const Simulation<3>&);
template std::vector<double> sizes_of_bodies(const Simulation<2>&, const std::vector<PieceVector>&);
template std::vector<double> sizes_of_bodies(const Simulation<3>&, const std::vector<PieceVector>&);
template std::vector<ContactState> contact_states(const Simulation<2>&, double);
template std::vector<ContactState> contact_states(const Simulation<3>&, double);

}  // namespace cairn
