// Data sets and attributes of a checkpoint, edited at random.

#include <fmt/format.h>
#include <hdf5.h>
#include <mpi.h>

#include <cstring>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "../../src/io/hdf5.hpp"
#include "../../src/io/seal.hpp"
#include "forger.hpp"

namespace cairn::fuzz {
namespace {

using hdf5::Handle;

constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();

std::vector<std::string> names_of(hid_t root) {
  std::vector<std::string> names;
  const auto collect = [](hid_t, const char* name, const H5L_info_t*, void* data) -> herr_t {
    static_cast<std::vector<std::string>*>(data)->emplace_back(name);
    return 0;
  };
  H5Literate(root, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names);
  return names;
}

std::vector<std::string> attributes_of(hid_t root) {
  std::vector<std::string> names;
  const auto collect = [](hid_t, const char* name, const H5A_info_t*, void* data) -> herr_t {
    static_cast<std::vector<std::string>*>(data)->emplace_back(name);
    return 0;
  };
  H5Aiterate2(root, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names);
  return names;
}

double any_double(Random& random) {
  return random.any(std::vector<double>{nan, infinity, -infinity, 0, -0.0, -1, 1, 1e300, -1e300, 5e-324, 1e9, 0.5});
}
std::int64_t any_integer(Random& random) {
  using Limits = std::numeric_limits<std::int64_t>;
  return random.any(std::vector<std::int64_t>{0, -1, 1, 2, 3, 7, 1000, 1 << 30, std::int64_t{1} << 40, Limits::max(),
                                              Limits::min(), Limits::max() / 8 + 1,
                                              static_cast<std::int64_t>(random.below(1u << 31))});
}

/// Gives an attribute another value, type or shape.
std::string edit_attribute(hid_t root, const std::string& name, Random& random) {
  const std::size_t kind = random.below(8);
  if (kind == 0) {
    H5Adelete(root, name.c_str());
    return "without attribute " + name;
  }
  if (kind == 1) {
    H5Arename(root, name.c_str(), (name + "_").c_str());
    return "another name for attribute " + name;
  }
  const bool real = kind < 4
                        ? H5Tget_class(Handle(H5Aget_type(Handle(H5Aopen(root, name.c_str(), H5P_DEFAULT), H5Aclose)),
                                              H5Tclose)) == H5T_FLOAT
                        : random.below(2) == 0;
  H5Adelete(root, name.c_str());
  const hsize_t extent = kind == 4 ? 3 : kind == 5 ? 0 : 1;
  const Handle space(kind == 6  ? H5Screate(H5S_NULL)
                     : kind < 4 ? H5Screate(H5S_SCALAR)
                                : H5Screate_simple(1, &extent, nullptr),
                     H5Sclose);
  const Handle text(H5Tcopy(H5T_C_S1), H5Tclose);
  if (kind == 7) H5Tset_size(text, random.below(2) ? 60'000 : static_cast<std::size_t>(H5T_VARIABLE));
  const hid_t type = kind == 7 ? hid_t{text}
                     : real    ? random.any(std::vector<hid_t>{H5T_NATIVE_DOUBLE, H5T_NATIVE_FLOAT, H5T_IEEE_F64BE})
                               : random.any(std::vector<hid_t>{H5T_NATIVE_INT64, H5T_NATIVE_INT8, H5T_NATIVE_UINT64});
  const Handle attribute(H5Acreate2(root, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const std::vector<double> doubles(3, any_double(random));
  const std::vector<std::int64_t> integers(3, any_integer(random));
  const std::string letters(60'000, 'x');
  const char* pointer = letters.c_str();
  if (kind == 7)
    H5Awrite(attribute, type, H5Tis_variable_str(type) > 0 ? static_cast<const void*>(&pointer) : letters.data());
  else if (kind != 6 && kind != 5)
    H5Awrite(attribute, real ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT64,
             real ? static_cast<const void*>(doubles.data()) : integers.data());
  return fmt::format("attribute {} = {} or {}, kind {}", name, doubles[0], integers[0], kind);
}

/// The values of a dataset as they lie in memory.
struct Values {
  Handle type;
  std::vector<hsize_t> extent;
  std::vector<std::byte> bytes;
  std::size_t width() const { return H5Tget_size(type); }
  std::size_t size() const { return bytes.size() / width(); }
};

Values read(hid_t dataset) {
  Values v;
  v.type = Handle(H5Dget_type(dataset), H5Tclose);
  const Handle space(H5Dget_space(dataset), H5Sclose);
  v.extent.resize(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
  H5Sget_simple_extent_dims(space, v.extent.data(), nullptr);
  v.bytes.resize(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)) * v.width());
  H5Dread(dataset, v.type, H5S_ALL, H5S_ALL, H5P_DEFAULT, v.bytes.data());
  return v;
}

/// Writes one or some values, or exchanges two.
std::string edit_values(hid_t dataset, const std::string& name, Random& random) {
  Values v = read(dataset);
  if (v.size() == 0) return "nothing in " + name;
  const std::size_t at = random.below(v.size()), other = random.below(v.size()), kind = random.below(4);
  std::byte* place = v.bytes.data() + at * v.width();
  const double real = any_double(random);
  const std::int64_t integer = any_integer(random);
  if (kind == 0) {
    std::swap_ranges(place, place + v.width(), v.bytes.data() + other * v.width());
  } else if (kind == 1) {
    place[random.below(v.width())] ^= static_cast<std::byte>(1 + random.below(255));
  } else if (const auto single = static_cast<float>(real); H5Tget_class(v.type) == H5T_FLOAT) {
    v.width() == sizeof single ? std::memcpy(place, &single, sizeof single) : std::memcpy(place, &real, sizeof real);
  } else {
    std::memcpy(place, &integer, std::min(v.width(), sizeof integer));
  }
  if (kind == 3)
    for (std::size_t i = 0; i < v.size(); ++i) std::memmove(v.bytes.data() + i * v.width(), place, v.width());
  H5Dwrite(dataset, v.type, H5S_ALL, H5S_ALL, H5P_DEFAULT, v.bytes.data());
  return fmt::format("value {} of {}, kind {}, {} or {}", at, name, kind, real, integer);
}

/// How a dataset may be laid out anew.
enum Layout { shorter, longer, flat, deep, none, scalar, chunked, packed, compact, elsewhere, endless, layouts };

std::vector<hsize_t> other_extent(std::vector<hsize_t> extent, Layout layout, Random& random) {
  if (extent.empty()) extent = {1};  // of one that was made anew without
  if (layout == shorter) extent[0] = extent[0] > 0 ? extent[0] - 1 : 0;
  if (layout == longer) extent[0] += 1 + random.below(3);
  if (layout == flat) extent = {extent[0] * (extent.size() > 1 ? extent[1] : 1)};
  if (layout == deep) extent.insert(extent.end(), {1, 1});
  if (layout == endless)
    extent[0] =
        random.any(std::vector<hsize_t>{hsize_t{1} << 31, hsize_t{1} << 40, (hsize_t{1} << 60) - 1, hsize_t{1} << 62});
  return extent;
}

/// Makes a dataset anew with another type, shape or layout.
std::string remake(hid_t root, const std::string& name, Random& random) {
  Values v = read(Handle(H5Dopen2(root, name.c_str(), H5P_DEFAULT), H5Dclose));
  const auto layout = static_cast<Layout>(random.below(layouts));
  const auto extent = other_extent(v.extent, layout, random);
  const auto rank = static_cast<int>(extent.size());
  const Handle space(layout == none     ? H5Screate(H5S_NULL)
                     : layout == scalar ? H5Screate(H5S_SCALAR)
                                        : H5Screate_simple(rank, extent.data(), nullptr),
                     H5Sclose);
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  std::vector<hsize_t> chunk(extent.size(), 1);
  if (layout == chunked || layout == packed) H5Pset_chunk(properties, rank, chunk.data());
  if (layout == packed) H5Pset_shuffle(properties);
  if (layout == compact) H5Pset_layout(properties, H5D_COMPACT);
  if (layout == elsewhere) H5Pset_external(properties, "/etc/passwd", 0, H5F_UNLIMITED);
  if (layout == endless) H5Pset_alloc_time(properties, H5D_ALLOC_TIME_LATE);
  const Handle pair(H5Tcreate(H5T_COMPOUND, 16), H5Tclose);
  H5Tinsert(pair, "a", 0, H5T_NATIVE_DOUBLE);
  const hid_t type = random.below(2)
                         ? hid_t{v.type}
                         : random.any(std::vector<hid_t>{H5T_NATIVE_DOUBLE, H5T_NATIVE_INT32, H5T_NATIVE_INT64,
                                                         H5T_NATIVE_UINT8, H5T_NATIVE_FLOAT, H5T_IEEE_F64BE, H5T_C_S1,
                                                         H5T_STD_REF_OBJ, H5T_NATIVE_OPAQUE, hid_t{pair}});
  H5Ldelete(root, name.c_str(), H5P_DEFAULT);
  const Handle dataset(H5Dcreate2(root, name.c_str(), type, space, H5P_DEFAULT, properties, H5P_DEFAULT), H5Dclose);
  v.bytes.resize(v.bytes.size() + 4096 * 16);
  if (dataset.valid() && layout != none && layout != endless && layout != elsewhere && H5Tequal(type, v.type) > 0)
    H5Dwrite(dataset, v.type, H5S_ALL, H5S_ALL, H5P_DEFAULT, v.bytes.data());
  return fmt::format("{} made anew, layout {}, type {}", name, static_cast<int>(layout),
                     H5Tequal(type, v.type) > 0 ? "kept" : "changed");
}

/// Puts something else in the place of a dataset.
std::string relink(hid_t root, const std::string& name, const std::string& other, Random& random) {
  if (name != other || random.below(2)) H5Ldelete(root, name.c_str(), H5P_DEFAULT);
  switch (random.below(4)) {
    case 0:
      return "without " + name;
    case 1:
      H5Lcreate_soft(("/" + other).c_str(), root, name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
      return fmt::format("{} is a link to {}", name, other);
    case 2:
      Handle(H5Gcreate2(root, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
      return name + " is a group";
    default:
      H5Lcreate_hard(root, other.c_str(), root, name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
      return fmt::format("{} is {}", name, other);
  }
}

std::string edit(hid_t root, Random& random) {
  const auto datasets = names_of(root), attributes = attributes_of(root);
  if (random.below(5) == 0 && !attributes.empty()) return edit_attribute(root, random.any(attributes), random);
  const std::string& name = random.any(datasets);
  const Handle dataset(H5Dopen2(root, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!dataset.valid()) return "nothing at " + name;
  const std::size_t kind = random.below(10);
  if (kind < 6) return edit_values(dataset, name, random);
  return kind < 9 ? remake(root, name, random) : relink(root, name, random.any(datasets), random);
}

}  // namespace

std::string edit_file(const std::string& bytes, const std::filesystem::path& file, Random& random) {
  std::ofstream(file, std::ios::binary) << bytes;
  std::string what;
  {
    Handle open(H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose);
    const Handle root(H5Gopen2(open, "/", H5P_DEFAULT), H5Gclose);
    if (!root.valid()) throw std::logic_error("the good checkpoint cannot be opened");
    for (std::size_t i = 0, edits = 1 + random.below(2); i < edits; ++i) what += (i ? "; " : "") + edit(root, random);
  }
  const std::string error = seal(file, MPI_COMM_SELF);
  if (!error.empty()) throw std::logic_error(error);
  return what;
}

}  // namespace cairn::fuzz
