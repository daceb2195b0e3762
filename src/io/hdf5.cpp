#include "hdf5.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace cairn::hdf5 {

namespace {

/// Collects the innermost entries of the error stack, which say the cause; the outer ones only repeat it.
herr_t collect_error(unsigned depth, const H5E_error2_t* entry, void* data) {
  auto& text = *static_cast<std::string*>(data);
  if (depth >= 2 || entry->desc == nullptr || entry->desc[0] == '\0') return 0;
  if (text.find(entry->desc) == std::string::npos) text += (text.empty() ? "" : "; ") + std::string(entry->desc);
  return 0;
}

bool write_value(hid_t object, const std::string& name, hid_t type, hid_t space, const void* value) {
  const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.valid() && H5Awrite(attribute, type, value) >= 0;
}

bool write_text(hid_t object, const std::string& name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
  // HDF5 has no strings of length 0.
  const std::string text = value.empty() ? std::string(1, '\0') : value;
  return H5Tset_size(type, text.size()) >= 0 && H5Tset_strpad(type, H5T_STR_NULLPAD) >= 0 &&
         write_value(object, name, type, space, text.data());
}

Handle open_attribute(hid_t object, const std::string& name) {
  if (H5Aexists(object, name.c_str()) <= 0) return {};
  return {H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose};
}

template <class T>
bool read_number(hid_t object, const std::string& name, T& value) {
  const Handle attribute = open_attribute(object, name);
  if (!attribute.valid()) return false;
  const Handle space(H5Aget_space(attribute), H5Sclose), type(H5Aget_type(attribute), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type);
  if (H5Sget_simple_extent_npoints(space) != 1 || (kind != H5T_INTEGER && kind != H5T_FLOAT)) return false;
  return H5Aread(attribute, native_type<T>(), &value) >= 0;
}

}  // namespace

void prepare() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  ::setenv("HDF5_USE_FILE_LOCKING", "BEST_EFFORT", 0);  // file systems of clusters often have no locks
  H5Lunregister(H5L_TYPE_EXTERNAL);                     // a file is what it holds: nothing is opened that it names
}

std::string error_text() {
  const int system_error = errno;
  std::string text;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, collect_error, &text);
  const std::string reason = system_error != 0 ? std::strerror(system_error) : "";
  if (reason.empty() || text.find(reason) != std::string::npos) return text.empty() ? "unknown HDF5 error" : text;
  return text.empty() ? reason : reason + " (" + text + ")";
}

bool write_attribute(hid_t object, const std::string& name, const AttributeValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return write_text(object, name, *text);
  if (const auto* numbers = std::get_if<std::span<const std::int64_t>>(&value)) {
    const hsize_t count = numbers->size();
    const Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose);
    return write_value(object, name, H5T_NATIVE_INT64, space, numbers->data());
  }
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  if (const auto* number = std::get_if<double>(&value))
    return write_value(object, name, H5T_NATIVE_DOUBLE, space, number);
  return write_value(object, name, H5T_NATIVE_INT64, space, &std::get<std::int64_t>(value));
}

bool read_attribute(hid_t object, const std::string& name, double& value) { return read_number(object, name, value); }

bool read_attribute(hid_t object, const std::string& name, std::int64_t& value) {
  return read_number(object, name, value);
}

bool read_attribute(hid_t object, const std::string& name, std::string& value) {
  const Handle attribute = open_attribute(object, name);
  if (!attribute.valid()) return false;
  const Handle type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0 || H5Sget_simple_extent_npoints(space) != 1)
    return false;
  constexpr std::size_t longest = 1 << 20;
  if (H5Tget_size(type) > longest) return false;
  std::vector<char> text(H5Tget_size(type) + 1, '\0');
  if (H5Aread(attribute, type, text.data()) < 0) return false;
  value = text.data();
  return true;
}

}  // namespace cairn::hdf5
