// Rims that grow in 3D, in the plane of the surface: a strip of triangles at a time, from the state of the nodes
// between two steps. Every rank knows the rims' edges inside bodies, and adds to what its patches know.

#include <Eigen/Dense>
#include <map>

#include "cairn/crack/rim.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {
namespace {

constexpr double longest = 0.75;  // cells, of an edge of a new rim: a longer one is halved
constexpr double ahead_of = 0.5;  // cells beyond a new edge at which a body ends it

/// An edge of a rim inside a body, by its crack and the indices of its ends, with the surface on the left.
using Edge = std::array<int, 3>;
/// A point of a rim by crack and index.
using Name = std::pair<int, int>;

struct NewPoint {
  int crack, index;
  Name from;                   // the point that it begins at
  Vec<3> by = Vec<3>::Zero();  // from there [m]
  CrackHeld<3> held;
};

/// What changes of a rim's surroundings.
struct Strip {
  std::vector<NewPoint> points;
  std::map<Edge, CrackEdge> edges;  // what old edges are now
  std::map<Name, bool> tips;        // what old points are now

  NewPoint& point(int crack, int index) {
    return *std::ranges::find_if(points, [&](const auto& p) { return p.crack == crack && p.index == index; });
  }
};

void hold(NewPoint& by, int second, int third, std::array<CrackEdge, 3> edges) {
  CrackTriangle& triangle = by.held.triangles[by.held.held++];
  triangle.second = second, triangle.third = third;
  for (int k = 0; k < 3; ++k) triangle.set_edge(k, edges[k]);
}

/// This rank's edges of rims inside bodies.
std::vector<std::int64_t> own_edges(const std::vector<Patch<3>>& patches) {
  std::vector<std::int64_t> mine;
  for (const auto& patch : patches)
    for (const auto& point : patch.cracks)
      for (int t = 0; point.own && t < point.held; ++t) {
        const CrackTriangle& triangle = point.triangles[t];
        const std::array<int, 3> at = {point.index, triangle.second, triangle.third};
        for (int k = 0; k < 3; ++k)
          if (triangle.edge(k) == CrackEdge::tip) mine.insert(mine.end(), {point.crack, at[k], at[(k + 1) % 3]});
      }
  return mine;
}

/// Tells crack points of a patch what has become of them and of their triangles' edges.
void tell(std::vector<CrackPoint<3>>& points, const Strip& strip) {
  for (auto& point : points) {
    if (const auto tip = strip.tips.find({point.crack, point.index}); tip != strip.tips.end()) point.tip = tip->second;
    for (int t = 0; t < point.held; ++t) {
      CrackTriangle& triangle = point.triangles[t];
      const std::array<int, 3> at = {point.index, triangle.second, triangle.third};
      for (int k = 0; k < 3; ++k) {
        const auto edge = strip.edges.find({point.crack, at[k], at[(k + 1) % 3]});
        if (edge == strip.edges.end() || triangle.edge(k) != CrackEdge::tip) continue;
        triangle.edges &= ~(3 << 2 * k), triangle.set_edge(k, edge->second);
      }
    }
  }
}

/// Adds the new points that begin at own points of a patch.
void add(std::vector<CrackPoint<3>>& points, const std::vector<NewPoint>& added) {
  std::vector<CrackPoint<3>> more;
  for (const NewPoint& next : added) {
    const auto from = std::ranges::find_if(
        points, [&](const auto& p) { return p.own && p.crack == next.from.first && p.index == next.from.second; });
    if (from == points.end()) continue;
    CrackPoint<3> point = *from;
    static_cast<CrackHeld<3>&>(point) = next.held;
    point.index = point.next = next.index, point.bond = {}, point.traction.setZero();
    point.plane = point.lower = point.upper = from->plane + next.by;
    more.push_back(point);
  }
  points.insert(points.end(), more.begin(), more.end());
  std::ranges::sort(points, [](const auto& a, const auto& b) { return a < b; });
}

}  // namespace

/// Whether the bodies that a crack cuts are at places, the same on every rank. Collective.
template <int Dim>
std::vector<bool> Simulation<Dim>::find_material(const std::vector<int>& cracks, const std::vector<Vec<Dim>>& places) {
  std::vector<double> mine;
  for (auto& patch : patches_)
    for (std::size_t i = 0; i < places.size() && !patch.cracks.empty(); ++i) {
      Index<Dim> cell;
      for (int d = 0; d < Dim; ++d) cell[d] = static_cast<int>(std::floor(lattice_.scaled(d, places[i][d])));
      if (patch.cells.contains(cell) && fill_at(surroundings_of(patch), cracks[i], places[i]) >= 0.5)
        mine.push_back(static_cast<double>(i));
    }
  std::vector<bool> found(places.size(), false);
  for (const double i : gather_on_all(mine, comm_)) found[static_cast<std::size_t>(i)] = true;
  return found;
}

template <int Dim>
void Simulation<Dim>::grow_rims() {
  if constexpr (Dim == 3) {
    const double h = lattice_.smallest_spacing();
    std::map<Name, CrackTip<3>> rim;
    std::map<Name, int> grows;  // the index of the point ahead
    Strip strip;
    for (const auto& state : tip_states()) {
      const CrackTip<3>& tip = state.tip;
      const GrowthSpec& growth = growth_[tip.crack];
      rim[{tip.crack, tip.end}] = tip;
      if (growth.criterion == GrowthCriterion::none || steps_ % growth.every != 0) continue;
      const bool by_energy = growth.criterion == GrowthCriterion::energy;
      if (!(by_energy ? state.J >= growth.energy : state.K_opening >= growth.toughness)) continue;
      const int index = ++cracks_[tip.crack].ends[1];
      grows[{tip.crack, tip.end}] = index;
      NewPoint point{tip.crack, index, {tip.crack, tip.end}, growth.length * h * tip.ahead, {}};
      strip.points.push_back(point), strip.tips[{tip.crack, tip.end}] = false;
    }
    if (grows.empty()) return;
    const auto gathered = gather_on_all(own_edges(patches_), comm_);
    std::vector<Edge> edges;
    for (std::size_t i = 0; i < gathered.size(); i += 3) {
      Edge edge;
      for (int k = 0; k < 3; ++k) edge[k] = static_cast<int>(gathered[i + k]);
      edges.push_back(edge);
    }
    std::ranges::sort(edges);
    const auto next_of = [&](int crack, int index) {
      const auto at = grows.find({crack, index});
      return at == grows.end() ? index : at->second;
    };
    const auto place_of = [&](int crack, int index) -> Vec<3> {
      const CrackTip<3>& tip = rim.at({crack, index});
      const double by = grows.contains({crack, index}) ? growth_[crack].length * h : 0.0;
      return tip.position + by * tip.ahead;
    };
    // Where the new edges lie in a body they are tips.
    std::vector<int> of_crack;
    std::vector<Vec<3>> places;
    for (const auto& [crack, a, b] : edges) {
      const Vec<3> out = (rim.at({crack, a}).ahead + rim.at({crack, b}).ahead).normalized();
      of_crack.push_back(crack);
      places.push_back(0.5 * (place_of(crack, a) + place_of(crack, b)) + ahead_of * h * out);
    }
    const auto inside = find_material(of_crack, places);
    std::map<Name, int> touched;  // edges of a point's
    for (const auto& [crack, a, b] : edges) ++touched[{crack, a}], ++touched[{crack, b}];
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const auto& [crack, a, b] = edges[e];
      const int a2 = next_of(crack, a), b2 = next_of(crack, b);
      const bool stays = a2 == a && b2 == b;
      for (const int end : {a, b})
        if (!grows.contains({crack, end})) strip.tips[{crack, end}] |= stays || inside[e];
      if (stays) continue;
      const CrackEdge kind = inside[e] ? CrackEdge::tip : CrackEdge::open;
      strip.edges[edges[e]] = CrackEdge::inner;
      // Where a rim leaves the body what grows beside its last point is open.
      const auto side = [&](int end) { return touched[{crack, end}] == 1 ? CrackEdge::open : CrackEdge::inner; };
      const Vec<3> from = place_of(crack, a), to = place_of(crack, b);
      if (a2 == a) {
        hold(strip.point(crack, b2), b, a, {side(b), CrackEdge::inner, kind});
      } else if (b2 == b) {
        hold(strip.point(crack, a2), b, a, {kind, CrackEdge::inner, side(a)});
      } else {
        hold(strip.point(crack, a2), b, a, {CrackEdge::inner, CrackEdge::inner, side(a)});
        if ((to - from).norm() > longest * h) {
          const int middle = ++cracks_[crack].ends[1];
          NewPoint point{crack, middle, {crack, a}, 0.5 * (from + to) - rim.at({crack, a}).position, {}};
          point.held.tip = inside[e];
          hold(point, b, a2, {CrackEdge::inner, CrackEdge::inner, kind});
          strip.points.push_back(point);
          hold(strip.point(crack, b2), b, middle, {side(b), CrackEdge::inner, kind});
        } else {
          hold(strip.point(crack, b2), b, a2, {side(b), CrackEdge::inner, kind});
        }
      }
      for (const int end : {a2, b2})
        if (end != a && end != b) strip.point(crack, end).held.tip |= inside[e];
    }
    for (auto& patch : patches_) tell(patch.cracks, strip), add(patch.cracks, strip.points);
    receive_cracks();
  }
}

template void Simulation<2>::grow_rims();
template void Simulation<3>::grow_rims();

}  // namespace cairn
