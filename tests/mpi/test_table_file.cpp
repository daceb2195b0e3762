// The same table, scattered over the ranks in different ways, gives the same file.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>
#include <functional>
#include <iterator>

#include "cairn/core/error.hpp"
#include "cairn/io/table_file.hpp"

namespace {

using namespace cairn;
namespace fs = std::filesystem;

int rank_of(MPI_Comm comm) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

int size_of(MPI_Comm comm) {
  int size = 1;
  MPI_Comm_size(comm, &size);
  return size;
}

/// A folder that all ranks share, removed at the end.
class TableFileRanks : public testing::Test {
 protected:
  void SetUp() override {
    std::array<char, 256> name{};
    if (rank_of(MPI_COMM_WORLD) == 0) {
      fs::path made = fs::temp_directory_path() / ("cairn_mpi_" + std::to_string(::getpid()));
      fs::create_directories(made);
      made.string().copy(name.data(), name.size() - 1);
    }
    MPI_Bcast(name.data(), static_cast<int>(name.size()), MPI_CHAR, 0, MPI_COMM_WORLD);
    folder_ = name.data();
  }
  void TearDown() override {
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank_of(MPI_COMM_WORLD) == 0) fs::remove_all(folder_);
  }
  fs::path folder_;
};

/// Rows whose values follow from their place in the file; `owner` says which rank holds a block.
struct Rows {
  RowBlocks blocks;
  std::vector<double> position, mass;
  std::vector<std::int32_t> body;
  std::vector<std::int64_t> id;

  Rows(MPI_Comm comm, const std::vector<std::int64_t>& counts, const std::function<int(int)>& owner) {
    std::int64_t row = 0;
    for (std::size_t b = 0; b < counts.size(); ++b, row += counts[b - 1]) {
      if (owner(static_cast<int>(b)) % size_of(comm) != rank_of(comm)) continue;
      blocks.blocks.push_back({row, counts[b]});
      for (std::int64_t r = row; r < row + counts[b]; ++r) add(r);
    }
    blocks.total_rows = row;
  }
  void add(std::int64_t r) {
    const auto x = static_cast<double>(r);
    position.insert(position.end(), {x, 0.5 * x, -x});
    mass.push_back(1.0 / (1.0 + x));
    body.push_back(static_cast<std::int32_t>(r % 7));
    id.push_back(r + 10'000'000'000);
  }
  std::vector<Column> columns() const {
    return {{"position", 3, std::span<const double>(position)},
            {"mass", 1, std::span<const double>(mass)},
            {"body", 1, std::span<const std::int32_t>(body)},
            {"id", 1, std::span<const std::int64_t>(id)}};
  }
};

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Writes distributed and alone, and compares the two files byte by byte.
void expect_same_file(const fs::path& folder, const std::vector<std::int64_t>& counts,
                      const std::function<int(int)>& owner) {
  const Rows shared(MPI_COMM_WORLD, counts, owner);
  write_vtkhdf(folder / "shared.vtkhdf", MPI_COMM_WORLD, shared.blocks, shared.columns(), 0.25, 10);
  if (rank_of(MPI_COMM_WORLD) == 0) {
    const Rows whole(MPI_COMM_SELF, counts, owner);
    write_vtkhdf(folder / "whole.vtkhdf", MPI_COMM_SELF, whole.blocks, whole.columns(), 0.25, 10);
    const std::string a = bytes_of(folder / "shared.vtkhdf"), b = bytes_of(folder / "whole.vtkhdf");
    EXPECT_FALSE(a.empty());
    EXPECT_TRUE(a == b);
    EXPECT_FALSE(fs::exists(folder / ".shared.vtkhdf.part"));
  }
  MPI_Barrier(MPI_COMM_WORLD);
}

TEST_F(TableFileRanks, ScatteredBlocksGiveTheSameFile) {
  std::vector<std::int64_t> counts;
  for (int b = 0; b < 500; ++b) counts.push_back((b * 37) % 11);  // some empty
  expect_same_file(folder_, counts, [](int b) { return (b * 2654435761u) >> 16; });
}

TEST_F(TableFileRanks, RanksWithoutRows) {
  expect_same_file(folder_, {4, 0, 9}, [](int) { return 0; });
  const int last = size_of(MPI_COMM_WORLD) - 1;
  expect_same_file(folder_, {4, 0, 9}, [=](int) { return last; });
}

TEST_F(TableFileRanks, NoRowsAtAll) {
  expect_same_file(folder_, {}, [](int) { return 0; });
  expect_same_file(folder_, {0, 0}, [](int b) { return b; });
}

TEST_F(TableFileRanks, ReadsBackInAnotherDistribution) {
  const std::vector<std::int64_t> counts = {3, 5, 0, 7, 1, 1, 20, 2};
  const Rows written(MPI_COMM_WORLD, counts, [](int b) { return b; });
  write_vtkhdf(folder_ / "a.vtkhdf", MPI_COMM_WORLD, written.blocks, written.columns(), 0.25, 10, "grains");
  const Rows wanted(MPI_COMM_WORLD, counts, [](int b) { return b / 2 + 1; });

  const TableReader reader(folder_ / "a.vtkhdf", MPI_COMM_WORLD);
  EXPECT_EQ(reader.rows(), 39);
  EXPECT_EQ(reader.time(), 0.25);
  EXPECT_EQ(reader.step(), 10);
  EXPECT_EQ(reader.kind(), "grains");
  std::vector<double> position(wanted.position.size()), mass(wanted.mass.size());
  std::vector<std::int32_t> body(wanted.body.size());
  std::vector<std::int64_t> id(wanted.id.size());
  reader.read("position", 3, wanted.blocks, position);
  reader.read("mass", 1, wanted.blocks, mass);
  reader.read("body", 1, wanted.blocks, body);
  reader.read("id", 1, wanted.blocks, id);
  EXPECT_EQ(position, wanted.position);
  EXPECT_EQ(mass, wanted.mass);
  EXPECT_EQ(body, wanted.body);
  EXPECT_EQ(id, wanted.id);
  EXPECT_THROW(reader.read("mass", 3, wanted.blocks, position), InputError);
  EXPECT_THROW(reader.read("colour", 1, wanted.blocks, mass), InputError);
}

/// Runs `write`, which must fail, and checks that every rank gets the same message.
void expect_same_error(const std::function<void()>& write, const std::string& part) {
  std::string message;
  try {
    write();
  } catch (const RunError& error) {
    message = error.what();
  }
  EXPECT_NE(message.find(part), std::string::npos) << message;
  std::array<char, 1024> first{};
  message.copy(first.data(), first.size() - 1);
  MPI_Bcast(first.data(), static_cast<int>(first.size()), MPI_CHAR, 0, MPI_COMM_WORLD);
  EXPECT_EQ(message, first.data());
}

TEST_F(TableFileRanks, AnErrorOfOneRankIsTheErrorOfAll) {
  Rows rows(MPI_COMM_WORLD, {5, 5, 5, 5}, [](int b) { return b; });
  const int last = size_of(MPI_COMM_WORLD) - 1;
  if (rank_of(MPI_COMM_WORLD) == last) rows.mass.pop_back();
  const fs::path file = folder_ / "bad.vtkhdf";
  expect_same_error([&] { write_vtkhdf(file, MPI_COMM_WORLD, rows.blocks, rows.columns(), 0, 0); }, "mass");
  EXPECT_FALSE(fs::exists(file));
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_FALSE(fs::exists(folder_ / ".bad.vtkhdf.part"));
}

TEST_F(TableFileRanks, MissingFolder) {
  const Rows rows(MPI_COMM_WORLD, {5, 5, 5, 5}, [](int b) { return b; });
  const fs::path file = folder_ / "nowhere" / "a.vtkhdf";
  expect_same_error([&] { write_vtkhdf(file, MPI_COMM_WORLD, rows.blocks, rows.columns(), 0, 0); },
                    "No such file or directory");
}

/// Files may not grow beyond `bytes` while this lives: what a full disk looks like to the program.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit = {bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  void (*handler_)(int);
  rlimit before_{};
};

TEST_F(TableFileRanks, FailureToWriteIsReportedByAllAndLeavesNothing) {
  const Rows rows(MPI_COMM_WORLD, std::vector<std::int64_t>(40, 500), [](int b) { return b; });
  const fs::path file = folder_ / "full.vtkhdf";
  {
    const FileSizeLimit limit(100'000);
    expect_same_error([&] { write_vtkhdf(file, MPI_COMM_WORLD, rows.blocks, rows.columns(), 0, 0); }, "File too large");
  }
  EXPECT_FALSE(fs::exists(file));
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_FALSE(fs::exists(folder_ / ".full.vtkhdf.part"));
  write_vtkhdf(file, MPI_COMM_WORLD, rows.blocks, rows.columns(), 0, 0);  // and the program can go on
  EXPECT_TRUE(fs::exists(file));
}

}  // namespace
