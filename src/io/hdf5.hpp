#pragma once
/// The few HDF5 wrappers that readers and writers share: handles that close themselves, types, and errors as text.

#include <hdf5.h>

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <variant>

namespace cairn::hdf5 {

/// An HDF5 identifier that is closed when it goes out of scope; empty where the call that made it failed.
class Handle {
 public:
  Handle() = default;
  Handle(hid_t id, herr_t (*closer)(hid_t)) : id_(id), closer_(closer) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), closer_(other.closer_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(closer_, other.closer_);
    return *this;
  }
  ~Handle() { close(); }
  /// Closes now; false where HDF5 reports an error.
  bool close() { return id_ < 0 || closer_(std::exchange(id_, H5I_INVALID_HID)) >= 0; }
  operator hid_t() const { return id_; }
  bool valid() const { return id_ >= 0; }

 private:
  hid_t id_ = H5I_INVALID_HID;
  herr_t (*closer_)(hid_t) = nullptr;
};

/// Stops HDF5 from printing its error stack, from insisting on locks, and from following links to other files. Call
/// before the first use of HDF5 by a function that reports errors itself.
void prepare();

/// What the HDF5 call that just failed says was wrong, with the system's message if there is one. Call it before any
/// other HDF5 function, and set errno to 0 before the call that may fail.
std::string error_text();

template <class T>
hid_t native_type();
template <>
inline hid_t native_type<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
inline hid_t native_type<std::int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
inline hid_t native_type<std::int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
inline hid_t native_type<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}

/// Value of an attribute: number, numbers or text (stored as a string of fixed length, which all VTK readers take).
using AttributeValue = std::variant<double, std::int64_t, std::span<const std::int64_t>, std::string>;

/// Creates an attribute of an open object; false where HDF5 reports an error. Collective in a file opened by several
/// ranks.
bool write_attribute(hid_t object, const std::string& name, const AttributeValue& value);

/// Reads a number or a text of fixed length; false where there is none of this name and type.
bool read_attribute(hid_t object, const std::string& name, double& value);
bool read_attribute(hid_t object, const std::string& name, std::int64_t& value);
bool read_attribute(hid_t object, const std::string& name, std::string& value);

}  // namespace cairn::hdf5
