#include "cairn/body/label_volume.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

constexpr int reach = 3;  // voxels that the mean takes in on either side
using Taps = std::array<float, 2 * reach + 1>;

Taps gaussian() {
  std::array<double, 2 * reach + 1> values;
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) sum += values[i + reach] = std::exp(-0.5 * i * i);
  Taps taps;
  for (std::size_t i = 0; i < taps.size(); ++i) taps[i] = static_cast<float>(values[i] / sum);
  return taps;
}

/// A block's numbers, x fastest.
struct Grid {
  std::array<int, 3> size;
  std::vector<float> values;
};

/// The means along one direction; the grid is shorter by twice the reach there, unless it is one voxel thick.
void smooth(Grid& grid, int direction, const Taps& taps) {
  Grid result{grid.size, {}};
  if (grid.size[direction] <= 2 * reach) return;
  result.size[direction] -= 2 * reach;
  result.values.assign(std::size_t(result.size[0]) * result.size[1] * result.size[2], 0.0F);
  const std::array<std::size_t, 3> step = {1, std::size_t(grid.size[0]), std::size_t(grid.size[0]) * grid.size[1]};
  float* to = result.values.data();
  for (int z = 0; z < result.size[2]; ++z)
    for (int y = 0; y < result.size[1]; ++y, to += result.size[0]) {
      const float* from = grid.values.data() + z * step[2] + y * step[1];
      for (std::size_t t = 0; t < taps.size(); ++t, from += step[direction])
        for (int x = 0; x < result.size[0]; ++x) to[x] += taps[t] * from[x];
    }
  grid = std::move(result);
}

/// Of the labels of a block, the one with the largest sum over the corners.
std::size_t largest(const std::vector<float>& weighted, std::size_t labels, const std::array<std::size_t, 8>& corners,
                    const std::array<float, 8>& weights, int count) {
  constexpr std::size_t together = 8;
  std::size_t winner = 0;
  float most = -1;
  for (std::size_t first = 0; first < labels; first += together) {
    const std::size_t some = std::min(together, labels - first);
    std::array<float, together> sums{};
    for (int c = 0; c < count; ++c) {
      const float* of_node = weighted.data() + corners[c] * labels + first;
      for (std::size_t l = 0; l < some; ++l) sums[l] += weights[c] * of_node[l];
    }
    for (std::size_t l = 0; l < some; ++l)
      if (sums[l] >= most) most = sums[l], winner = first + l;
  }
  return winner;
}

}  // namespace

std::size_t LabelVolume::Block::bytes() const {
  return sizeof(Block) + sole.size() * sizeof(std::int32_t) +
         (weighted.empty() ? 0 : weighted[0].size()) * sizeof(float);
}

LabelVolume::LabelVolume(int dimension, const std::array<std::int64_t, 3>& size, const Vec3& corner,
                         const Vec3& spacing, std::vector<LabelFacts> facts, VoxelSource source)
    : dimension_(dimension),
      size_(size),
      corner_(corner),
      spacing_(spacing),
      facts_(std::move(facts)),
      source_(std::move(source)) {}

double LabelVolume::volume_of(int index) const {
  return static_cast<double>(facts_[index].voxels) * spacing_.head(dimension_).prod();
}

Bounds LabelVolume::bounds() const {
  const Vec3 size(static_cast<double>(size_[0]), static_cast<double>(size_[1]), static_cast<double>(size_[2]));
  Bounds all{corner_, corner_ + size.cwiseProduct(spacing_)};
  if (dimension_ == 2) all.lower.z() = all.upper.z() = 0;
  return all;
}

int LabelVolume::index_of(std::int64_t label) const {
  if (label == 0) return -1;
  const auto found = std::ranges::lower_bound(facts_, label, {}, &LabelFacts::label);
  return found != facts_.end() && found->label == label ? static_cast<int>(found - facts_.begin()) : -1;
}

/// The voxels of a block and of the reach around it; beyond the volume those at its faces are repeated.
std::vector<std::int32_t> LabelVolume::read_around(const Key& key, std::array<std::int64_t, 3>& size) const {
  Key lower{}, count{}, first{};
  for (int k = 0; k < 3; ++k) {
    const std::int64_t nodes = std::min<std::int64_t>(side + 1, size_[k] - key[k] * side);
    const std::int64_t around = size_[k] == 1 ? 0 : reach;
    first[k] = key[k] * side - around, size[k] = nodes + 2 * around;
    lower[k] = std::max<std::int64_t>(0, first[k]);
    count[k] = std::min(size_[k], first[k] + size[k]) - lower[k];
  }
  std::vector<std::int64_t> read(static_cast<std::size_t>(count[0] * count[1] * count[2]));
  source_(lower, count, read);
  std::vector<std::int32_t> voxels;
  voxels.reserve(static_cast<std::size_t>(size[0] * size[1] * size[2]));
  std::int64_t label = 0;
  std::int32_t index = -1;
  const auto at = [&](int k, std::int64_t i) {
    return std::clamp(first[k] + i, lower[k], lower[k] + count[k] - 1) - lower[k];
  };
  for (std::int64_t z = 0; z < size[2]; ++z)
    for (std::int64_t y = 0; y < size[1]; ++y)
      for (std::int64_t x = 0; x < size[0]; ++x) {
        const std::int64_t found = read[(at(2, z) * count[1] + at(1, y)) * count[0] + at(0, x)];
        if (found != label) label = found, index = index_of(label);
        voxels.push_back(index);
      }
  return voxels;
}

void LabelVolume::share_out(Block& block, std::vector<std::int32_t> voxels,
                            const std::array<std::int64_t, 3>& size) const {
  static const Taps taps = gaussian();
  const std::size_t nodes = std::size_t(block.nodes[0]) * block.nodes[1] * block.nodes[2];
  std::vector<std::uint8_t> present(nodes, 0);
  const std::size_t count = block.labels.size();
  block.sole.assign(nodes, -1);
  block.weighted.assign(1, std::vector<float>(nodes * count, 0.0F));
  for (std::size_t l = 0; l < count; ++l) {
    Grid grid{{int(size[0]), int(size[1]), int(size[2])}, {}};
    grid.values.reserve(voxels.size());
    for (const std::int32_t v : voxels) grid.values.push_back(v == block.labels[l] ? 1.0F : 0.0F);
    for (int k = 0; k < 3; ++k) smooth(grid, k, taps);
    const float weight = block.labels[l] < 0 ? 1.0F : static_cast<float>(facts_[block.labels[l]].weight);
    for (std::size_t i = 0; i < nodes; ++i) {
      const float share = grid.values[i];
      if (share > 0) block.sole[i] = present[i]++ == 0 ? static_cast<std::int32_t>(l) : -1;
      block.weighted[0][i * count + l] = weight * share;
    }
  }
}

LabelVolume::Block LabelVolume::make_block(const Key& key) const {
  Block block;
  std::array<std::int64_t, 3> size{};
  std::vector<std::int32_t> voxels = read_around(key, size);
  for (int k = 0; k < 3; ++k)
    block.nodes[k] = static_cast<int>(std::min<std::int64_t>(side + 1, size_[k] - key[k] * side));
  for (const std::int32_t v : voxels)
    if (block.labels.empty() || (v != block.labels.back() && std::ranges::find(block.labels, v) == block.labels.end()))
      block.labels.push_back(v);
  std::ranges::sort(block.labels);
  if (block.labels.size() > 1) share_out(block, std::move(voxels), size);
  return block;
}

const LabelVolume::Block& LabelVolume::block_at(const Key& key) const {
  const auto blocks = [&](int k) { return (size_[k] + side - 1) / side; };
  const std::int64_t number = (key[2] * blocks(1) + key[1]) * blocks(0) + key[0];
  if (!kept_.empty() && kept_.front().number == number) return kept_.front().block;
  if (const auto found = find_.find(number); found != find_.end()) {
    kept_.splice(kept_.begin(), kept_, found->second);
    return kept_.front().block;
  }
  kept_.push_front({number, make_block(key)});
  find_[number] = kept_.begin();
  bytes_ += kept_.front().block.bytes();
  while (bytes_ > room && kept_.size() > 1) {
    bytes_ -= kept_.back().block.bytes();
    find_.erase(kept_.back().number);
    kept_.pop_back();
  }
  return kept_.front().block;
}

int LabelVolume::label_at(const Vec3& x) const {
  Key key{};
  std::array<int, 3> low{}, step{};
  std::array<float, 3> part{};
  for (int k = 0; k < dimension_; ++k) {
    const double at = (x[k] - corner_[k]) / spacing_[k];
    if (!(at >= 0 && at <= static_cast<double>(size_[k]))) return -1;
    const double node = std::clamp(at - 0.5, 0.0, static_cast<double>(size_[k] - 1));
    const auto below = std::max<std::int64_t>(0, std::min(static_cast<std::int64_t>(node), size_[k] - 2));
    key[k] = below / side, low[k] = static_cast<int>(below - key[k] * side);
    part[k] = static_cast<float>(node - static_cast<double>(below)), step[k] = size_[k] > 1 ? 1 : 0;
  }
  const Block& block = block_at(key);
  if (block.labels.size() == 1) return block.labels.front();
  std::array<std::size_t, 8> corners;
  std::array<float, 8> weights;
  const int count = 1 << dimension_;
  bool sole = true;
  for (int c = 0; c < count; ++c) {
    std::size_t i = 0;
    weights[c] = 1;
    for (int k = 2; k >= 0; --k) {
      const int upper = c >> k & 1;
      i = i * block.nodes[k] + low[k] + upper * step[k];
      if (k < dimension_) weights[c] *= upper ? part[k] : 1 - part[k];
    }
    corners[c] = i;
    sole = sole && block.sole[i] >= 0 && block.sole[i] == block.sole[corners[0]];
  }
  if (sole) return block.labels[block.sole[corners[0]]];
  return block.labels[largest(block.weighted[0], block.labels.size(), corners, weights, count)];
}

}  // namespace cairn
