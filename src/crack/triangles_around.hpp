#pragma once
/// Of the many triangles around a place the few that a line from there may cross: a look at all of them at once, before
/// the exact test.

#include <span>

#include "cairn/crack/sides.hpp"

namespace cairn {

class TrianglesAround {
 public:
  /// \param reach  of the lines in each direction [m]
  /// \param keep  keep(crack): whether triangles of that crack matter
  template <class Keep>
  TrianglesAround(const CrackSegments<3>& all, std::span<const int> near, const Vec<3>& x, const Vec<3>& reach,
                  Keep&& keep)
      : x_(x) {
    for (const int s : near) {
      const auto& triangle = all.all()[s];
      if (!keep(triangle.crack)) continue;
      const auto& [a, b, c] = triangle.corners;
      const Vec<3> lower = a.cwiseMin(b).cwiseMin(c), upper = a.cwiseMax(b).cwiseMax(c);
      if ((x + reach - lower).minCoeff() < 0 || (upper - x + reach).minCoeff() < 0) continue;
      numbers_.push_back(s);
      for (int d = 0; d < 3; ++d) {
        lower_[d].push_back(lower[d]), upper_[d].push_back(upper[d]), normal_[d].push_back(triangle.normal[d]);
      }
      offset_.push_back(triangle.normal.dot(a)), from_.push_back(triangle.normal.dot(x) - offset_.back());
    }
    kept_.resize(numbers_.size());
  }

  bool empty() const { return numbers_.empty(); }

  /// Those whose box the line from x to a node touches and whose plane may lie between the two, ascending. Rounding
  /// errors are far smaller than what is allowed for them.
  std::span<const int> towards(const Vec<3>& node) {
    const Vec<3> lower = x_.cwiseMin(node), upper = x_.cwiseMax(node);
    const double sure = 1e-6 * (upper - lower).maxCoeff();
    for (std::size_t i = 0; i < numbers_.size(); ++i) {
      const double from = from_[i],
                   to = normal_[0][i] * node[0] + normal_[1][i] * node[1] + normal_[2][i] * node[2] - offset_[i];
      bool out = ((from > sure) & (to > sure)) | ((from < -sure) & (to < -sure));
      for (int d = 0; d < 3; ++d) out |= int{upper[d] < lower_[d][i]} | int{upper_[d][i] < lower[d]};
      kept_[i] = out ? 0 : 1;
    }
    found_.clear();
    for (std::size_t i = 0; i < numbers_.size(); ++i)
      if (kept_[i] != 0) found_.push_back(numbers_[i]);
    return found_;
  }

 private:
  Vec<3> x_;
  std::vector<int> numbers_, found_;
  std::array<std::vector<double>, 3> lower_, upper_, normal_;
  std::vector<double> offset_, from_;
  std::vector<unsigned char> kept_;
};

}  // namespace cairn
