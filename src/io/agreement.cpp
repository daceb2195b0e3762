#include "cairn/io/agreement.hpp"

#include <limits>

#include "cairn/core/error.hpp"

namespace cairn {

std::string common_error(MPI_Comm comm, const std::string& local_error) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  constexpr int nobody = std::numeric_limits<int>::max();
  int mine = local_error.empty() ? nobody : rank, first = nobody;
  MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, comm);
  if (first == nobody) return {};
  std::string message = rank == first ? local_error : std::string();
  int length = static_cast<int>(message.size());
  MPI_Bcast(&length, 1, MPI_INT, first, comm);
  message.resize(static_cast<std::size_t>(length));
  MPI_Bcast(message.data(), length, MPI_CHAR, first, comm);
  return message;
}

void throw_together(MPI_Comm comm, const std::string& local_error) {
  const std::string message = common_error(comm, local_error);
  if (!message.empty()) throw RunError(message);
}

}  // namespace cairn
