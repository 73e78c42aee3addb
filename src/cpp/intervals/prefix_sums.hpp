// Values at nodes as prefix sums of their increments over the intervals.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace hovi::intervals {

// Replaces x (N + 1 rows of n numbers, `stride` apart) by the sums of increments (N, n), plus the
// mean of what is left of x; unless that moves a number by more than `share` of the largest.
inline void replace_by_prefix_sums(std::size_t N, std::size_t n, const double* increments,
                                   double share, std::size_t stride, double* x) {
  std::vector<double> sums((N + 1) * n), means(n);
  double largest = 0.0;
  for (std::size_t k = 0; k <= N; ++k)
    for (std::size_t i = 0; i < n; ++i) {
      if (k > 0) sums[k * n + i] = sums[(k - 1) * n + i] + increments[(k - 1) * n + i];
      means[i] += (x[k * stride + i] - sums[k * n + i]) / double(N + 1);
      largest = std::max(largest, std::abs(x[k * stride + i]));
    }
  for (std::size_t k = 0; k <= N; ++k)
    for (std::size_t i = 0; i < n; ++i) {
      const double moved = (sums[k * n + i] += means[i]) - x[k * stride + i];
      if (!(std::abs(moved) <= share * largest)) return;  // nor where it is not a number
    }
  for (std::size_t k = 0; k <= N; ++k) std::copy_n(sums.data() + k * n, n, x + k * stride);
}

}  // namespace hovi::intervals
