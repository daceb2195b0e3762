#include "cairn/io/info.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "cairn/core/error.hpp"
#include "hdf5.hpp"

namespace cairn {

namespace {

using hdf5::Handle;

/// Units of the quantities known by name; in 2D per metre of thickness.
const std::map<std::string_view, std::string_view> units = {
    {"time", "s"},
    {"position", "m"},
    {"Points", "m"},
    {"displacement", "m"},
    {"centre", "m"},
    {"point", "m"},
    {"velocity", "m/s"},
    {"angular_velocity", "rad/s"},
    {"acceleration", "m/s2"},
    {"stress", "Pa"},
    {"stress_smooth", "Pa"},
    {"mean_stress", "Pa"},
    {"pressure", "Pa"},
    {"von_mises_stress", "Pa"},
    {"force", "N"},
    {"mass", "kg"},
    {"density", "kg/m3"},
    {"volume", "m3"},
    {"initial_volume", "m3"},
    {"deformation_gradient", "1"},
    {"spin", "rad/s"},
    {"plastic_strain", "1"},
};

/// Datasets that only say how VTK is to read the others.
constexpr std::array structural = {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds",
                                   "Connectivity",   "Offsets",       "Types"};

constexpr int deepest = 64;  // groups within groups

struct Listing {
  std::filesystem::path file;
  std::set<haddr_t> seen;                        // addresses: links name an object again
  std::vector<std::array<std::string, 4>> rows;  // name, shape, type, range
};

[[noreturn]] void damaged(const std::filesystem::path& file, const std::string& what) {
  throw InputError(fmt::format("{}: cannot read {}: {}", file.string(), what, hdf5::error_text()));
}

std::string with_unit(const std::string& name) {
  const auto unit = units.find(name);
  return unit == units.end() ? name : fmt::format("{} [{}]", name, unit->second);
}

std::string describe_type(hid_t type) {
  const std::size_t bits = 8 * H5Tget_size(type);
  switch (H5Tget_class(type)) {
    case H5T_FLOAT:
      return fmt::format("float{}", bits);
    case H5T_INTEGER:
      return fmt::format("{}int{}", H5Tget_sign(type) == H5T_SGN_NONE ? "u" : "", bits);
    case H5T_STRING:
      return "text";
    default:
      return "other";
  }
}

/// Least and largest value, read in slices along the first dimension.
template <class T>
std::string describe_range(const Listing& listing, const std::string& name, hid_t dataset,
                           std::vector<hsize_t> extent) {
  if (extent.empty()) extent = {1};
  hsize_t width = 1;
  for (std::size_t d = 1; d < extent.size(); ++d) width *= extent[d];
  if (extent[0] * width == 0) return "no values";
  constexpr hsize_t values_in_slice = 1 << 18;
  const hsize_t slice = std::max<hsize_t>(1, values_in_slice / width);
  std::vector<T> values(static_cast<std::size_t>(std::min(slice, extent[0]) * width));
  T least = std::numeric_limits<T>::max(), largest = std::numeric_limits<T>::lowest();
  std::size_t not_finite = 0;
  std::vector<hsize_t> start(extent.size(), 0), count = extent;
  for (; start[0] < extent[0]; start[0] += slice) {
    count[0] = std::min(slice, extent[0] - start[0]);
    const Handle in_file(H5Dget_space(dataset), H5Sclose);
    const Handle in_memory(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), H5Sclose);
    if (H5Sget_simple_extent_ndims(in_file) > 0)
      H5Sselect_hyperslab(in_file, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
    errno = 0;
    if (H5Dread(dataset, hdf5::native_type<T>(), in_memory, in_file, H5P_DEFAULT, values.data()) < 0)
      damaged(listing.file, "dataset " + name);
    for (std::size_t i = 0; i < count[0] * width; ++i) {
      if (!std::isfinite(static_cast<double>(values[i])))
        ++not_finite;
      else
        least = std::min(least, values[i]), largest = std::max(largest, values[i]);
    }
  }
  const std::string bad = not_finite == 0 ? "" : fmt::format("{} not finite", not_finite);
  if (least > largest) return bad;
  return fmt::format("{:.6g} .. {:.6g}{}{}", static_cast<double>(least), static_cast<double>(largest),
                     bad.empty() ? "" : ", ", bad);
}

/// Why the values of a dataset are not read; empty where they are.
std::string reason_not_to_read(const Listing& listing, hid_t dataset, hid_t space, hid_t type) {
  const Handle properties(H5Dget_create_plist(dataset), H5Pclose);
  const H5D_layout_t layout = H5Pget_layout(properties);
  if (layout == H5D_VIRTUAL || (layout == H5D_CONTIGUOUS && H5Pget_external_count(properties) > 0))
    return "in other files, not read";
  std::error_code ignored;
  constexpr double densest = 64;  // bytes of values in a byte of a compressed file
  const double bytes =
      static_cast<double>(H5Sget_simple_extent_npoints(space)) * static_cast<double>(H5Tget_size(type));
  const auto there = static_cast<double>(std::filesystem::file_size(listing.file, ignored));
  return bytes > densest * there ? "more values than the file can hold, not read" : "";
}

void describe_dataset(Listing& listing, const std::string& path, const std::string& name, hid_t dataset) {
  const Handle space(H5Dget_space(dataset), H5Sclose), type(H5Dget_type(dataset), H5Tclose);
  std::vector<hsize_t> extent(static_cast<std::size_t>(std::max(0, H5Sget_simple_extent_ndims(space))));
  H5Sget_simple_extent_dims(space, extent.data(), nullptr);
  std::string range = reason_not_to_read(listing, dataset, space, type);
  const bool readable = range.empty();
  if (readable && H5Tget_class(type) == H5T_FLOAT)
    range = describe_range<double>(listing, path, dataset, extent);
  else if (readable && H5Tget_class(type) == H5T_INTEGER)
    range = describe_range<std::int64_t>(listing, path, dataset, extent);
  const std::string shape = extent.empty() ? "1" : fmt::format("{}", fmt::join(extent, " x "));
  const bool column = path == name || path == "VTKHDF/PointData/" + name;  // named as users name it
  listing.rows.push_back({column ? with_unit(name) : path, shape, describe_type(type), range});
}

std::vector<std::string> entries_of(hid_t group) {
  std::vector<std::string> names;
  const auto collect = [](hid_t, const char* name, const H5L_info_t*, void* data) -> herr_t {
    static_cast<std::vector<std::string>*>(data)->emplace_back(name);
    return 0;
  };
  H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names);
  return names;
}

/// What a link is that leads out of the file, or to nothing; empty for one that is followed.
std::string unfollowed_link(hid_t group, const std::string& name) {
  H5L_info_t link;
  if (H5Lget_info(group, name.c_str(), &link, H5P_DEFAULT) < 0) return "broken link";
  if (link.type == H5L_TYPE_HARD) return {};
  if (link.type == H5L_TYPE_SOFT)
    return H5Oexists_by_name(group, name.c_str(), H5P_DEFAULT) > 0 ? "" : "link to nothing";
  return "link to another file";
}

/// Lists the datasets of a group, then those of the groups in it.
void describe_group(Listing& listing, hid_t group, const std::string& prefix, int depth = 0) {
  std::vector<std::string> groups;
  for (const auto& name : entries_of(group)) {
    const std::string path = prefix + name;
    if (const std::string link = unfollowed_link(group, name); !link.empty()) {
      listing.rows.push_back({path, "", link, "not followed"});
      continue;
    }
    errno = 0;
    const Handle object(H5Oopen(group, name.c_str(), H5P_DEFAULT), H5Oclose);
    H5O_info_t info;
    if (!object.valid() || H5Oget_info2(object, &info, H5O_INFO_BASIC) < 0) damaged(listing.file, path);
    if (!listing.seen.insert(info.addr).second) continue;
    if (info.type == H5O_TYPE_GROUP) {
      groups.push_back(name);
    } else if (info.type == H5O_TYPE_DATASET &&
               (prefix != "VTKHDF/" || std::find(structural.begin(), structural.end(), name) == structural.end())) {
      describe_dataset(listing, path, name, object);
    }
  }
  for (const auto& name : groups) {
    if (depth == deepest) {
      listing.rows.push_back({prefix + name, "", "group", "too deep, not read"});
      continue;
    }
    const Handle inner(H5Gopen2(group, name.c_str(), H5P_DEFAULT), H5Gclose);
    describe_group(listing, inner, prefix + name + "/", depth + 1);
  }
}

std::string format_table(const std::vector<std::array<std::string, 4>>& rows) {
  std::array<std::size_t, 4> width{};
  for (const auto& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], row[c].size());
  std::string text;
  for (const auto& row : rows) {
    std::string line =
        fmt::format("  {:<{}}  {:<{}}  {:<{}}  {}", row[0], width[0], row[1], width[1], row[2], width[2], row[3]);
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

/// What a checkpoint holds besides its columns.
std::string describe_checkpoint(hid_t root) {
  const auto number = [&](const std::string& name) {
    double value = 0;
    hdf5::read_attribute(root, name, value);
    return value;
  };
  const auto rows = [&](const char* name) {
    const Handle dataset(H5Dopen2(root, name, H5P_DEFAULT), H5Dclose);
    const Handle space(dataset.valid() ? H5Dget_space(dataset) : H5I_INVALID_HID, H5Sclose);
    return space.valid() ? H5Sget_simple_extent_npoints(space) : 0;
  };
  std::string written;
  for (const char* kind : {"history", "particles", "grains", "contacts", "checkpoint"})
    written += fmt::format("{}{} {}", written.empty() ? "" : ", ", number(std::string(kind) + "_count"), kind);
  return fmt::format(
      "{} points in {} pieces of bodies in {} patches, {}D; last dt {} s, energy error {:.3g}\n"
      "outputs written so far: {}; history.csv was {} bytes long\n"
      "go on with: cairn run CASE.toml --out DIR --restart FILE\n",
      number("rows"), rows("piece_body"), rows("patch_points"), number("dimension"), number("dt"),
      number("energy_error"), written, number("history_bytes"));
}

/// The attributes of the root that a file of this program has, where it has them.
std::string describe_header(const std::filesystem::path& file, hid_t root) {
  const bool vtk = H5Lexists(root, "VTKHDF", H5P_DEFAULT) > 0;
  std::string kind, text, facts;
  if (!hdf5::read_attribute(root, "kind", kind)) kind = vtk ? "points" : "HDF5 file, not written by cairn";
  text = fmt::format("{}: {}{}\n", file.filename().string(), kind, vtk ? " (VTKHDF: opens in ParaView)" : "");
  double time = 0;
  std::int64_t step = 0, rows = 0;
  if (hdf5::read_attribute(root, "time", time)) facts += fmt::format("time {} s", time);
  if (hdf5::read_attribute(root, "step", step)) facts += fmt::format("{}step {}", facts.empty() ? "" : ", ", step);
  if (hdf5::read_attribute(root, "rows", rows)) facts += fmt::format("{}{} rows", facts.empty() ? "" : ", ", rows);
  if (!facts.empty()) text += facts + "\n";
  std::string version, commit;
  if (hdf5::read_attribute(root, "version", version) && hdf5::read_attribute(root, "commit", commit))
    text += fmt::format("written by cairn {}, commit {}\n", version, commit);
  return kind == "checkpoint" ? text + describe_checkpoint(root) : text;
}

}  // namespace

std::string describe_file(const std::filesystem::path& file) {
  hdf5::prepare();
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) throw InputError(file.string() + ": no such file");
  if (!std::filesystem::is_regular_file(file, ignored)) throw InputError(file.string() + ": not a file");
  errno = 0;
  const htri_t is_hdf5 = H5Fis_hdf5(file.c_str());
  if (is_hdf5 < 0) damaged(file, "it");
  if (is_hdf5 == 0) throw InputError(file.string() + ": not an HDF5 file");
  errno = 0;
  const Handle handle(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!handle.valid())
    throw InputError(
        fmt::format("{}: an HDF5 file that is damaged or cut short: {}", file.string(), hdf5::error_text()));
  const Handle root(H5Gopen2(handle, "/", H5P_DEFAULT), H5Gclose);
  if (!root.valid()) damaged(file, "the root group");
  Listing listing{file, {}, {{"dataset", "shape", "type", "range"}}};
  const std::string header = describe_header(file, root);
  describe_group(listing, root, "");
  return header + format_table(listing.rows);
}

}  // namespace cairn
