#pragma once
/// Material points of one piece of a body: structure of arrays, one aligned block, columns padded to whole vectors of
/// lanes.

#include <span>

#include "cairn/core/aligned.hpp"
#include "cairn/core/tensor.hpp"
#include "cairn/core/types.hpp"

namespace cairn {

/// Components of an angular velocity: that about z alone in 2D.
template <int Dim>
inline constexpr int spin_size = Dim == 2 ? 1 : 3;

/// First column of each quantity.
template <int Dim>
struct PointColumns {
  static constexpr int position = 0;                             // [m]
  static constexpr int velocity = Dim;                           // [m/s]
  static constexpr int spin = 2 * Dim;                           // angular velocity [rad/s] (spin_size columns)
  static constexpr int deformation = spin + spin_size<Dim>;      // deformation gradient F (tensor_size columns)
  static constexpr int stress = deformation + tensor_size<Dim>;  // Cauchy stress [Pa] (symmetric_size columns)
  static constexpr int volume = stress + symmetric_size<Dim>;    // reference volume [m^Dim]
  static constexpr int state = volume + 1;                       // the law's own variables
};

/// Crossings of periodic boundaries since the start, for each direction: position + image * period is continuous.
using Image = std::array<std::int32_t, 4>;
/// An image as it travels and lies in files of 64-bit words.
using ImageWords = std::array<std::int64_t, 2>;

template <int Dim>
class Points {
 public:
  using C = PointColumns<Dim>;

  explicit Points(int states = 0) : columns_(C::state + states) {}

  int size() const { return size_; }
  int columns() const { return columns_; }
  /// Values of one column: size() of them, followed by padding up to a whole vector of lanes that may be read and
  /// written.
  double* column(int c) { return data_.data() + static_cast<std::size_t>(c) * capacity_; }
  const double* column(int c) const { return data_.data() + static_cast<std::size_t>(c) * capacity_; }
  std::vector<std::int64_t>& ids() { return ids_; }  // unique, kept for life
  const std::vector<std::int64_t>& ids() const { return ids_; }
  std::vector<Image>& images() { return images_; }
  const std::vector<Image>& images() const { return images_; }

  /// Brings columns [first, last) to the cache where they are too many short ones for the processor to foresee.
  void fetch(int first, int last) const {
    constexpr int longest = 1000;  // measured: long columns are faster without
    if (size_ > longest) return;
    for (int c = first; c < last; ++c) cairn::fetch(column(c), size_);
  }

  /// Changes the number of points; the first min(old, new) are kept, new ones are unset.
  void resize(int size);
  /// Gives back memory beyond what the points need.
  void shrink_to_fit() {
    reallocate(size_);
    ids_.shrink_to_fit();
    images_.shrink_to_fit();
  }
  /// Keeps the points listed, in that order (ascending or not).
  void select(std::span<const int> order);
  /// Bytes held.
  std::size_t memory() const {
    return data_.capacity() * sizeof(double) + ids_.capacity() * 8 + images_.capacity() * sizeof(Image);
  }

 private:
  void reallocate(int capacity);

  int size_ = 0, capacity_ = 0, columns_;
  AlignedDoubles data_;
  std::vector<std::int64_t> ids_;
  std::vector<Image> images_;
};

}  // namespace cairn
