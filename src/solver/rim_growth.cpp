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

std::vector<Edge> sorted_edges(const std::vector<std::int64_t>& numbers) {
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < numbers.size(); i += 3) {
    Edge edge;
    for (int k = 0; k < 3; ++k) edge[k] = static_cast<int>(numbers[i + k]);
    edges.push_back(edge);
  }
  std::ranges::sort(edges);
  return edges;
}

/// The rims inside bodies, and which of their points grow.
struct Rims {
  struct Ahead {
    int index;     // of the new point
    Vec<3> place;  // [m]
  };
  std::map<Name, CrackTip<3>> tips;
  std::map<Name, Ahead> grows;
  double longest_edge;  // [m]
  std::vector<Crack>& cracks;

  /// A point of a rim that grows by a length [m], or not.
  void add(const CrackTip<3>& tip, double by, Strip& strip) {
    const Name name = {tip.crack, tip.end};
    tips[name] = tip;
    if (!(by > 0)) return;
    const int index = ++cracks[tip.crack].ends[1];
    grows[name] = {index, tip.position + by * tip.ahead};
    strip.points.push_back({tip.crack, index, name, by * tip.ahead, {}});
    strip.tips[name] = false;
  }
  int next(const Name& name) const { return grows.contains(name) ? grows.at(name).index : name.second; }
  Vec<3> place(const Name& name) const { return grows.contains(name) ? grows.at(name).place : tips.at(name).position; }
  /// A place so far ahead of what an edge becomes.
  Vec<3> ahead_of_edge(const Edge& edge, double far) const {
    const Name a = {edge[0], edge[1]}, b = {edge[0], edge[2]};
    return 0.5 * (place(a) + place(b)) + far * (tips.at(a).ahead + tips.at(b).ahead).normalized();
  }

  /// Triangles between the old edges and the new ones. \param inside  whether new edges lie in a body
  void lay(const std::vector<Edge>& edges, const std::vector<bool>& inside, Strip& strip) {
    std::map<Name, int> count;  // edges of a point
    for (const auto& [crack, a, b] : edges) ++count[{crack, a}], ++count[{crack, b}];
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const Name a = {edges[e][0], edges[e][1]}, b = {edges[e][0], edges[e][2]};
      const bool stays = !grows.contains(a) && !grows.contains(b);
      for (const Name& end : {a, b})
        if (!grows.contains(end)) strip.tips[end] |= stays || inside[e];
      if (stays) continue;
      strip.edges[edges[e]] = CrackEdge::inner;
      for (const Name& end : {a, b})
        if (grows.contains(end)) strip.point(end.first, next(end)).held.tip |= inside[e];
      // Where a rim leaves the body what grows beside its last point is open.
      const auto side = [&](const Name& end) { return count[end] == 1 ? CrackEdge::open : CrackEdge::inner; };
      lay_beside(a, b, {side(a), side(b)}, inside[e] ? CrackEdge::tip : CrackEdge::open, strip);
    }
  }

 private:
  /// The triangles beside the edge from a to b; \param sides  what the edges from a and b to their new points are
  void lay_beside(const Name& a, const Name& b, std::array<CrackEdge, 2> sides, CrackEdge kind, Strip& strip) {
    constexpr CrackEdge inner = CrackEdge::inner;
    const int crack = a.first, a2 = next(a), b2 = next(b);
    if (!grows.contains(a)) return hold(strip.point(crack, b2), b.second, a.second, {sides[1], inner, kind});
    if (!grows.contains(b)) return hold(strip.point(crack, a2), b.second, a.second, {kind, inner, sides[0]});
    hold(strip.point(crack, a2), b.second, a.second, {inner, inner, sides[0]});
    int before = a2;  // of the new point at b
    if ((place(b) - place(a)).norm() > longest_edge) {
      before = ++cracks[crack].ends[1];
      NewPoint middle{crack, before, a, 0.5 * (place(a) + place(b)) - tips.at(a).position, {}};
      middle.held.tip = kind == CrackEdge::tip;
      hold(middle, b.second, a2, {inner, inner, kind});
      strip.points.push_back(middle);
    }
    hold(strip.point(crack, b2), b.second, before, {sides[1], inner, kind});
  }
};

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
    Rims rims{{}, {}, longest * h, cracks_};
    Strip strip;
    for (const auto& state : tip_states()) {
      const GrowthSpec& growth = growth_[state.tip.crack];
      const bool by_energy = growth.criterion == GrowthCriterion::energy;
      const bool grows = growth.criterion != GrowthCriterion::none && steps_ % growth.every == 0 &&
                         (by_energy ? state.J >= growth.energy : state.K_opening >= growth.toughness);
      rims.add(state.tip, grows ? growth.length * h : 0.0, strip);
    }
    if (rims.grows.empty()) return;
    const auto edges = sorted_edges(gather_on_all(own_edges(patches_), comm_));
    std::vector<int> of_crack;
    std::vector<Vec<3>> places;  // where there is material new edges are tips
    for (const Edge& edge : edges)
      of_crack.push_back(edge[0]), places.push_back(rims.ahead_of_edge(edge, ahead_of * h));
    rims.lay(edges, find_material(of_crack, places), strip);
    for (auto& patch : patches_) tell(patch.cracks, strip), add(patch.cracks, strip.points);
    receive_cracks();
  }
}

template void Simulation<2>::grow_rims();
template void Simulation<3>::grow_rims();

}  // namespace cairn
