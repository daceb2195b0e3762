#include "label_file.hpp"

#include <fmt/format.h>

#include <cmath>

#include "cairn/core/error.hpp"
#include "cairn/io/checksum.hpp"
#include "hdf5.hpp"
#include "posix_file.hpp"
#include "shape_copies.hpp"

namespace cairn::reading {
namespace {

using hdf5::Handle;

constexpr const char* kind = "labels";

/// An open file, and the name that messages give it.
struct LabelFile {
  std::string name;
  Handle file, voxels, depth;

  [[noreturn]] void fail(std::string_view text) const { throw InputError(fmt::format("{}: {}", name, text)); }

  /// The sizes of a data set, the slowest first.
  std::vector<hsize_t> extent(hid_t set) const {
    const Handle space(H5Dget_space(set), H5Sclose);
    hsize_t sizes[H5S_MAX_RANK] = {};
    const int count = H5Sget_simple_extent_dims(space, sizes, nullptr);
    return {sizes, sizes + std::max(0, count)};
  }
  template <class T>
  std::vector<T> table(const char* column, hsize_t rows, hsize_t components) const {
    const Handle set(H5Dopen(file, column, H5P_DEFAULT), H5Dclose);
    if (!set.valid()) fail(fmt::format("has no data set '{}'; make it by scripts/convert-labels", column));
    const std::vector<hsize_t> sizes = extent(set);
    const bool fits = components == 1 ? sizes == std::vector{rows} : sizes == std::vector{rows, components};
    if (!fits) fail(fmt::format("the data set '{}' does not have {} rows of {}", column, rows, components));
    std::vector<T> values(rows * components);
    if (!values.empty() && H5Dread(set, hdf5::native_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
      fail(fmt::format("the data set '{}' cannot be read: {}", column, hdf5::error_text()));
    return values;
  }
};

void open(LabelFile& f) {
  hdf5::prepare();
  f.file = Handle(H5Fopen(f.name.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!f.file.valid()) f.fail("is no HDF5 file that can be read; images are converted by scripts/convert-labels");
  std::string found;
  if (!hdf5::read_attribute(f.file, "kind", found) || found != kind)
    f.fail("is no file of labels (its attribute 'kind' is not 'labels'); make it by scripts/convert-labels");
  const Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
  H5Pset_chunk_cache(access, 1009, std::size_t{64} << 20, 1.0);
  f.voxels = Handle(H5Dopen(f.file, "voxels", access), H5Dclose);
  if (!f.voxels.valid()) f.fail("has no data set 'voxels'; make it by scripts/convert-labels");
  f.depth = Handle(H5Dopen(f.file, "depth", access), H5Dclose);
  if (!f.depth.valid()) f.fail("has no data set 'depth'; make it by scripts/convert-labels of this version");
}

/// What the file says of each label; checked, since places in it follow from these.
std::vector<LabelFacts> facts_of(const LabelFile& f, const std::array<std::int64_t, 3>& size, const Vec3& corner,
                                 const Vec3& spacing, int dim) {
  const Handle set(H5Dopen(f.file, "label", H5P_DEFAULT), H5Dclose);
  const std::vector<hsize_t> rows = set.valid() ? f.extent(set) : std::vector<hsize_t>{};
  if (rows.size() != 1) f.fail("has no column 'label'; make it by scripts/convert-labels");
  const hsize_t n = rows[0], d = static_cast<hsize_t>(dim);
  const auto label = f.table<std::int64_t>("label", n, 1), count = f.table<std::int64_t>("count", n, 1);
  const auto lower = f.table<std::int64_t>("lower", n, d), upper = f.table<std::int64_t>("upper", n, d);
  const auto centre = f.table<double>("inner_centre", n, d), radius = f.table<double>("inner_radius", n, 1);
  const auto weight = f.table<double>("weight", n, 1);
  std::vector<LabelFacts> facts(n);
  for (hsize_t i = 0; i < n; ++i) {
    LabelFacts& one = facts[i];
    one = {label[i], count[i], {Vec3::Zero(), Vec3::Zero()}, Vec3::Zero(), radius[i], weight[i]};
    bool right = count[i] > 0 && label[i] != 0 && (i == 0 || label[i] > label[i - 1]) && radius[i] > 0 &&
                 std::isfinite(radius[i]) && weight[i] > 0 && std::isfinite(weight[i]);
    for (int k = 0; k < dim; ++k) {
      const auto at = i * d + static_cast<hsize_t>(k);
      right = right && lower[at] >= 0 && lower[at] < upper[at] && upper[at] <= size[k] && std::isfinite(centre[at]);
      // Smoothing moves a surface by less than a voxel.
      one.box.lower[k] = corner[k] + std::max<double>(0, static_cast<double>(lower[at] - 1)) * spacing[k];
      one.box.upper[k] = corner[k] + static_cast<double>(std::min(size[k], upper[at] + 1)) * spacing[k];
      one.inner_centre[k] = centre[at];
    }
    if (!right) f.fail(fmt::format("damaged: what it says of its label number {} cannot be", i));
  }
  if (facts.empty()) f.fail("holds no label but void (0)");
  return facts;
}

}  // namespace

std::shared_ptr<const LabelVolume> open_labels(const std::filesystem::path& file, std::uint64_t& sum) {
  auto f = std::make_shared<LabelFile>(LabelFile{file.string(), {}, {}, {}});
  const PosixFile bytes(file, O_RDONLY);
  if (!bytes.valid() || bytes.size() < 0 || !checksum_of(bytes, sum)) f->fail("cannot be read");
  open(*f);
  const std::vector<hsize_t> extent = f->extent(f->voxels);
  if (f->extent(f->depth) != extent) f->fail("its data set 'depth' is not of the size of 'voxels'");
  const int dim = static_cast<int>(extent.size());
  if (dim != 2 && dim != 3) f->fail(fmt::format("its voxels have {} dimensions; they must have 2 or 3", dim));
  std::array<std::int64_t, 3> size = {1, 1, 1};
  Vec3 corner = Vec3::Zero(), spacing = Vec3::Ones();
  for (int k = 0; k < dim; ++k) {
    size[k] = static_cast<std::int64_t>(extent[dim - 1 - k]);
    const char* names[] = {"x", "y", "z"};
    if (!hdf5::read_attribute(f->file, fmt::format("spacing_{}", names[k]), spacing[k]) ||
        !hdf5::read_attribute(f->file, fmt::format("corner_{}", names[k]), corner[k]) || !(spacing[k] > 0) ||
        !std::isfinite(spacing[k]) || !std::isfinite(corner[k]) || size[k] < 1)
      f->fail(fmt::format("its attributes spacing_{0} and corner_{0} are missing or wrong", names[k]));
  }
  auto facts = facts_of(*f, size, corner, spacing, dim);
  VoxelSource source = [f, dim](const auto& lower, const auto& count, std::span<std::int64_t> labels,
                                std::span<std::uint8_t> depths) {
    hsize_t start[3], sizes[3];
    for (int k = 0; k < dim; ++k)
      start[k] = static_cast<hsize_t>(lower[dim - 1 - k]), sizes[k] = static_cast<hsize_t>(count[dim - 1 - k]);
    const Handle there(H5Dget_space(f->voxels), H5Sclose), here(H5Screate_simple(dim, sizes, nullptr), H5Sclose);
    H5Sselect_hyperslab(there, H5S_SELECT_SET, start, nullptr, sizes, nullptr);
    if (H5Dread(f->voxels, H5T_NATIVE_INT64, here, there, H5P_DEFAULT, labels.data()) < 0 ||
        H5Dread(f->depth, H5T_NATIVE_UINT8, here, there, H5P_DEFAULT, depths.data()) < 0)
      throw RunError(fmt::format("{}: its voxels cannot be read: {}", f->name, hdf5::error_text()));
  };
  return std::make_shared<LabelVolume>(dim, size, corner, spacing, std::move(facts), std::move(source));
}

}  // namespace cairn::reading
