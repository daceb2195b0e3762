#include "cairn/crack/j_integral.hpp"

#include <cmath>

namespace cairn {
namespace {

struct Weight {
  double q = 0;
  Vec<2> gradient = Vec<2>::Zero();
};

Weight weight_at(const Vec<2>& x, double inner, double outer) {
  const double r = x.norm();
  if (r >= outer) return {};
  if (r <= inner) return {1, Vec<2>::Zero()};
  const double phase = M_PI * (r - inner) / (outer - inner);
  return {0.5 * (1 + std::cos(phase)), -0.5 * M_PI / (outer - inner) * std::sin(phase) / r * x};
}

}  // namespace

UnitField unit_field(int mode, const Vec<2>& x, double shear_modulus, double kappa) {
  const double r = x.norm(), angle = std::atan2(x.y(), x.x());
  const double s = std::sin(angle / 2), c = std::cos(angle / 2), s3 = std::sin(1.5 * angle), c3 = std::cos(1.5 * angle);
  UnitField f;
  const double scale = 1 / std::sqrt(2 * M_PI * r);
  if (mode == 0)
    f.stress << c * (1 - s * s3), s * c * c3, s * c * c3, c * (1 + s * s3);
  else
    f.stress << -s * (2 + c * c3), c * (1 - s * s3), c * (1 - s * s3), s * c * c3;
  f.stress *= scale;
  // u = sqrt(r/2 pi)/(2 mu) g(angle), so grad u = sqrt(1/(2 pi r))/(2 mu) [g/2 (x) e_r + g' (x) e_angle].
  Vec<2> g, slope;
  if (mode == 0) {
    g = {c * (kappa - 1 + 2 * s * s), s * (kappa + 1 - 2 * c * c)};
    slope = {-0.5 * s * (kappa - 1 + 2 * s * s) + 2 * c * c * s, 0.5 * c * (kappa + 1 - 2 * c * c) + 2 * s * s * c};
  } else {
    g = {s * (kappa + 1 + 2 * c * c), -c * (kappa - 1 - 2 * s * s)};
    slope = {0.5 * c * (kappa + 1 + 2 * c * c) - 2 * s * s * c, 0.5 * s * (kappa - 1 - 2 * s * s) + 2 * c * c * s};
  }
  const Vec<2> out = x / r, around(-out.y(), out.x());
  f.H = scale / (2 * shear_modulus) * (0.5 * g * out.transpose() + slope * around.transpose());
  return f;
}

TipSums tip_terms(const CrackTip& tip, const TipPoint& point, double inner, double outer) {
  TipSums sums;
  Eigen::Matrix2d axes;  // rows: the tip's axes
  axes.row(0) = tip.ahead.transpose(), axes.row(1) << -tip.ahead.y(), tip.ahead.x();
  const auto turned = [&](const Eigen::Matrix2d& a) -> Eigen::Matrix2d { return axes * a * axes.transpose(); };
  const Vec<2> x = axes * (point.position - tip.position);
  const Weight w = weight_at(x, inner, outer);
  if (!(w.q > 0)) return sums;
  const Eigen::Matrix2d stress = turned(point.stress), H = turned(point.H), L = turned(point.L);
  const Vec<2> v = axes * point.velocity, a = axes * point.acceleration;
  const double mass = point.density * point.volume;
  const Vec<2> pull = stress * w.gradient;
  sums.J_static = point.volume * (pull.dot(H.col(0)) - point.energy * w.gradient.x());
  sums.J =
      sums.J_static - 0.5 * mass * v.squaredNorm() * w.gradient.x() + mass * w.q * (a.dot(H.col(0)) - v.dot(L.col(0)));
  if (tip.modulus == 0 || !(x.squaredNorm() > 0)) return sums;
  for (const int mode : {0, 1}) {
    const UnitField unit = unit_field(mode, x, tip.shear_modulus, tip.kappa);
    const Vec<2> unit_pull = unit.stress * w.gradient;
    (mode == 0 ? sums.I_opening : sums.I_sliding) =
        point.volume *
            (pull.dot(unit.H.col(0)) + unit_pull.dot(H.col(0)) - unit.stress.cwiseProduct(H).sum() * w.gradient.x()) +
        mass * w.q * a.dot(unit.H.col(0));
  }
  return sums;
}

TipSums face_terms(const CrackTip& tip, const Vec<2>& x, const Vec<2>& force, double width, double inner,
                   double outer) {
  TipSums sums;
  const Vec<2> away = x - tip.position, normal(-tip.ahead.y(), tip.ahead.x());
  const double behind = -away.dot(tip.ahead);
  const double from = std::max(0.0, behind - 0.5 * width), to = behind + 0.5 * width;
  if (!(to > 0) || tip.modulus == 0 || std::abs(away.dot(normal)) > outer) return sums;
  const double q = weight_at(Vec<2>(behind, 0), inner, outer).q;
  // The mean of 1/sqrt(2 pi r) over the width.
  const double unit = q * 4 / tip.modulus * 2 * (std::sqrt(to) - std::sqrt(from)) / (width * std::sqrt(2 * M_PI));
  sums.I_opening = unit * force.dot(normal), sums.I_sliding = unit * force.dot(tip.ahead);
  return sums;
}

HoopStress largest_hoop_stress(double K_opening, double K_sliding) {
  double angle = 0;
  if (K_sliding != 0) {
    const double ratio = K_opening / K_sliding;
    angle = 2 * std::atan((ratio - std::copysign(std::sqrt(ratio * ratio + 8), K_sliding)) / 4);
  }
  const double c = std::cos(angle / 2);
  return {angle, c * (K_opening * c * c - 1.5 * K_sliding * std::sin(angle))};
}

}  // namespace cairn
