#include "cairn/grid/lattice.hpp"

#include <tuple>

namespace cairn {

template <int Dim>
Lattice<Dim>::Lattice(const Vec<Dim>& lower, const Vec<Dim>& upper, const Index<Dim>& cells,
                      const std::array<bool, Dim>& periodic, int patch_cells)
    : lower_(lower), upper_(upper), cells_(cells), periodic_(periodic) {
  measure();
  for (int d = 0; d < Dim; ++d) {
    patches_[d] = std::max(1, cells[d] / patch_cells);
    patch_count_ *= patches_[d];
  }
}

template <int Dim>
void Lattice<Dim>::set_upper(const Vec<Dim>& upper) {
  upper_ = upper;
  measure();
}

template <int Dim>
void Lattice<Dim>::measure() {
  for (int d = 0; d < Dim; ++d) {
    spacing_[d] = length(d) / cells_[d];
    inverse_[d] = cells_[d] / length(d);
    last_[d] = last_inside(d);
  }
}

template <int Dim>
double Lattice<Dim>::last_inside(int d) const {
  double inside = lower_[d], outside = upper_[d];
  if (scaled(d, outside) < cells_[d]) return outside;
  while (true) {
    const double middle = inside + 0.5 * (outside - inside);
    if (!(middle > inside && middle < outside)) return inside;
    (scaled(d, middle) < cells_[d] ? inside : outside) = middle;
  }
}

template <int Dim>
int Lattice<Dim>::wrap(int d, double& x) const {
  const double xi = scaled(d, x);
  const int periods = xi < 0 ? -1 : xi < cells_[d] ? 0 : 1;
  const double moved = x - periods * length(d), rounding = 1e-3, at = scaled(d, moved);
  if (periods == 0 || !(at >= -rounding && at <= cells_[d] + rounding)) return 0;
  x = std::clamp(moved, lower_[d], last_[d]);
  return periods;
}

template <int Dim>
PatchId Lattice<Dim>::patch_at(const Index<Dim>& position) const {
  PatchId id = 0;
  for (int d = Dim - 1; d >= 0; --d) id = id * patches_[d] + position[d];
  return id;
}

template <int Dim>
Index<Dim> Lattice<Dim>::patch_position(PatchId patch) const {
  Index<Dim> position;
  for (int d = 0; d < Dim; ++d) position[d] = static_cast<int>(patch % patches_[d]), patch /= patches_[d];
  return position;
}

template <int Dim>
Box<Dim> Lattice<Dim>::patch_cells(PatchId patch) const {
  const Index<Dim> position = patch_position(patch);
  Box<Dim> box;
  for (int d = 0; d < Dim; ++d) box.lower[d] = cut(d, position[d]), box.upper[d] = cut(d, position[d] + 1);
  return box;
}

template <int Dim>
Box<Dim> Lattice<Dim>::patch_nodes(PatchId patch) const {
  Box<Dim> box = patch_cells(patch);
  for (int d = 0; d < Dim; ++d) {
    box.lower[d] -= !periodic_[d] && box.lower[d] == 0 ? 2 : 1;
    box.upper[d] += !periodic_[d] && box.upper[d] == cells_[d] ? 3 : 2;
  }
  return box;
}

template <int Dim>
std::array<double, 2> Lattice<Dim>::patch_reach(PatchId patch, int d) const {
  const Box<Dim> box = patch_cells(patch);
  const bool first = !periodic_[d] && box.lower[d] == 0, last = !periodic_[d] && box.upper[d] == cells_[d];
  return {box.lower[d] - (first ? 0.5 : 0.0), box.upper[d] + (last ? 0.5 : 0.0)};
}

template <int Dim>
PatchId Lattice<Dim>::patch_of_cell(const Index<Dim>& cell) const {
  Index<Dim> position;
  for (int d = 0; d < Dim; ++d)  // the last whose first cell is not beyond this one
    position[d] = static_cast<int>(((cell[d] + std::int64_t{1}) * patches_[d] - 1) / cells_[d]);
  return patch_at(position);
}

template <int Dim>
bool Lattice<Dim>::owns_node(PatchId patch, const Index<Dim>& node) const {
  const Box<Dim> box = patch_cells(patch);
  for (int d = 0; d < Dim; ++d) {
    const bool first = !periodic_[d] && box.lower[d] == 0, last = !periodic_[d] && box.upper[d] == cells_[d];
    if ((node[d] < box.lower[d] && !first) || (node[d] >= box.upper[d] && !last)) return false;
  }
  return true;
}

template <int Dim>
std::vector<Link<Dim>> Lattice<Dim>::unpaired_links(PatchId patch) const {
  const Index<Dim> position = patch_position(patch);
  std::vector<Link<Dim>> links;
  Box<Dim> around;
  for (int d = 0; d < Dim; ++d) around.lower[d] = -1, around.upper[d] = 2;
  for_each(around, [&](const Index<Dim>& step) {
    Link<Dim> link{};
    Index<Dim> other;
    bool exists = false;
    for (int d = 0; d < Dim; ++d) {
      other[d] = position[d] + step[d];
      exists = exists || step[d] != 0;
      if (other[d] < 0)
        link.shift[d] = -cells_[d], other[d] += patches_[d];
      else if (other[d] >= patches_[d])
        link.shift[d] = cells_[d], other[d] -= patches_[d];
      if (link.shift[d] != 0 && !periodic_[d]) return;
    }
    if (!exists) return;
    link.patch = patch_at(other);
    links.push_back(link);
  });
  std::sort(links.begin(), links.end(), [](const auto& a, const auto& b) {
    return std::make_tuple(a.patch, b.shift) < std::make_tuple(b.patch, a.shift);
  });
  return links;
}

template <int Dim>
std::vector<Link<Dim>> Lattice<Dim>::links(PatchId patch) const {
  auto links = unpaired_links(patch);
  for (auto& link : links) {
    const auto back = unpaired_links(link.patch);
    for (std::size_t i = 0; i < back.size(); ++i) {
      bool reverse = back[i].patch == patch;
      for (int d = 0; d < Dim; ++d) reverse = reverse && back[i].shift[d] == -link.shift[d];
      if (reverse) link.mirror = static_cast<int>(i);
    }
  }
  return links;
}

template class Lattice<2>;
template class Lattice<3>;

}  // namespace cairn
