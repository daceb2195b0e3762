// What only the whole case can show: bodies out of place, overlapping, or too small for the grid.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "cairn/body/cut_sites.hpp"
#include "cairn/grid/box.hpp"
#include "case_sections.hpp"

namespace cairn::reading {
namespace {

constexpr double deepest_overlap = 0.01;  // of the smaller radius, without a warning
constexpr double least_width = 2.0;       // cells
// Added to the sites of points, in cells, as the set-up does it: one on a face that two bodies share goes to one of
// them.
constexpr double site_aside[] = {1e-7, 1e-7 * 0.7549, 1e-7 * 0.5698};
constexpr double on_face = 1e-6;  // cells; a body this near to a face sits on it on purpose

struct Disc {
  Vec3 centre;
  double radius;
  int body, level;  // cells of level l are 2^l long, at least the diameter
};

/// Finds the pairs of overlapping balls. Balls are sorted into one hash grid for each power of two of their diameter; a
/// ball searches the grids of its own size and of larger ones, so that the work stays linear for any mix of sizes.
class OverlapSearch {
 public:
  OverlapSearch(const Case& c) : domain_(c.domain) {
    for (std::size_t i = 0; i < c.bodies.size(); ++i)
      if (const auto* ball = std::get_if<Ball>(&c.bodies[i].shape); ball && c.bodies[i].insert < 0) {
        const int level = static_cast<int>(std::ceil(std::log2(ball->radius) + 1));
        discs_.push_back({ball->centre, ball->radius, static_cast<int>(i), level});
        largest_ = std::max(largest_, ball->radius);
        if (std::ranges::find(levels_, level) == levels_.end()) levels_.push_back(level);
      }
    next_.assign(discs_.size(), -1);
    for (int i = 0; i < std::ssize(discs_); ++i) {
      const auto [entry, fresh] = first_.try_emplace(key(discs_[i].level, cell(discs_[i].centre, discs_[i].level)), i);
      if (!fresh) next_[i] = std::exchange(entry->second, i);
    }
  }

  void run() {
    for (int i = 0; i < std::ssize(discs_); ++i) {
      std::array<int, 3> reach;
      for (int k = 0; k < 3; ++k) reach[k] = k < domain_.dimension && domain_.periodic[k] ? 1 : 0;
      for (int a = -reach[0]; a <= reach[0]; ++a)
        for (int b = -reach[1]; b <= reach[1]; ++b)
          for (int c = -reach[2]; c <= reach[2]; ++c) search_image(i, {a, b, c});
    }
  }

  std::int64_t count = 0;
  int first_a = -1, first_b = -1;  // bodies of the pair that comes first
  double depth = 0;                // its depth relative to the smaller radius

 private:
  using Cell = std::array<std::int64_t, 3>;

  /// Balls further away than integers reach share the last cell.
  Cell cell(const Vec3& x, int level) const {
    constexpr double last = 0x1p62;
    Cell result{};
    for (int k = 0; k < domain_.dimension; ++k)
      result[k] =
          static_cast<std::int64_t>(std::clamp(std::floor(std::ldexp(x[k] - domain_.lower[k], -level)), -last, last));
    return result;
  }
  static std::uint64_t key(int level, const Cell& c) {
    std::uint64_t hash = static_cast<std::uint64_t>(level) * 0x9e3779b97f4a7c15ULL;
    for (const std::int64_t v : c)
      hash = (hash ^ static_cast<std::uint64_t>(v)) * 0xff51afd7ed558ccdULL, hash ^= hash >> 32;
    return hash;
  }

  void search_image(int i, const std::array<int, 3>& image) {
    Vec3 x = discs_[i].centre;
    for (int k = 0; k < domain_.dimension; ++k) {
      const double length = domain_.upper[k] - domain_.lower[k], room = discs_[i].radius + largest_;
      x[k] += image[k] * length;
      if (image[k] != 0 && (x[k] < domain_.lower[k] - room || x[k] > domain_.upper[k] + room)) return;
    }
    const int depth_z = domain_.dimension == 3 ? 1 : 0;
    for (const int level : levels_) {
      if (level < discs_[i].level) continue;
      const Cell at = cell(x, level);
      for (int a = -1; a <= 1; ++a)
        for (int b = -1; b <= 1; ++b)
          for (int c = -depth_z; c <= depth_z; ++c) {
            const auto found = first_.find(key(level, {at[0] + a, at[1] + b, at[2] + c}));
            for (int j = found == first_.end() ? -1 : found->second; j >= 0; j = next_[j]) compare(i, x, level, j);
          }
    }
  }

  void compare(int i, const Vec3& x, int level, int j) {
    const Disc& other = discs_[j];
    if (other.level != level || (level == discs_[i].level && j <= i)) return;
    const double smaller = std::min(discs_[i].radius, other.radius);
    const double overlap = (discs_[i].radius + other.radius - (x - other.centre).norm()) / smaller;
    if (overlap <= deepest_overlap) return;
    ++count;
    const int a = std::min(discs_[i].body, other.body), b = std::max(discs_[i].body, other.body);
    if (first_a >= 0 && std::pair(a, b) >= std::pair(first_a, first_b)) return;
    first_a = a;
    first_b = b;
    depth = overlap;
  }

  const Domain& domain_;
  std::vector<Disc> discs_;
  std::vector<int> levels_, next_;
  std::unordered_map<std::uint64_t, int> first_;
  double largest_ = 0;
};

/// Cells between a body and the nearest fixed face that holds it although the body does not sit on it, and that face;
/// -1 when there is none.
std::pair<double, int> gap_to_fixed_face(const BodySpec& body, const Case& c) {
  const Bounds b = bounds(body.shape);
  std::pair<double, int> nearest{1.0, -1};
  for (int face = 0; face < 2 * c.domain.dimension; ++face) {
    if (c.faces[face].type != FaceType::fixed) continue;
    const int k = face / 2;
    const double cell = (c.domain.upper[k] - c.domain.lower[k]) / c.domain.cells[k];
    const double gap = (face % 2 ? c.domain.upper[k] - b.upper[k] : b.lower[k] - c.domain.lower[k]) / cell;
    if (gap > on_face && gap < nearest.first) nearest = {gap, face};
  }
  return nearest;
}

void warn_about_fixed_faces(Case& c) {
  std::int64_t count = 0;
  std::string first;
  for (int i = 0; i < std::ssize(c.bodies); ++i) {
    const auto [gap, face] = gap_to_fixed_face(c.bodies[i], c);
    if (face < 0 || c.bodies[i].insert >= 0 || is_prescribed(c, i)) continue;
    if (count++ == 0)
      first = fmt::format("{}: body {} lies {:.2g} cells from the fixed face {}", c.bodies[i].source, i, gap,
                          face_names[face]);
  }
  if (count > 0)
    c.warnings.push_back(fmt::format(
        "{}; {} of {} bodies lie within one cell of a fixed face, which holds them fast from there; leave more room, "
        "let them touch or cross the face, or use smaller cells",
        first, count, c.bodies.size()));
}

/// Cells that the bounds of a shape reach in the domain; empty where they miss it.
Box<3> cells_of(const Bounds& b, const Domain& d) {
  Box<3> cells;
  for (int k = 0; k < 3; ++k) {
    const double size = (d.upper[k] - d.lower[k]) / d.cells[k];
    const auto at = [&](double x) { return std::clamp((x - d.lower[k]) / size, 0.0, double(d.cells[k])); };
    cells.lower[k] = k < d.dimension ? static_cast<int>(std::floor(at(b.lower[k]))) : 0;
    cells.upper[k] = k < d.dimension ? static_cast<int>(std::ceil(at(b.upper[k]))) : 1;
  }
  return cells;
}

int points_per_side(const Case& c) {
  return static_cast<int>(std::lround(std::pow(c.solver.points_per_cell, 1.0 / c.domain.dimension)));
}

/// Whether a run would place a whole point in a shape that is moved by `shift`: one of the regular sites of the cells
/// lies inside. Looks at `sites` places at the most and takes the rest for granted: the set-up of a run counts them
/// all.
bool holds_site(const Shape& shape, const Vec3& shift, const Case& c, std::int64_t& sites) {
  const Domain& d = c.domain;
  const int per = points_per_side(c);
  Vec3 spacing = Vec3::Zero();
  for (int k = 0; k < d.dimension; ++k) spacing[k] = (d.upper[k] - d.lower[k]) / d.cells[k];
  const auto inside = [&](const std::array<std::int64_t, 3>& site) {
    Vec3 x = Vec3::Zero();
    for (int k = 0; k < d.dimension; ++k)
      x[k] = d.lower[k] + (static_cast<double>(site[k]) + 0.5) / per * spacing[k] + site_aside[k] * spacing[k];
    return contains(shape, x - shift);
  };
  Bounds b = bounds(shape);
  b.lower += shift, b.upper += shift;
  const Box<3> cells = cells_of(b, d);
  if (cells.empty()) return false;
  std::array<std::int64_t, 3> near{}, at{};  // near: the site next to the centre, which lies inside of most shapes
  for (int k = 0; k < d.dimension; ++k) {
    const double scaled = (centre(shape)[k] + shift[k] - d.lower[k]) / spacing[k] * per;
    near[k] = static_cast<std::int64_t>(std::clamp(std::floor(scaled), 0.0, double(d.cells[k]) * per - 1));
  }
  if (inside(near)) return true;
  const int depth = d.dimension == 3 ? per : 1;
  for (at[2] = cells.lower[2] * depth; at[2] < std::int64_t{cells.upper[2]} * depth; ++at[2])
    for (at[1] = std::int64_t{cells.lower[1]} * per; at[1] < std::int64_t{cells.upper[1]} * per; ++at[1])
      for (at[0] = std::int64_t{cells.lower[0]} * per; at[0] < std::int64_t{cells.upper[0]} * per; ++at[0])
        if (--sites < 0 || inside(at)) return true;
  return false;
}

/// The same for a shape whose surface is cut: one of the sites holds a point.
template <int Dim>
bool holds_cut_site(const Shape& shape, const Vec3& shift, const Case& c, int per, std::int64_t& sites) {
  constexpr int side = 8;  // of the blocks of sites that are looked at together
  const Domain& d = c.domain;
  Vec3 origin = Vec3::Zero(), spacing = Vec3::Zero();
  Bounds b = bounds(shape);
  b.lower += shift, b.upper += shift;
  const Box<3> cells = cells_of(b, d);
  if (cells.empty()) return false;
  Box<Dim> all, blocks;
  for (int k = 0; k < Dim; ++k) {
    origin[k] = d.lower[k] - shift[k], spacing[k] = (d.upper[k] - d.lower[k]) / d.cells[k] / per;
    all.lower[k] = cells.lower[k] * per, all.upper[k] = cells.upper[k] * per;
    blocks.upper[k] = (all.upper[k] - all.lower[k] + side - 1) / side;
  }
  const auto holds = [&](const Box<Dim>& some) {
    const CutSites<Dim> cut(shape, origin, spacing, some);
    bool found = false;
    for_each(some, [&](const Index<Dim>& site) { found = found || cut.at(site).share > 0; });
    return found;
  };
  Box<Dim> near;  // the site next to the centre
  for (int k = 0; k < Dim; ++k) {
    const double scaled = std::floor((centre(shape)[k] - origin[k]) / spacing[k]);
    near.lower[k] = static_cast<int>(std::clamp(scaled, double(all.lower[k]), double(all.upper[k] - 1)));
    near.upper[k] = near.lower[k] + 1;
  }
  // Most shapes hold the whole of it; there are millions of grains.
  const auto inside = [&](double x, double y, double z) {
    const Vec3 within(x, y, Dim == 3 ? z : 0);
    Vec3 place = origin;
    for (int k = 0; k < Dim; ++k) place[k] += (near.lower[k] + within[k]) * spacing[k];
    return contains(shape, place);
  };
  bool whole = inside(0.5, 0.5, 0.5);
  for (int corner = 0; corner < 1 << Dim && whole; ++corner) whole = inside(corner & 1, corner >> 1 & 1, corner >> 2);
  bool found = whole || holds(near);
  for_each(blocks, [&](const Index<Dim>& block) {
    if (found) return;
    Box<Dim> some;
    for (int k = 0; k < Dim; ++k) {
      some.lower[k] = all.lower[k] + block[k] * side;
      some.upper[k] = std::min(some.lower[k] + side, all.upper[k]);
    }
    sites -= static_cast<std::int64_t>(some.size());
    found = sites < 0 || holds(some);
  });
  return found;
}

/// A label's largest ball holds a whole site, whichever: its voxels need not be read to know.
bool holds_surely(const Shape& shape, const Vec3& shift, const Case& c, int per) {
  const auto* label = std::get_if<LabelBody>(&shape);
  if (!label) return false;
  Vec3 diagonal = Vec3::Zero();
  const Vec3 middle = label->middle() + shift;
  const Domain& d = c.domain;
  for (int k = 0; k < d.dimension; ++k) {
    diagonal[k] = (d.upper[k] - d.lower[k]) / d.cells[k] / per;
    if (middle[k] < d.lower[k] + diagonal[k] || middle[k] > d.upper[k] - diagonal[k]) return false;
  }
  return label->inner_radius() > 2 * diagonal.norm();
}

/// Whether a run would place a point in a shape that is moved by `shift`.
bool holds_point(const Shape& shape, const Vec3& shift, const Case& c, std::int64_t& sites) {
  const int dim = c.domain.dimension, per = points_per_side(c);
  if (holds_surely(shape, shift, c, per)) return true;
  double smallest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < dim; ++k)
    smallest = std::min(smallest, (c.domain.upper[k] - c.domain.lower[k]) / c.domain.cells[k]);
  if (c.solver.surface != Surface::cut || !can_be_cut(shape, smallest, per)) return holds_site(shape, shift, c, sites);
  return dim == 2 ? holds_cut_site<2>(shape, shift, c, per, sites) : holds_cut_site<3>(shape, shift, c, per, sites);
}

}  // namespace

const Material* material_of(const Case& c, const BodySpec& body) {
  return body.material >= 0 && body.material < std::ssize(c.materials) ? &c.materials[body.material] : nullptr;
}

bool is_prescribed(const Case& c, int index) {
  const BodySpec& body = c.bodies[index];
  const Material* material = material_of(c, body);
  return (material && material->model == "rigid") ||
         std::ranges::any_of(c.drives, [&](const Drive& d) { return selects(d, body, index, c.domain); });
}

void check_walls(const Case& c, Errors& errors) {
  constexpr std::size_t most_reported = 20;
  const std::size_t before = errors.count();
  for (int face = 0; face < 2 * c.domain.dimension; ++face) {
    if (!c.faces[face].position) continue;
    const double plane = *c.faces[face].position;
    const int k = face / 2;
    const double rounding = on_face * (c.domain.upper[k] - c.domain.lower[k]) / c.domain.cells[k];
    for (int i = 0; i < std::ssize(c.bodies) && errors.count() < before + most_reported; ++i) {
      if (c.bodies[i].insert >= 0 || is_prescribed(c, i)) continue;
      const Bounds b = bounds(c.bodies[i].shape);
      const double end = face % 2 ? b.upper[k] : b.lower[k];
      if (face % 2 ? end > plane + rounding : end < plane - rounding)
        errors.add(
            {c.bodies[i].source, 0}, "",
            fmt::format("body {} reaches to {} = {}, beyond the wall {}, which stands at {}; move one of the two", i,
                        "xyz"[k], end, face_names[face], plane));
    }
  }
}

void check_points(const Case& c, Errors& errors) {
  constexpr std::size_t most_reported = 20;
  const Domain& d = c.domain;
  const std::size_t before = errors.count();
  for (std::size_t i = 0; i < c.bodies.size() && errors.count() < before + most_reported; ++i) {
    const Shape& shape = c.bodies[i].shape;
    std::int64_t sites = 10'000'000;
    bool found = false;
    for (int image = 0; image < 27 && !found; ++image) {
      Vec3 shift = Vec3::Zero();
      bool reached = true;
      for (int k = 0, rest = image; k < 3; ++k, rest /= 3) {
        const int turns = rest % 3 == 2 ? -1 : rest % 3;
        reached = reached && (turns == 0 || d.periodic[k]);
        shift[k] = turns * (d.upper[k] - d.lower[k]);
      }
      found = reached && holds_point(shape, shift, c, sites);
    }
    if (!found)
      errors.add({c.bodies[i].source, 0}, "",
                 fmt::format("body {} holds no material point: it is smaller than the spacing of the points or lies "
                             "outside the domain; use smaller cells or more points per cell",
                             i));
  }
}

std::string placement_problem(const Shape& shape, const Domain& domain) {
  const Bounds b = bounds(shape);
  const Vec3 middle = centre(shape);
  const auto* ball = std::get_if<Ball>(&shape);
  double gap2 = 0;  // squared distance from a ball's centre to the domain
  for (int k = 0; k < domain.dimension; ++k) {
    const double lower = domain.lower[k], upper = domain.upper[k];
    if (b.lower[k] > b.upper[k]) return "the shape is empty; its parts must share points";
    if (domain.periodic[k] && std::isfinite(b.lower[k]) && std::isfinite(b.upper[k])) {
      const double rounding = 1e-9 * (upper - lower);  // a table's; the points are wrapped
      if (middle[k] < lower - rounding || middle[k] > upper + rounding)
        return fmt::format(
            "the centre has {} = {}, outside the domain [{}, {}], which is periodic there; move it by the period {}",
            "xyz"[k], middle[k], lower, upper, upper - lower);
      if (!std::holds_alternative<Compound>(shape) && b.upper[k] - b.lower[k] > (upper - lower) * (1 + 1e-9))
        return fmt::format("the body is {} wide in direction {}, more than the period {}; it must fit",
                           b.upper[k] - b.lower[k], "xyz"[k], upper - lower);
      continue;
    }
    if (b.upper[k] <= lower || b.lower[k] >= upper)
      return fmt::format("the body lies outside the domain: it spans [{}, {}] in direction {}, the domain [{}, {}]",
                         b.lower[k], b.upper[k], "xyz"[k], lower, upper);
    const double gap = std::max({lower - middle[k], middle[k] - upper, 0.0});
    gap2 += gap * gap;
  }
  if (ball && gap2 >= ball->radius * ball->radius)
    return "the body lies outside the domain, beyond one of its corners; it must reach inside";
  return {};
}

void warn_about_bodies(Case& result) {
  const auto& bodies = result.bodies;
  const double least = least_width * smallest_cell(result.domain) * (1 - 1e-9);
  std::int64_t small = 0, first = -1;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (smallest_width(bodies[i].shape) >= least) continue;
    if (small++ == 0) first = static_cast<std::int64_t>(i);
  }
  if (small > 0)
    result.warnings.push_back(fmt::format(
        "{}: body {} is {:.3g} cells wide; {} of {} bodies are thinner than 2 cells (a grain's radius below 1 cell) "
        "and will be badly "
        "resolved; use more cells",
        bodies[first].source, first, least_width * smallest_width(bodies[first].shape) / least, small, bodies.size()));
  OverlapSearch search(result);
  search.run();
  if (search.count > 0)
    result.warnings.push_back(
        fmt::format("{}: body {} overlaps body {} ({}) by {:.3g} of the smaller radius; {} pairs of round bodies "
                    "overlap by more than {} of it and "
                    "will start under stress or share their points' room",
                    bodies[search.first_a].source, search.first_a, search.first_b, bodies[search.first_b].source,
                    search.depth, search.count, deepest_overlap));
  warn_about_fixed_faces(result);
}

}  // namespace cairn::reading

namespace cairn {

double smallest_cell(const Domain& d) {
  double least = reading::infinity;
  for (int k = 0; k < d.dimension; ++k) least = std::min(least, (d.upper[k] - d.lower[k]) / d.cells[k]);
  return least;
}

bool selects(const Drive& drive, const BodySpec& body, int index, const Domain& domain) {
  if (body.insert >= 0) return false;
  if (drive.overlapping < 0)
    return std::ranges::find(drive.ids, index) != drive.ids.end() ||
           (!drive.group.empty() && body.group == drive.group);
  const Bounds b = bounds(body.shape);
  const int k = drive.overlapping / 2;
  return drive.overlapping % 2 ? b.upper[k] > domain.upper[k] - drive.within
                               : b.lower[k] < domain.lower[k] + drive.within;
}

}  // namespace cairn
