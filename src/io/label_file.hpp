#pragma once
/// Files of labels (docs/shapes.md).

#include <filesystem>
#include <memory>

#include "cairn/body/label_volume.hpp"

namespace cairn::reading {

/// Opens a file of labels, reads what it says of each, and sums its bytes. Every rank for itself; voxels are read when
/// they are asked for. \throws InputError where it is missing or no whole file of labels
std::shared_ptr<const LabelVolume> open_labels(const std::filesystem::path& file, std::uint64_t& checksum);

}  // namespace cairn::reading
