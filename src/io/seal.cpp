#include "seal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include "cairn/io/agreement.hpp"
#include "cairn/io/checksum.hpp"
#include "posix_file.hpp"

namespace cairn {

namespace {

constexpr std::int64_t chunk_bytes = std::int64_t{1} << 22;

/// The words of the seal: a mark, the length of what is sealed, its checksum, a word to spare, the words' checksum.
using Seal = std::array<std::uint64_t, 5>;
constexpr std::uint64_t mark = 0x31'4C'41'45'53'4E'52'43;  // "CRNSEAL1"
constexpr auto seal_bytes = static_cast<std::int64_t>(sizeof(Seal));

Seal make_seal(std::int64_t length, std::uint64_t sum) {
  Seal seal = {mark, static_cast<std::uint64_t>(length), sum, 0, 0};
  seal[4] = checksum(std::span<const std::uint64_t>(seal.data(), 4));
  return seal;
}

/// Checksum of the checksums of the file's chunks, of which each rank computes some; valid on every rank unless `error`
/// says what went wrong on this one. Collective.
std::uint64_t checksum_of(const PosixFile& file, std::int64_t length, MPI_Comm comm, std::string& error) {
  int rank = 0, ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  const std::int64_t chunks = (length + chunk_bytes - 1) / chunk_bytes;
  std::vector<std::uint64_t> sums(static_cast<std::size_t>(chunks), 0);
  std::vector<std::byte> buffer(static_cast<std::size_t>(std::min(length, chunk_bytes)));
  for (std::int64_t c = rank; c < chunks && error.empty(); c += ranks) {
    const std::int64_t count = std::min(chunk_bytes, length - c * chunk_bytes);
    errno = 0;
    if (!file.read(buffer.data(), count, c * chunk_bytes))
      error = fmt::format("it cannot be read: {}", errno != 0 ? std::strerror(errno) : "it ends early");
    sums[static_cast<std::size_t>(c)] =
        checksum(std::span<const std::byte>(buffer).first(static_cast<std::size_t>(count)));
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(chunks), MPI_UINT64_T, MPI_SUM, comm);
  return checksum(std::span<const std::uint64_t>(sums));
}

/// What the end of the file shows, before its content is read.
std::string check_end(const PosixFile& file, Seal& seal) {
  constexpr std::array<unsigned char, 8> hdf5_mark = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
  const std::int64_t size = file.size();
  if (size < 0) return "not a file";
  std::array<unsigned char, 8> start{};
  if (size < seal_bytes || !file.read(start.data(), sizeof start, 0)) return "too short for a checkpoint of cairn";
  if (start != hdf5_mark) return "not a checkpoint of cairn, or damaged: it does not start as an HDF5 file";
  if (!file.read(seal.data(), seal_bytes, size - seal_bytes)) return "its end cannot be read";
  if (seal[0] != mark) return "not a checkpoint of cairn, or cut short or damaged: its end lacks the seal";
  if (seal != make_seal(static_cast<std::int64_t>(seal[1]), seal[2])) return "damaged: the seal at its end is broken";
  if (static_cast<std::int64_t>(seal[1]) != size - seal_bytes)
    return fmt::format("damaged: it holds {} bytes instead of {}", size - seal_bytes, seal[1]);
  return {};
}

}  // namespace

std::string seal(const std::filesystem::path& file, MPI_Comm comm) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  errno = 0;
  const PosixFile open(file, O_NOFOLLOW | (rank == 0 ? O_RDWR : O_RDONLY));
  std::int64_t length = open.valid() ? open.size() : -1;
  std::string error = length < 0 ? fmt::format("it cannot be read back: {}", std::strerror(errno)) : "";
  error = common_error(comm, error);
  if (!error.empty()) return error;
  const std::uint64_t sum = checksum_of(open, length, comm, error);
  if (error.empty() && rank == 0) {
    const Seal words = make_seal(length, sum);
    errno = 0;
    if (!open.write(words.data(), seal_bytes, length)) error = std::strerror(errno != 0 ? errno : ENOSPC);
  }
  return common_error(comm, error);
}

std::string check_seal(const std::filesystem::path& file, MPI_Comm comm) {
  errno = 0;
  const PosixFile open(file, O_RDONLY);
  Seal seal{};
  const bool missing = !open.valid() && errno == ENOENT;
  std::string error = missing         ? "no such file"
                      : !open.valid() ? fmt::format("it cannot be read: {}", std::strerror(errno))
                                      : check_end(open, seal);
  error = common_error(comm, error);
  if (!error.empty()) return error;
  const std::uint64_t sum = checksum_of(open, static_cast<std::int64_t>(seal[1]), comm, error);
  if (error.empty() && sum != seal[2]) error = "damaged: its content does not match its checksum";
  return common_error(comm, error);
}

}  // namespace cairn
