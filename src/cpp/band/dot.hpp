// Scalar products.
#pragma once

#include <cstddef>

namespace hovi::band {

// Four sums at a time: each waits for its own last term only.
inline double dot(const double* x, const double* y, std::size_t k) {
  double sums[4] = {};
  std::size_t c = 0;
  for (; c + 4 <= k; c += 4)
    for (std::size_t lane = 0; lane < 4; ++lane) sums[lane] += x[c + lane] * y[c + lane];
  for (; c < k; ++c) sums[0] += x[c] * y[c];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

}  // namespace hovi::band
