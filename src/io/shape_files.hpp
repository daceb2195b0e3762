#pragma once
/// Shapes that come in files: what reads them.

#include <string>
#include <string_view>
#include <vector>

#include "cairn/body/solid.hpp"
#include "case_sections.hpp"

namespace cairn::reading {

/// A file of triangles by its content: STL, binary or not, PLY, or OBJ.
/// \throws InputError ":LINE: ..." or ": ...", what follows the file's name in a message
std::vector<SolidPart> read_solids(std::string_view bytes);
std::vector<SolidPart> read_binary_stl(std::string_view bytes);
std::vector<SolidPart> read_ascii_stl(std::string_view bytes);
std::vector<SolidPart> read_obj(std::string_view bytes);
std::vector<SolidPart> read_ply(std::string_view bytes);

/// Closed lines in the plane: CSV (columns x, y, and line where there are several), SVG, or DXF.
/// \throws as read_solids
std::vector<LinePart> read_lines(std::string_view bytes);
std::vector<LinePart> read_csv_lines(std::string_view bytes);
std::vector<LinePart> read_svg_lines(std::string_view bytes);
std::vector<LinePart> read_dxf_lines(std::string_view bytes);

/// Reads the file of a shape, checks it, and readies the shape; reports errors, and adds warnings.
void load(Mesh& mesh, Table& table, Draft& draft);
void load(Outline& outline, Table& table, Draft& draft);

/// The shape stands for each solid or line of its file, and has to be taken one by one.
bool is_several(const Shape& shape);

/// The shape, or where it asks for each solid or line of its file, these one by one.
std::vector<Shape> one_by_one(const Shape& shape, Table& table, Draft& draft);

}  // namespace cairn::reading
