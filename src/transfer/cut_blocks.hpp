#pragma once
/// Blocks of eight points of which some see nodes across cracks. Their rows lie anywhere; so a pass works on a copy of
/// them, in which each point has its own nodes one after the other, and what it added there is added to the rows.

#include "cairn/body/piece.hpp"

namespace cairn {

/// An array of rows that a pass reads, or adds to.
struct RowArray {
  double* data;
  int width;
  bool added;
};
/// Of these, only scratch rows are written.
inline RowArray read_rows(const AlignedDoubles& values, int width) {
  return {const_cast<double*>(values.data()), width, false};
}
inline RowArray add_rows(AlignedDoubles& values, int width) { return {values.data(), width, true}; }

template <int Dim>
class CutBlocks {
 public:
  /// \param extent  nodes of a point along each direction
  CutBlocks(const NodeBox<Dim>& nodes, std::initializer_list<RowArray> arrays, int extent)
      : nodes_(nodes), arrays_(arrays), extent_(extent) {}

  /// Whether the block that begins with point `first` is one. Blocks are asked for in ascending order.
  bool reach(int first) {
    const auto& blocks = nodes_.further.blocks;
    while (next_ < blocks.size() && blocks[next_] < first) ++next_;
    return next_ < blocks.size() && blocks[next_] == first;
  }
  /// For that block: fills the scratch rows, and turns the stencil's first nodes and strides to them.
  void enter(int count, double* first, int* stride);
  /// Gives what was added to the rows.
  void leave() const;

 private:
  const NodeBox<Dim>& nodes_;
  std::initializer_list<RowArray> arrays_;
  int extent_;
  std::size_t next_ = 0;
  std::vector<int> rows_;  // of the scratch rows
};

}  // namespace cairn
