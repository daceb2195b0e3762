#include "cairn/body/points.hpp"

#include <algorithm>

namespace cairn {
namespace {

int whole_lanes(int n) { return (n + lane_count - 1) / lane_count * lane_count; }

}  // namespace

template <int Dim>
void Points<Dim>::resize(int size) {
  if (size > capacity_) reallocate(size_ == 0 ? size : size + size / 8);
  size_ = size;
  ids_.resize(size);
  images_.resize(size);
}

template <int Dim>
void Points<Dim>::reallocate(int capacity) {
  capacity = whole_lanes(capacity);
  AlignedDoubles moved(static_cast<std::size_t>(capacity) * columns_);
  std::fill(moved.begin(), moved.end(), 0.0);
  for (int c = 0; c < columns_; ++c)
    std::copy_n(column(c), size_, moved.data() + static_cast<std::size_t>(c) * capacity);
  data_.swap(moved);
  capacity_ = capacity;
  ids_.reserve(capacity);
  images_.reserve(capacity);
}

template <int Dim>
void Points<Dim>::select(std::span<const int> order) {
  const auto pick = [&](auto* values) {
    std::vector<std::remove_reference_t<decltype(*values)>> kept(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) kept[i] = values[order[i]];
    std::copy(kept.begin(), kept.end(), values);
  };
  for (int c = 0; c < columns_; ++c) pick(column(c));
  pick(ids_.data());
  pick(images_.data());
  resize(static_cast<int>(order.size()));
}

template class Points<2>;
template class Points<3>;

}  // namespace cairn
