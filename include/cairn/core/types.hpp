#pragma once
/// Small fixed-size types used everywhere.

#include <Eigen/Dense>
#include <array>
#include <cstdint>

namespace cairn {

template <int Dim>
using Vec = Eigen::Matrix<double, Dim, 1>;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// Integer position on the lattice (cell, node or patch).
template <int Dim>
using Index = std::array<int, Dim>;

/// Faces of the domain in the order of the case file: left, right (x), bottom, top (y), back, front (z).
inline constexpr std::array<const char*, 6> face_names = {"left", "right", "bottom", "top", "back", "front"};

}  // namespace cairn
