// (q, v, a) of a motion on a vector space, at a time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hovi::sampling {

// A path of N intervals with n joints, for a Lagrangian of order k, and its curve on an interval,
//   h^j q^(j)(s) = sum_m (h^m q0^(m)) s^(m-j) / (m-j)! + sum_d P_d(2 s - 1) series[d, j] (Z, c),
// with 0 < m < k, P_d the Legendre polynomials, Z = h^k z and c = h^k inner.
struct PathCurve {
  std::size_t intervals, dof, order, modes, degrees;
  const double *q, *v, *higher;  // (N + 1, n), (N + 1, n), (N + 1, k - 2, n)
  const double *z, *inner;       // (N, k, n), (N, r, n)
  const double* times;           // of the nodes, (N + 1,)
  const double* steps;           // h, (N,)
  const double* series;          // (degrees, 3, k + r)
  const std::int64_t* used;      // inner modes of each interval, (N,)
};

struct Position {
  std::size_t interval;
  double s;  // in [0, 1]
};

// The last interval that begins at t or earlier; at the end, the end of the last one.
inline Position locate(const PathCurve& path, double t) {
  const double *const first = path.times, *const last = first + path.intervals;
  if (t >= *last) return {path.intervals - 1, 1.0};
  const std::ptrdiff_t after = std::upper_bound(first, last, t) - first;
  const std::size_t k = after > 0 ? after - 1 : 0;
  return {k, std::clamp((t - first[k]) / path.steps[k], 0.0, 1.0)};
}

// P_0 .. P_{count - 1} at x in [-1, 1].
inline void legendre(double x, std::size_t count, double* P) {
  for (std::size_t j = 0; j < count; ++j)
    P[j] = j == 0 ? 1.0 : j == 1 ? x : ((2.0 * j - 1.0) * x * P[j - 1] - (j - 1.0) * P[j - 2]) / j;
}

inline double power(double h, int exponent) {
  double result = 1.0;
  for (int i = 0; i < exponent; ++i) result *= h;
  return exponent < 0 ? 1.0 / power(h, -exponent) : result;
}

inline void add_scaled(double factor, const double* from, std::size_t n, double* to) {
  for (std::size_t i = 0; i < n; ++i) to[i] += factor * from[i];
}

// The j-th derivative, n numbers. P: of the position, `degrees` numbers.
inline void derivative(const PathCurve& path, const Position& at, const double* P, std::size_t j,
                       double* out) {
  const std::size_t n = path.dof, k = path.order, columns = k + path.modes, K = at.interval;
  const double h = path.steps[K], scale = power(h, int(k) - int(j)), past = at.s * h;
  std::fill_n(out, n, 0.0);
  // The series vanishes at the start up to its derivative k - 1: the node itself is exact.
  const std::size_t used = at.s == 0.0 && j < k ? 0 : k + std::size_t(path.used[K]);
  for (std::size_t column = 0; column < used; ++column) {
    double row = 0.0;
    for (std::size_t d = 0; d < path.degrees; ++d)
      row += P[d] * path.series[(3 * d + j) * columns + column];
    const double* const data = column < k ? path.z + (K * k + column) * n
                                          : path.inner + (K * path.modes + column - k) * n;
    add_scaled(row * scale, data, n, out);
  }
  double factor = 1.0;
  for (std::size_t m = j; m < k; ++m) {
    const double* const rate = m == 0   ? path.q + K * n
                               : m == 1 ? path.v + K * n
                                        : path.higher + (K * (k - 2) + m - 2) * n;
    add_scaled(factor, rate, n, out);
    factor *= past / double(m - j + 1);
  }
}

}  // namespace hovi::sampling
