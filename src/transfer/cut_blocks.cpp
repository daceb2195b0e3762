#include "cut_blocks.hpp"

#include "cairn/core/lanes.hpp"

namespace cairn {
template <int Dim>
void CutBlocks<Dim>::enter(int count, double* first, int* stride) {
  rows_.clear();
  const PointSides<Dim>* sides = nodes_.further.points.data() + next_ * lane_count;
  for (int lane = 0; lane < count; ++lane) {
    Box<Dim> around;
    around.lower = around.upper = nodes_.box.place(static_cast<int>(first[lane]));
    for (int d = 0; d < Dim; ++d) around.upper[d] += extent_;
    first[lane] = static_cast<double>(nodes_.rows() + rows_.size());
    for_each(around, [&](const Index<Dim>& place) {
      const int further = sides[lane].at(place);
      rows_.push_back(further < 0 ? nodes_.box.offset(place) : nodes_.row_of(further));
    });
  }
  for (int d = 0, s = 1; d < Dim; ++d, s *= extent_) stride[d] = s;
  for (const RowArray& array : arrays_) {
    double* scratch = array.data + nodes_.rows() * array.width;
    if (array.added) {
      std::fill_n(scratch, rows_.size() * array.width, 0.0);
      continue;
    }
    for (std::size_t i = 0; i < rows_.size(); ++i)
      std::copy_n(array.data + static_cast<std::size_t>(rows_[i]) * array.width, array.width,
                  scratch + i * array.width);
  }
}

template <int Dim>
void CutBlocks<Dim>::leave() const {
  for (const RowArray& array : arrays_) {
    if (!array.added) continue;
    const double* scratch = array.data + nodes_.rows() * array.width;
    for (const int row : rows_) {
      double* to = array.data + static_cast<std::size_t>(row) * array.width;
      for (int c = 0; c < array.width; ++c) to[c] += *scratch++;
    }
  }
}

template class CutBlocks<2>;
template class CutBlocks<3>;

}  // namespace cairn
