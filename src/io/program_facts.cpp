#include "cairn/io/program_facts.hpp"

#include <fmt/format.h>
#include <hdf5.h>
#include <metis.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <vector>

#include "cairn/core/printable.hpp"
#include "cairn_commit.hpp"

namespace cairn {
namespace {

/// The widest vector instructions the compiler was allowed to use.
constexpr const char* vectors() {
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

std::string instruction_set() {
  const std::string level = CAIRN_LEVEL;
  return level.starts_with('v') ? fmt::format("x86-64-{}", level) : fmt::format("{} ({})", level, vectors());
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
  std::array<char, MPI_MAX_LIBRARY_VERSION_STRING> text{};
  int length = 0;
  MPI_Get_library_version(text.data(), &length);
  // The first words: Open MPI goes on behind a comma, and MPICH says "MPICH Version:" and a tab.
  std::string line;
  for (const char c : std::string_view(text.data(), static_cast<std::size_t>(length))) {
    if (c == ',' || c == '\n') break;
    if (c == '\t' || c == ' ') {
      if (!line.empty() && line.back() != ' ') line.push_back(' ');
    } else if (c != ':') {
      line.push_back(c);
    }
  }
  return line;
}

ProgramFacts collect() {
  std::array<unsigned, 3> hdf5{};
  H5get_libversion(&hdf5[0], &hdf5[1], &hdf5[2]);
  return {CAIRN_VERSION,
          CAIRN_COMMIT,
          compiler(),
          instruction_set(),
          mpi_text(),
          fmt::format("{}.{}.{}", hdf5[0], hdf5[1], hdf5[2]),
          fmt::format("{}.{}.{}", METIS_VER_MAJOR, METIS_VER_MINOR, METIS_VER_SUBMINOR)};
}

}  // namespace

const ProgramFacts& program_facts() {
  static const ProgramFacts facts = collect();
  return facts;
}

std::string program_disagreement(MPI_Comm comm, const ProgramFacts& facts) {
  constexpr std::size_t width = 256;
  const auto keep = [](std::array<char, width>& place, std::string_view text) {
    std::memcpy(place.data(), text.data(), std::min(width - 1, text.size()));
  };
  int ranks = 1, length = 0;
  MPI_Comm_size(comm, &ranks);
  std::array<char, MPI_MAX_PROCESSOR_NAME> host{};
  MPI_Get_processor_name(host.data(), &length);
  struct Rank {
    std::array<char, width> program, host, level, wanted;
  };
  Rank mine{};
  const std::string program =
      fmt::format("cairn {} {}, {}, {}", facts.version, facts.commit, facts.instruction_set, facts.compiler);
  keep(mine.program, program);
  keep(mine.host, std::string_view(host.data(), static_cast<std::size_t>(length)));
  keep(mine.level, facts.instruction_set);
  if (const char* wanted = std::getenv("CAIRN_ISA")) keep(mine.wanted, wanted);
  std::vector<Rank> all(static_cast<std::size_t>(ranks));
  MPI_Allgather(&mine, sizeof mine, MPI_BYTE, all.data(), sizeof mine, MPI_BYTE, comm);
  for (const Rank& other : all)
    if (other.program != all[0].program)
      return fmt::format(
          "the ranks run programs that differ, and would not give one result: '{}' on {} (rank 0) and '{}' on {} (rank "
          "{}); give all of them one program, and one CAIRN_ISA where the machines differ",
          all[0].program.data(), all[0].host.data(), other.program.data(), other.host.data(), &other - all.data());
  for (const Rank& other : all)
    if (other.wanted[0] != '\0' && other.wanted != other.level)
      return fmt::format(
          "CAIRN_ISA={} on {}: this program is built for {} alone; unset it, or build with CAIRN_NATIVE=OFF",
          printable(other.wanted.data()), other.host.data(), other.level.data());
  return {};
}

}  // namespace cairn
