#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numeric>

#include "cairn/core/error.hpp"
#include "cairn/io/info.hpp"
#include "cairn/io/program_facts.hpp"
#include "cairn/io/table_file.hpp"

namespace {

using namespace cairn;
namespace fs = std::filesystem;

/// MPI is started by the tests that need it and ended after the last test.
class MpiEnd : public testing::Environment {
 public:
  void TearDown() override {
    int started = 0;
    MPI_Initialized(&started);
    if (started) MPI_Finalize();
  }
};
[[maybe_unused]] const auto* const mpi_end = testing::AddGlobalTestEnvironment(new MpiEnd);

class TableFile : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    int started = 0;
    MPI_Initialized(&started);
    if (!started) MPI_Init(nullptr, nullptr);
  }
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("cairn_io_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Message of the InputError or RunError that `call` must throw.
  template <class Error, class Call>
  static std::string message_of(const Call& call) {
    try {
      call();
    } catch (const Error& error) {
      return error.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return {};
  }
  static std::string text_of(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  fs::path folder_;
};

const std::vector<double> position = {0, 0, 0, 1, 2, 0, -3, 5, 0};
const std::vector<double> stress = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 1e9};
const std::vector<std::int32_t> body = {4, 4, 7};
const std::vector<std::int64_t> id = {9'000'000'001, 9'000'000'002, 9'000'000'003};

std::vector<Column> columns() {
  return {{"position", 3, std::span<const double>(position)},
          {"stress", 6, std::span<const double>(stress)},
          {"body", 1, std::span<const std::int32_t>(body)},
          {"id", 1, std::span<const std::int64_t>(id)}};
}

TEST_F(TableFile, MemoryBlocksGoToTheirRowsOfTheFile) {
  // One block of no rows, two that touch.
  const RowBlocks rows = {{{0, 1}, {1, 0}, {1, 2}}, 3};
  write_table(folder_ / "t.h5", MPI_COMM_SELF, rows, columns(), 1.5, 12, "contacts");
  const TableReader reader(folder_ / "t.h5", MPI_COMM_SELF);
  EXPECT_EQ(reader.rows(), 3);
  EXPECT_EQ(reader.time(), 1.5);
  EXPECT_EQ(reader.step(), 12);
  EXPECT_EQ(reader.kind(), "contacts");
  std::vector<double> some(6);
  reader.read("position", 3, {{{0, 1}, {2, 1}}, 3}, some);
  EXPECT_EQ(some, (std::vector<double>{0, 0, 0, -3, 5, 0}));
  std::vector<std::int64_t> last(1);
  reader.read("id", 1, {{{2, 1}}, 3}, last);
  EXPECT_EQ(last[0], id[2]);
}

TEST_F(TableFile, VtkhdfReadsLikeATable) {
  write_vtkhdf(folder_ / "p.vtkhdf", MPI_COMM_SELF, {{{0, 3}}, 3}, columns(), 0.5, 3);
  const TableReader reader(folder_ / "p.vtkhdf", MPI_COMM_SELF);
  std::vector<double> values(18);
  reader.read("stress", 6, {{{0, 3}}, 3}, values);
  EXPECT_EQ(values, stress);
  values.resize(9);
  reader.read("position", 3, {{{0, 3}}, 3}, values);
  EXPECT_EQ(values, position);
}

TEST_F(TableFile, ManyBlocksTakeLittleTime) {
  const std::int64_t blocks = 100'000;  // two rows each, every second block missing
  RowBlocks half;
  half.total_rows = 4 * blocks;
  for (std::int64_t b = 0; b < blocks; ++b) half.blocks.push_back({4 * b, 2});
  std::vector<double> all(static_cast<std::size_t>(half.total_rows)), some(all.size() / 2);
  std::iota(all.begin(), all.end(), 0.0);
  const std::vector<Column> column = {{"mass", 1, std::span<const double>(all)}};
  write_table(folder_ / "t.h5", MPI_COMM_SELF, {{{0, half.total_rows}}, half.total_rows}, column, 0, 0, "rows");
  const TableReader reader(folder_ / "t.h5", MPI_COMM_SELF);
  const auto start = std::chrono::steady_clock::now();
  reader.read("mass", 1, half, some);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  EXPECT_LT(taken.count(), 10.0);  // block by block it takes minutes
  for (std::size_t i = 0; i < some.size(); ++i) ASSERT_EQ(some[i], static_cast<double>(i / 2 * 4 + i % 2));
}

TEST_F(TableFile, ReplacesAnOlderFileAndLeavesNoTemporary) {
  for (int k = 0; k < 2; ++k) write_vtkhdf(folder_ / "p.vtkhdf", MPI_COMM_SELF, {{{0, 3}}, 3}, columns(), k, k);
  EXPECT_EQ(TableReader(folder_ / "p.vtkhdf", MPI_COMM_SELF).step(), 1);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(TableFile, TheSameTableGivesTheSameBytes) {
  write_vtkhdf(folder_ / "a.vtkhdf", MPI_COMM_SELF, {{{0, 3}}, 3}, columns(), 0.5, 3);
  ::sleep(1);  // a time stamp would differ
  write_vtkhdf(folder_ / "b.vtkhdf", MPI_COMM_SELF, {{{0, 3}}, 3}, columns(), 0.5, 3);
  EXPECT_EQ(text_of(folder_ / "a.vtkhdf"), text_of(folder_ / "b.vtkhdf"));
}

TEST_F(TableFile, WrongRowsAreRefused) {
  const auto write = [&](const RowBlocks& rows) {
    return message_of<RunError>([&] { write_table(folder_ / "t.h5", MPI_COMM_SELF, rows, columns(), 0, 0, "rows"); });
  };
  EXPECT_NE(write({{{0, 3}}, 4}).find("3 rows of 4"), std::string::npos);
  EXPECT_NE(write({{{2, 1}, {0, 2}}, 3}).find("block of 2 rows at row 0"), std::string::npos);
  EXPECT_NE(write({{{0, 2}}, 2}).find("9 values for 2 rows of 3"), std::string::npos);
  EXPECT_TRUE(fs::is_empty(folder_));
  const std::vector<Column> no_position = {{"body", 1, std::span<const std::int32_t>(body)}};
  const std::string message = message_of<RunError>([&] {
    write_vtkhdf(folder_ / "p.vtkhdf", MPI_COMM_SELF, {{{0, 3}}, 3}, no_position, 0, 0);
  });
  EXPECT_NE(message.find("position"), std::string::npos);
}

TEST_F(TableFile, SeriesIndexIsWholeAfterEveryFile) {
  SeriesIndex index(folder_ / "particles.hdf.series");
  index.add("particles_000000.vtkhdf", 0.0, MPI_COMM_SELF);
  EXPECT_EQ(text_of(folder_ / "particles.hdf.series"),
            "{\n  \"file-series-version\": \"1.0\",\n  \"files\": [\n"
            "    {\"name\": \"particles_000000.vtkhdf\", \"time\": 0}\n  ]\n}\n");
  index.add("particles_000001.vtkhdf", 1e-7, MPI_COMM_SELF);
  const std::string text = text_of(folder_ / "particles.hdf.series");
  EXPECT_NE(text.find("\"time\": 0},\n    {\"name\": \"particles_000001.vtkhdf\", \"time\": 1e-07}\n  ]"),
            std::string::npos)
      << text;
  SeriesIndex nowhere(folder_ / "missing" / "a.hdf.series");
  EXPECT_THROW(nowhere.add("a", 0, MPI_COMM_SELF), RunError);
}

TEST_F(TableFile, UnreadableFilesAreInputErrors) {
  const auto open = [&](const char* name) {
    return message_of<InputError>([&] { TableReader(folder_ / name, MPI_COMM_SELF); });
  };
  EXPECT_NE(open("missing.h5").find("no such file"), std::string::npos);
  std::ofstream(folder_ / "text.h5") << "not HDF5\n";
  EXPECT_NE(open("text.h5").find("not a whole HDF5 file"), std::string::npos);
}

TEST_F(TableFile, DescriptionSaysWhatIsThere) {
  write_vtkhdf(folder_ / "p.vtkhdf", MPI_COMM_SELF, {{{0, 3}}, 3}, columns(), 0.5, 3);
  const std::string text = describe_file(folder_ / "p.vtkhdf");
  EXPECT_EQ(text.substr(0, text.find("  dataset")),
            fmt::format("p.vtkhdf: material points (VTKHDF: opens in ParaView)\ntime 0.5 s, step 3, 3 rows\n"
                        "written by cairn {}, commit {}\n",
                        program_facts().version, program_facts().commit));
  for (const char* part : {"position [m]", "3 x 3", "-3 .. 5", "stress [Pa]", "3 x 6", "1 .. 1e+09", "int32", "4 .. 7"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
  EXPECT_EQ(text.find("Offsets"), std::string::npos);
}

TEST_F(TableFile, DescriptionOfEmptyAndBadValues) {
  write_vtkhdf(folder_ / "e.vtkhdf", MPI_COMM_SELF, {{}, 0},
               std::vector<Column>{{"position", 3, std::span<const double>()}}, 0, 0);
  EXPECT_NE(describe_file(folder_ / "e.vtkhdf").find("no values"), std::string::npos);
  const std::vector<double> bad = {1.0, std::nan(""), 3.0};
  write_table(folder_ / "t.h5", MPI_COMM_SELF, {{{0, 3}}, 3},
              std::vector<Column>{{"mass", 1, std::span<const double>(bad)}}, 0, 0, "rows");
  EXPECT_NE(describe_file(folder_ / "t.h5").find("1 .. 3, 1 not finite"), std::string::npos);
}

TEST_F(TableFile, DescriptionOfWhatIsNoFileOfOurs) {
  const auto describe = [&](const char* name) {
    return message_of<InputError>([&] { describe_file(folder_ / name); });
  };
  EXPECT_NE(describe("missing.h5").find("no such file"), std::string::npos);
  EXPECT_NE(describe("").find("not a file"), std::string::npos);
  std::ofstream(folder_ / "text.h5") << "not HDF5\n";
  EXPECT_NE(describe("text.h5").find("not an HDF5 file"), std::string::npos);
  write_vtkhdf(folder_ / "cut.vtkhdf", MPI_COMM_SELF, {{{0, 3}}, 3}, columns(), 0.5, 3);
  fs::resize_file(folder_ / "cut.vtkhdf", fs::file_size(folder_ / "cut.vtkhdf") / 2);
  EXPECT_NE(describe("cut.vtkhdf").find("cut short"), std::string::npos);
}

}  // namespace
