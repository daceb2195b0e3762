#include "cairn/crack/j_integral.hpp"

#include <Eigen/Dense>
#include <cmath>

namespace cairn {
namespace {

template <int Dim>
struct Weight {
  double q = 0;
  Vec<Dim> gradient = Vec<Dim>::Zero();
};

Weight<2> radial_weight(const Vec<2>& x, double inner, double outer) {
  const double r = x.norm();
  if (r >= outer) return {};
  if (r <= inner) return {1, Vec<2>::Zero()};
  const double phase = M_PI * (r - inner) / (outer - inner);
  return {0.5 * (1 + std::cos(phase)), -0.5 * M_PI / (outer - inner) * std::sin(phase) / r * x};
}

/// \param x  in the tip's axes
template <int Dim>
Weight<Dim> weight_at(const Vec<Dim>& x, double hat, double inner, double outer) {
  if constexpr (Dim == 2) {
    return radial_weight(x, inner, outer);
  } else {
    const auto radial = radial_weight(x.template head<2>(), inner, outer);
    const double along = 1 - std::abs(x.z()) / hat;
    if (!(along > 0) || !(radial.q > 0)) return {};
    Weight<3> w;
    w.q = along * radial.q;
    w.gradient << along * radial.gradient, (x.z() > 0 ? -1 : 1) * radial.q / hat;
    return w;
  }
}

/// The tip's axes as rows.
template <int Dim>
Eigen::Matrix<double, Dim, Dim> axes_of(const CrackTip<Dim>& tip) {
  Eigen::Matrix<double, Dim, Dim> axes;
  axes.row(0) = tip.ahead.transpose();
  if constexpr (Dim == 2)
    axes.row(1) << -tip.ahead.y(), tip.ahead.x();
  else
    axes.row(1) = tip.normal.transpose(), axes.row(2) = tip.ahead.cross(tip.normal).transpose();
  return axes;
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

UnitField3D unit_field_3d(int mode, const Vec<2>& x, double shear_modulus, double kappa) {
  UnitField3D f{Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  if (mode < 2) {
    const UnitField plane = unit_field(mode, x, shear_modulus, kappa);
    f.H.topLeftCorner<2, 2>() = plane.H, f.stress.topLeftCorner<2, 2>() = plane.stress;
    f.stress(2, 2) = 0.25 * (3 - kappa) * plane.stress.trace();  // nu of plane strain
    return f;
  }
  // u_3 = 2/mu sqrt(r/2 pi) sin(angle/2)
  const double r = x.norm(), half = 0.5 * std::atan2(x.y(), x.x()), scale = 1 / std::sqrt(2 * M_PI * r);
  const Vec<2> pull = scale * Vec<2>(-std::sin(half), std::cos(half));
  f.stress.block<1, 2>(2, 0) = pull.transpose(), f.stress.block<2, 1>(0, 2) = pull;
  f.H.block<1, 2>(2, 0) = pull.transpose() / shear_modulus;
  return f;
}

template <int Dim>
double tip_weight(const CrackTip<Dim>& tip, const Vec<Dim>& x, double inner, double outer) {
  return weight_at<Dim>(axes_of(tip) * (x - tip.position), tip.hat, inner, outer).q;
}

template <int Dim>
TipSums tip_terms(const CrackTip<Dim>& tip, const TipPoint<Dim>& point, double inner, double outer) {
  using Matrix = Eigen::Matrix<double, Dim, Dim>;
  TipSums sums;
  const Matrix axes = axes_of(tip);
  const auto turned = [&](const Matrix& a) -> Matrix { return axes * a * axes.transpose(); };
  const Vec<Dim> x = axes * (point.position - tip.position);
  const Weight<Dim> w = weight_at<Dim>(x, tip.hat, inner, outer);
  if (!(w.q > 0)) return sums;
  const Matrix stress = turned(point.stress), H = turned(point.H), L = turned(point.L);
  const Vec<Dim> v = axes * point.velocity, a = axes * point.acceleration;
  const double mass = point.density * point.volume;
  const Vec<Dim> pull = stress * w.gradient;
  sums.J_static = point.volume * (pull.dot(H.col(0)) - point.energy * w.gradient.x());
  sums.J =
      sums.J_static - 0.5 * mass * v.squaredNorm() * w.gradient.x() + mass * w.q * (a.dot(H.col(0)) - v.dot(L.col(0)));
  if (tip.modulus == 0 || !(x.template head<2>().squaredNorm() > 0)) return sums;
  const auto interaction = [&](const auto& unit) {
    const Vec<Dim> unit_pull = unit.stress * w.gradient;
    return point.volume * (pull.dot(unit.H.col(0)) + unit_pull.dot(H.col(0)) -
                           unit.stress.cwiseProduct(H).sum() * w.gradient.x()) +
           mass * w.q * a.dot(unit.H.col(0));
  };
  if constexpr (Dim == 2) {
    sums.I_opening = interaction(unit_field(0, x, tip.shear_modulus, tip.kappa));
    sums.I_sliding = interaction(unit_field(1, x, tip.shear_modulus, tip.kappa));
  } else {
    double* const modes[] = {&sums.I_opening, &sums.I_sliding, &sums.I_tearing};
    for (int mode = 0; mode < 3; ++mode)
      *modes[mode] = interaction(unit_field_3d(mode, x.template head<2>(), tip.shear_modulus, tip.kappa));
  }
  return sums;
}

double face_weight(double inner, double outer) {
  constexpr int intervals = 64;  // in the root of r, in which the integrand is smooth
  const double step = std::sqrt(outer) / intervals;
  double sum = 0;
  for (int i = 0; i < intervals; ++i) {
    const double root = (i + 0.5) * step;
    sum += radial_weight(Vec<2>(root * root, 0), inner, outer).q;
  }
  return 2 * step * sum / std::sqrt(2 * M_PI);
}

template <int Dim>
TipSums face_terms(const CrackTip<Dim>& tip, const Vec<Dim>& x, const Vec<Dim>& force, double h, double weight) {
  constexpr double from = 1.25, length = 3;  // of the window [cells]: its nodes see nothing of what is ahead of the tip
  TipSums sums;
  const auto axes = axes_of(tip);
  const Vec<Dim> away = axes * (x - tip.position) / h;
  const double in_window = (-away[0] - from) / length;
  if (!(in_window > 0 && in_window < 1) || tip.modulus == 0 || std::abs(away[1]) > from + length) return sums;
  double unit = 2 * std::pow(std::sin(M_PI * in_window), 2) / (length * h) * weight * 4 / tip.modulus;
  if constexpr (Dim == 3) unit *= std::max(0.0, 1 - std::abs(away[2]) * h / tip.hat);
  const Vec<Dim> turned = unit * (axes * force);
  sums.I_opening = turned[1], sums.I_sliding = turned[0];
  if constexpr (Dim == 3) sums.I_tearing = tip.modulus / (2 * tip.shear_modulus) * turned[2];
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

#define CAIRN_INSTANTIATE(Dim)                                                                         \
  template double tip_weight(const CrackTip<Dim>&, const Vec<Dim>&, double, double);                   \
  template TipSums face_terms(const CrackTip<Dim>&, const Vec<Dim>&, const Vec<Dim>&, double, double); \
  template TipSums tip_terms(const CrackTip<Dim>&, const TipPoint<Dim>&, double, double);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
