#pragma once
/// Random numbers for tests: the same in every run.

#include <random>

#include "cairn/core/types.hpp"

namespace cairn::test {

class Random {
 public:
  explicit Random(unsigned seed = 20) : engine_(seed) {}
  double operator()(double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(engine_);
  }
  int integer(int lower, int upper) { return std::uniform_int_distribution<int>(lower, upper)(engine_); }
  template <int Dim>
  Vec<Dim> vector(double size) {
    Vec<Dim> v;
    for (int d = 0; d < Dim; ++d) v[d] = (*this)(-size, size);
    return v;
  }
  template <int Dim>
  Vec<Dim> unit_vector() {
    Vec<Dim> v = vector<Dim>(1.0);
    while (v.norm() < 0.1) v = vector<Dim>(1.0);
    return v.normalized();
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace cairn::test
