#include <fmt/format.h>
#include <hdf5.h>
#include <metis.h>
#include <mpi.h>

#include "commands.hpp"

namespace cairn::app {
namespace {

/// The widest vector instructions the compiler was allowed to use.
constexpr const char* instruction_set() {
#if defined(__AVX512F__)
  return "AVX-512";
#elif defined(__AVX2__) && defined(__FMA__)
  return "AVX2 with FMA";
#elif defined(__AVX2__)
  return "AVX2";
#elif defined(__AVX__)
  return "AVX";
#elif defined(__SSE2__)
  return "SSE2";
#elif defined(__ARM_FEATURE_SVE)
  return "SVE";
#elif defined(__ARM_NEON)
  return "NEON";
#else
  return "scalar";
#endif
}

constexpr const char* compiler() {
#if defined(__clang__)
  return "Clang " __clang_version__;
#elif defined(__GNUC__)
  return "GCC " __VERSION__;
#else
  return "unknown";
#endif
}

std::string mpi_text() {
  char text[MPI_MAX_LIBRARY_VERSION_STRING] = {};
  int length = 0;
  MPI_Get_library_version(text, &length);
  const std::string_view all(text, static_cast<std::size_t>(length));
  return std::string(all.substr(0, all.find_first_of(",\n")));
}

}  // namespace

std::string version_text() {
  unsigned hdf5[3] = {};
  H5get_libversion(&hdf5[0], &hdf5[1], &hdf5[2]);
  return fmt::format(
      "cairn {}\ncompiler         {}\nMPI              {}\nHDF5             {}.{}.{}\nMETIS            "
      "{}.{}.{}\ninstruction set  {}",
      CAIRN_VERSION, compiler(), mpi_text(), hdf5[0], hdf5[1], hdf5[2], METIS_VER_MAJOR, METIS_VER_MINOR,
      METIS_VER_SUBMINOR, instruction_set());
}

}  // namespace cairn::app
