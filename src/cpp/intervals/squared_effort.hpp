// Squared efforts at points: squares of residuals in a diagonal metric, with their derivatives.
#pragma once

#include <algorithm>
#include <cstddef>

#include "band/dot.hpp"

namespace hovi::intervals {

// Residuals r (P, n) at P points and their metric R (n).
struct Residuals {
  std::size_t points, size;  // P, n
  const double *values, *metric;
};

inline double half_square(const Residuals& r, std::size_t p) {
  double sum = 0.0;
  for (std::size_t i = 0; i < r.size; ++i)
    sum += r.metric[i] * r.values[p * r.size + i] * r.values[p * r.size + i];
  return 0.5 * sum;
}

// sum_p w_p 1/2 r^T R r, in blocks: rounding grows with their number and length alone.
inline double weighted_square(const Residuals& r, const double* weights) {
  constexpr std::size_t block = 64;
  double total = 0.0;
  for (std::size_t first = 0; first < r.points; first += block) {
    double sum = 0.0;
    for (std::size_t p = first; p < std::min(first + block, r.points); ++p)
      sum += weights[p] * half_square(r, p);
    total += sum;
  }
  return total;
}

// y += factor x, four numbers at a time.
inline void accumulate(double factor, const double* __restrict__ x, std::size_t k,
                       double* __restrict__ y) {
  std::size_t c = 0;
  for (; c + 4 <= k; c += 4)
    for (std::size_t lane = 0; lane < 4; ++lane) y[c + lane] += factor * x[c + lane];
  for (; c < k; ++c) y[c] += factor * x[c];
}

// values (P): 1/2 r^T R r. gradient (P, k): J^T (R r + force), J of shape (P, n, k); no force where
// it is null.
inline void expand_squares(const Residuals& r, const double* jacobian, std::size_t k,
                           const double* force, double* values, double* gradient) {
  std::fill_n(gradient, r.points * k, 0.0);
  for (std::size_t p = 0; p < r.points; ++p, gradient += k) {
    values[p] = half_square(r, p);
    for (std::size_t i = 0; i < r.size; ++i, jacobian += k) {
      const std::size_t at = p * r.size + i;
      accumulate(r.metric[i] * r.values[at] + (force ? force[at] : 0.0), jacobian, k, gradient);
    }
  }
}

// R (r + J dx), shape (P, n), dx of shape (P, k).
inline void predict(const Residuals& r, const double* jacobian, const double* change,
                    std::size_t k, double* out) {
  for (std::size_t p = 0; p < r.points; ++p, change += k)
    for (std::size_t i = 0; i < r.size; ++i, jacobian += k) {
      const std::size_t at = p * r.size + i;
      out[at] = r.metric[i] * (r.values[at] + band::dot(jacobian, change, k));
    }
}

}  // namespace hovi::intervals
