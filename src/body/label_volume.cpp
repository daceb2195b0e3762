#include "cairn/body/label_volume.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

/// Of the labels at the corners of a cell the one with the largest sum; of equal ones that with the larger index.
int largest(const std::array<std::int32_t, 8>& labels, const std::array<float, 8>& values, int count) {
  std::int32_t winner = -1;
  float most = -1;
  for (int c = 0; c < count; ++c) {
    float sum = 0;
    for (int other = 0; other < count; ++other) sum += labels[other] == labels[c] ? values[other] : 0.0F;
    if (sum > most || (sum == most && labels[c] > winner)) most = sum, winner = labels[c];
  }
  return winner;
}

}  // namespace

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

LabelVolume::Block LabelVolume::make_block(const Key& key) const {
  Block block;
  Key lower{}, count{};
  for (int k = 0; k < 3; ++k) {
    lower[k] = key[k] * side, count[k] = std::min<std::int64_t>(side + 1, size_[k] - lower[k]);
    block.nodes[k] = static_cast<int>(count[k]);
  }
  const auto nodes = static_cast<std::size_t>(count[0] * count[1] * count[2]);
  std::vector<std::int64_t> labels(nodes);
  std::vector<std::uint8_t> depths(nodes);
  source_(lower, count, labels, depths);
  block.labels.reserve(nodes), block.depths.reserve(nodes);
  std::int64_t label = 0;
  std::int32_t index = -1;
  for (std::size_t i = 0; i < nodes; ++i) {
    if (labels[i] != label) label = labels[i], index = index_of(label);
    block.labels.push_back(index);
    block.depths.push_back(static_cast<float>(index < 0 ? 1.0 : facts_[index].weight) * depths[i]);
  }
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
  std::array<std::int32_t, 8> labels;
  std::array<float, 8> values;
  const int count = 1 << dimension_;
  bool one = true;
  for (int c = 0; c < count; ++c) {
    std::size_t node = 0;
    float weight = 1;
    for (int k = 2; k >= 0; --k) {
      const int upper = c >> k & 1;
      node = node * block.nodes[k] + low[k] + upper * step[k];
      if (k < dimension_) weight *= upper ? part[k] : 1 - part[k];
    }
    labels[c] = block.labels[node], values[c] = weight * block.depths[node];
    one = one && labels[c] == labels[0];
  }
  return one ? labels[0] : largest(labels, values, count);
}

}  // namespace cairn
