#pragma once
/// Images and volumes of labels (docs/shapes.md). Each voxel has a label and a depth, how far its middle lies below the
/// surface of its label's body. A place belongs to the label with the largest sum of weight times depth over the
/// middles of voxels around it, linear between them: between two bodies, or a body and void, that is where the
/// interpolated signed distance is zero. Each place has one owner, so that touching bodies leave no gap and do not
/// overlap, and the middle of a voxel is its own label's. Depths, and the weights that keep the volumes, are found by
/// whoever made the file.

#include <array>
#include <cstdint>
#include <functional>
#include <list>
#include <span>
#include <unordered_map>
#include <vector>

#include "cairn/body/shapes/basics.hpp"

namespace cairn {

struct LabelFacts {
  std::int64_t label = 0;
  std::int64_t voxels = 0;
  Bounds box;                        // of its voxels
  Vec3 inner_centre = Vec3::Zero();  // of the largest ball (disk) within its voxels
  double inner_radius = 0;
  double weight = 1;
};

/// The voxels of a box, x fastest, from the file: its lower corner, its sizes, and room for their labels and depths
/// (above 0, in any unit).
using VoxelSource =
    std::function<void(const std::array<std::int64_t, 3>& lower, const std::array<std::int64_t, 3>& size,
                       std::span<std::int64_t> labels, std::span<std::uint8_t> depths)>;

class LabelVolume {
 public:
  /// \param size     in voxels; 1 in z for an image
  /// \param corner   lower corner of the first voxel, and `spacing` of voxels, in the file's lengths
  /// \param facts    ascending in label, without 0, which is void
  LabelVolume(int dimension, const std::array<std::int64_t, 3>& size, const Vec3& corner, const Vec3& spacing,
              std::vector<LabelFacts> facts, VoxelSource source);

  int dimension() const { return dimension_; }
  int count() const { return static_cast<int>(facts_.size()); }
  const LabelFacts& facts(int index) const { return facts_[index]; }
  /// As many voxels as the label has.
  double volume_of(int index) const;
  Bounds bounds() const;

  /// Index of the label at a place; -1: void, or beyond the volume. Blocks of voxels around it are read when they are
  /// first asked for, and forgotten when others need their room.
  int label_at(const Vec3& x) const;

 private:
  static constexpr int side = 32;                              // of a block, in voxels
  static constexpr std::size_t room = std::size_t{256} << 20;  // bytes of blocks that are kept

  /// Nodes, the centres of voxels, from the block's first to one beyond its last.
  struct Block {
    std::array<int, 3> nodes{};
    std::vector<std::int32_t> labels;  // of each node: its index; -1: void
    std::vector<float> depths;         // times the label's weight
    std::size_t bytes() const { return sizeof(Block) + labels.size() * (sizeof(std::int32_t) + sizeof(float)); }
  };
  using Key = std::array<std::int64_t, 3>;

  const Block& block_at(const Key& key) const;
  Block make_block(const Key& key) const;
  int index_of(std::int64_t label) const;

  int dimension_;
  std::array<std::int64_t, 3> size_;
  Vec3 corner_, spacing_;
  std::vector<LabelFacts> facts_;
  VoxelSource source_;

  struct Kept {
    std::int64_t number;
    Block block;
  };
  mutable std::list<Kept> kept_;  // the last used first
  mutable std::unordered_map<std::int64_t, std::list<Kept>::iterator> find_;
  mutable std::size_t bytes_ = 0;
};

}  // namespace cairn
