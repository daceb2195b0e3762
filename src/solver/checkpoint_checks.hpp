#pragma once
/// What a checkpoint may hold. A seal and checksums tell damage; they do not tell who wrote the file. So whatever was
/// read is looked at before it is used as an index, a size or a state.

#include <string>
#include <vector>

#include "cairn/body/patch.hpp"
#include "cairn/solver/run_state.hpp"

namespace cairn::checkpoint {

/// Each returns what is wrong, empty if nothing is.

/// Clocks, books, lengths and the index of the particle files, against time and step.
std::string problem_of(const RunState& state);

/// Rows of every patch in one of the tables, `rows` in all.
std::string problem_of(const char* name, const std::vector<std::int64_t>& counts, std::int64_t rows);

/// The points of a piece: in their patch, finite, neither empty nor inverted, crossings of periodic boundaries only.
template <int Dim>
std::string problem_of(const Piece<Dim>& piece, const Lattice<Dim>& lattice, PatchId patch);

/// Bodies a < b that exist, and sums that are finite.
template <int Dim>
std::string problem_of(std::pair<int, int> bodies, const ContactSum<Dim>& sum, std::size_t body_count,
                       std::size_t partner_count);

/// The numbers of a crack point, as the file holds them; `crack` is the one that it says to be of.
template <int Dim>
std::string problem_of(const std::int32_t* numbers, const double* bond, const Crack& crack,
                       const Lattice<Dim>& lattice);

/// A crack point: finite, in its patch, with its plane in the middle of its faces.
template <int Dim>
std::string problem_of(const CrackPoint<Dim>& point, const Lattice<Dim>& lattice, const Patch<Dim>& patch);

/// Checksum of all that is no column of a patch: the numbers of the state, its index, and the case.
std::uint64_t checksum_of(const RunState& state, const std::string& case_text);

}  // namespace cairn::checkpoint
