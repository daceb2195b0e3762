#pragma once
/// Where a shape that comes in a file lies in the domain: x = move + R (factor * x_file), R the turn by the length of
/// `rotate` [rad] about its direction (in 2D about z).

#include <cstdint>
#include <memory>

#include "cairn/body/shapes/basics.hpp"

namespace cairn {

/// A file that the case names, and its copy beside the results.
struct ShapeFile {
  std::string name;  // as written in the case
  std::string copy;
  std::uint64_t checksum = 0;  // of its bytes
};

struct LengthUnit {
  std::string_view name;
  double metres;
};
inline constexpr LengthUnit length_units[] = {{"m", 1.0},   {"cm", 1e-2}, {"mm", 1e-3},
                                              {"um", 1e-6}, {"nm", 1e-9}, {"inch", 0.0254}};

struct Placement {
  std::string unit = "m";  // of the file's lengths
  double scale = 1;
  Vec3 move = Vec3::Zero();  // [m]
  Vec3 rotate = Vec3::Zero();

  /// Metres for each unit of length of the file.
  double factor() const {
    for (const LengthUnit& known : length_units)
      if (known.name == unit) return scale * known.metres;
    return scale;
  }
  Eigen::Matrix3d turn() const {
    const double angle = rotate.norm();
    if (angle == 0) return Eigen::Matrix3d::Identity();
    return Eigen::AngleAxisd(angle, rotate / angle).toRotationMatrix();
  }
};

/// The same, ready for use.
class Place {
 public:
  Place() = default;
  explicit Place(const Placement& p)
      : turn_(p.turn()), move_(p.move), factor_(p.factor()), turned_(p.rotate != Vec3::Zero()) {}
  double factor() const { return factor_; }
  void shift(const Vec3& way) { move_ += way; }
  Vec3 in_space(const Vec3& x) const {
    return move_ + (turned_ ? (turn_ * (factor_ * x)).eval() : (factor_ * x).eval());
  }
  Vec3 in_file(const Vec3& x) const {
    const Vec3 d = x - move_;
    return (turned_ ? (turn_.transpose() * d).eval() : d) / factor_;
  }
  /// Bounds of a box of the file.
  Bounds in_space(const Bounds& b) const {
    Bounds all = shapes::nothing();
    for (int corner = 0; corner < 8; ++corner)
      shapes::widen(all, in_space(Vec3((corner & 1 ? b.upper : b.lower).x(), (corner & 2 ? b.upper : b.lower).y(),
                                       (corner & 4 ? b.upper : b.lower).z())));
    return all;
  }

 private:
  Eigen::Matrix3d turn_ = Eigen::Matrix3d::Identity();
  Vec3 move_ = Vec3::Zero();
  double factor_ = 1;
  bool turned_ = false;
};

/// What shapes from files have in common.
struct FromFile {
  ShapeFile file;
  Placement placement;
  Place place{};
  Bounds box{};

  Bounds extent() const { return box; }
  void shift(const Vec3& way) { placement.move += way, place.shift(way), box.lower += way, box.upper += way; }
};

}  // namespace cairn
