#include "cairn/io/table_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "cairn/core/error.hpp"
#include "cairn/io/agreement.hpp"
#include "table_writer.hpp"

namespace cairn {

namespace {

/// Rows must be covered exactly once by all ranks together; blocks themselves are checked where they are written.
void check_cover(const std::filesystem::path& file, MPI_Comm comm, const RowBlocks& rows) {
  std::int64_t mine = rows.local_rows(), all = 0;
  MPI_Allreduce(&mine, &all, 1, MPI_INT64_T, MPI_SUM, comm);
  throw_together(comm, all == rows.total_rows ? ""
                                              : fmt::format("cannot write {}: the ranks hold {} rows of {}",
                                                            file.string(), all, rows.total_rows));
}

template <class T>
T value_of(const std::span<const T>&);
template <class T>
T value_of(const BlockSource<T>&);

/// Bytes of all columns over all rows.
std::int64_t bytes_of(std::span<const Column> columns, std::int64_t rows) {
  std::int64_t bytes = 0;
  for (const auto& column : columns) {
    const std::size_t value = std::visit([](const auto& values) { return sizeof(value_of(values)); }, column.values);
    bytes += rows * column.components * static_cast<std::int64_t>(value);
  }
  return bytes;
}

bool holds_doubles(const Column& column) {
  return std::holds_alternative<std::span<const double>>(column.values) ||
         std::holds_alternative<BlockSource<double>>(column.values);
}

void write_column(TableWriter& writer, const std::string& path, const RowBlocks& rows, const Column& column) {
  std::visit([&](const auto& values) { writer.write(path, column.components, rows, values); }, column.values);
}

void write_header(TableWriter& writer, const std::string& kind, const RowBlocks& rows, double time, std::int64_t step) {
  writer.add_attribute("/", "kind", kind);
  writer.add_program();
  writer.add_attribute("/", "rows", rows.total_rows);
  writer.add_attribute("/", "time", time);
  writer.add_attribute("/", "step", step);
}

/// This rank's even share of `total` rows, for data that follow from the row number, in blocks.
RowBlocks even_share(MPI_Comm comm, std::int64_t total) {
  constexpr std::int64_t longest = 1 << 16;
  int rank = 0, ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  const auto begin = [&](std::int64_t r) { return total / ranks * r + std::min<std::int64_t>(r, total % ranks); };
  RowBlocks rows{{}, total};
  for (std::int64_t row = begin(rank); row < begin(rank + 1); row += longest)
    rows.blocks.push_back({row, std::min(longest, begin(rank + 1) - row)});
  return rows;
}

/// A grid of cells with so many points each. \param connectivity  writes the cells' points
template <class F>
void write_cells(TableWriter& writer, MPI_Comm comm, std::int64_t points, std::int64_t cells, std::int64_t each,
                 std::uint8_t vtk_type, F&& connectivity) {
  const RowBlocks one = even_share(comm, 1);
  for (const auto& [name, value] : {std::pair("NumberOfPoints", points), std::pair("NumberOfCells", cells),
                                    std::pair("NumberOfConnectivityIds", each * cells)}) {
    const std::vector<std::int64_t> number(static_cast<std::size_t>(one.local_rows()), value);
    writer.write(fmt::format("VTKHDF/{}", name), 1, one, std::span(number));
  }
  connectivity();
  const RowBlocks of_cells = even_share(comm, cells), offsets = even_share(comm, cells + 1);
  std::vector<std::int64_t> count;
  writer.write("VTKHDF/Offsets", 1, offsets, BlockSource<std::int64_t>([&](std::size_t block) {
                 count.resize(static_cast<std::size_t>(offsets.blocks[block].count));
                 for (std::size_t i = 0; i < count.size(); ++i)
                   count[i] = each * (offsets.blocks[block].file_row + static_cast<std::int64_t>(i));
                 return std::span(count);
               }));
  std::vector<std::uint8_t> types;
  writer.write("VTKHDF/Types", 1, of_cells, BlockSource<std::uint8_t>([&](std::size_t block) {
                 types.assign(static_cast<std::size_t>(of_cells.blocks[block].count), vtk_type);
                 return std::span(types);
               }));
}

/// A grid of vertices: cell i has one point, point i.
void write_vertices(TableWriter& writer, MPI_Comm comm, std::int64_t points) {
  constexpr std::uint8_t vtk_vertex = 1;
  write_cells(writer, comm, points, points, 1, vtk_vertex, [&] {
    std::vector<std::int64_t> count;
    const RowBlocks rows = even_share(comm, points);
    writer.write("VTKHDF/Connectivity", 1, rows, BlockSource<std::int64_t>([&](std::size_t block) {
                   count.resize(static_cast<std::size_t>(rows.blocks[block].count));
                   std::iota(count.begin(), count.end(), rows.blocks[block].file_row);
                   return std::span(count);
                 }));
  });
}

void write_triangles(TableWriter& writer, MPI_Comm comm, std::int64_t points, const TriangleCells& triangles) {
  constexpr std::uint8_t vtk_triangle = 5;
  write_cells(writer, comm, points, triangles.rows.total_rows, 3, vtk_triangle, [&] {
    RowBlocks rows = triangles.rows;
    rows.total_rows *= 3;
    for (auto& block : rows.blocks) block.file_row *= 3, block.count *= 3;
    writer.write("VTKHDF/Connectivity", 1, rows, triangles.corners);
  });
}

}  // namespace

void write_vtkhdf(const std::filesystem::path& file, MPI_Comm comm, const RowBlocks& rows,
                  std::span<const Column> columns, double time, std::int64_t step, const std::string& kind,
                  const TriangleCells* triangles) {
  const auto position =
      std::find_if(columns.begin(), columns.end(), [](const Column& c) { return c.name == "position"; });
  const bool has_points = position != columns.end() && position->components == 3 && holds_doubles(*position);
  throw_together(comm,
                 has_points ? "" : fmt::format("cannot write {}: no column position of 3 doubles", file.string()));
  check_cover(file, comm, rows);

  constexpr std::int64_t vertex_bytes = 2 * sizeof(std::int64_t) + sizeof(std::uint8_t);
  const std::int64_t cells = triangles ? 2 * triangles->rows.total_rows : rows.total_rows;  // a triangle takes less
  TableWriter writer(file, comm, bytes_of(columns, rows.total_rows) + cells * vertex_bytes);
  write_header(writer, kind, rows, time, step);
  writer.add_group("VTKHDF");
  writer.add_group("VTKHDF/PointData");
  const std::int64_t version[2] = {1, 0};
  writer.add_attribute("VTKHDF", "Version", std::span<const std::int64_t>(version));
  writer.add_attribute("VTKHDF", "Type", std::string("UnstructuredGrid"));
  if (triangles)
    write_triangles(writer, comm, rows.total_rows, *triangles);
  else
    write_vertices(writer, comm, rows.total_rows);
  for (const auto& column : columns) {
    const std::string path = column.name == "position" ? "VTKHDF/Points" : "VTKHDF/PointData/" + column.name;
    write_column(writer, path, rows, column);
    writer.add_link(column.name, "/" + path);
  }
  writer.finish();
}

void write_table(const std::filesystem::path& file, MPI_Comm comm, const RowBlocks& rows,
                 std::span<const Column> columns, double time, std::int64_t step, const std::string& kind) {
  check_cover(file, comm, rows);
  TableWriter writer(file, comm, bytes_of(columns, rows.total_rows));
  write_header(writer, kind, rows, time, step);
  for (const auto& column : columns) write_column(writer, column.name, rows, column);
  writer.finish();
}

}  // namespace cairn
