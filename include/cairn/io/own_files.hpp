#pragma once
/// Which files this program may replace: those that it wrote, told by a mark in their content. Whatever else has the
/// name of a result (a user's own case, a grain table called bodies.csv, a device, a link) is left alone.

#include <filesystem>
#include <string>
#include <string_view>

namespace cairn {

/// The first line of the case.toml in a folder of results.
inline constexpr std::string_view case_mark =
    "# Written by cairn: the case as it was run. The next run into this folder replaces this file.\n";
/// How the first line of a copied grain table begins.
inline constexpr std::string_view table_mark = "# Copied by cairn from ";

/// What keeps a result from taking the place of `file`, as "FILE: reason": something is there that is no regular file
/// or that this program did not write. Empty if nothing does; an empty file has nothing to lose. Not collective.
std::string foreign_result(const std::filesystem::path& file);

/// The same for a grain table of `cairn pack`. Not collective.
std::string foreign_pack(const std::filesystem::path& file);

/// Both paths lead to one file.
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace cairn
