#pragma once
/// Signs without rounding errors. Only for files that are compiled without contraction of a * b + c.

#include <cmath>

namespace cairn::crack {

/// A sum without rounding errors: components that do not overlap and are not 0, ascending in size (Shewchuk, Discrete
/// Comput. Geom. 18, 1997, GROW-EXPANSION).
template <int Most>
class ExactSum {
 public:
  void add(double b) {
    int kept = 0;
    for (int i = 0; i < size_; ++i) {
      const double sum = b + terms_[i], virtual_b = sum - terms_[i], virtual_a = sum - virtual_b;
      const double rest = (terms_[i] - virtual_a) + (b - virtual_b);
      if (rest != 0) terms_[kept++] = rest;
      b = sum;
    }
    size_ = kept;
    if (b != 0) terms_[size_++] = b;
  }
  void add_product(double a, double b, double sign) {
    const double product = a * b;
    add(sign * std::fma(a, b, -product));
    add(sign * product);
  }
  void add_product(double a, double b, double c, double sign) {
    const double product = a * b;
    add_product(std::fma(a, b, -product), c, sign);
    add_product(product, c, sign);
  }
  int sign() const {
    if (size_ == 0) return 0;
    return terms_[size_ - 1] > 0 ? 1 : -1;
  }

 private:
  double terms_[Most];
  int size_ = 0;
};

inline int sign_of(double a) { return (a > 0) - (a < 0); }

/// The first of them that is not 0, as a sign.
template <class... Rest>
int first_sign(int first, Rest... rest) {
  if constexpr (sizeof...(rest) > 0)
    return first != 0 ? first : first_sign(rest...);
  else
    return first;
}

/// The sign of a - b, which rounding keeps.
inline int difference(double a, double b) { return (a > b) - (a < b); }

}  // namespace cairn::crack
