// Paths of intervals: (q, v, a) at their quadrature points, and steps in their columns.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace hovi::intervals {

// A path of N intervals with n degrees of freedom and r inner modes.
struct IntervalPath {
  std::size_t intervals, modes, dof;
  const double *v, *z, *inner;  // (N + 1, n), (N, 2, n), (N, r, n)
};

inline void add_scaled(double factor, const double* from, std::size_t n, double* to) {
  for (std::size_t a = 0; a < n; ++a) to[a] += factor * from[a];
}

// (q, v, a) at the points of some intervals, (3, B, Q, n), from a table (Q, 3, columns) over
// (h v0, h^2 z0, h^2 z1, h^2 inner) of (q - q0, h v, h^2 a).
inline void interpolate(const IntervalPath& path, const double* q, const double* table,
                        std::size_t points, std::size_t columns, const double* steps,
                        const std::int64_t* numbers, std::size_t count, double* out) {
  const std::size_t n = path.dof;
  for (std::size_t b = 0; b < count; ++b) {
    const std::size_t k = numbers[b];
    const double h = steps[b], scales[] = {h * h, h, 1.0};
    const double *const z = path.z + 2 * k * n, *const inner = path.inner + k * path.modes * n;
    for (std::size_t j = 0; j < points; ++j)
      for (std::size_t d = 0; d < 3; ++d) {
        const double* const row = table + (3 * j + d) * columns;
        double* const to = out + ((d * count + b) * points + j) * n;
        if (d == 0)
          std::copy_n(q + k * n, n, to);
        else
          std::fill_n(to, n, 0.0);
        add_scaled(row[0] * scales[d] / h, path.v + k * n, n, to);
        add_scaled(row[1] * scales[d], z, n, to);
        add_scaled(row[2] * scales[d], z + n, n, to);
        for (std::size_t i = 3; i < columns; ++i)
          add_scaled(row[i] * scales[d], inner + (i - 3) * n, n, to);
      }
  }
}

// x of q = q0 (+) x at instants, (count, n), one row per instant, (count, columns), over
// (h v0, h^2 z0, h^2 z1, h^2 inner) of its interval. steps: h of all intervals.
inline void displacements_at(const IntervalPath& path, const double* rows, std::size_t columns,
                             const double* steps, const std::int64_t* numbers, std::size_t count,
                             double* out) {
  const std::size_t n = path.dof;
  for (std::size_t e = 0; e < count; ++e, rows += columns, out += n) {
    const std::size_t k = numbers[e];
    const double h = steps[k];
    const double *const z = path.z + 2 * k * n, *const inner = path.inner + k * path.modes * n;
    std::fill_n(out, n, 0.0);
    add_scaled(rows[0] * h, path.v + k * n, n, out);
    for (std::size_t i = 1; i < columns; ++i)
      add_scaled(rows[i] * h * h, i < 3 ? z + (i - 1) * n : inner + (i - 3) * n, n, out);
  }
}

// The largest of |q1 - q0 - h v0 - h^2 z0| and |h (v1 - v0 - h z1)|, relative to the largest |q| or
// to one; not a number where the path has one that is not finite.
inline double misfit(const IntervalPath& path, const double* q, const double* steps) {
  const std::size_t N = path.intervals, n = path.dof;
  double largest = 0.0, size = 1.0, poison = 0.0;
  for (std::size_t i = 0; i < (N + 1) * n; ++i) {
    size = std::max(size, std::abs(q[i]));
    poison += 0.0 * q[i] + 0.0 * path.v[i];
  }
  for (std::size_t i = 0; i < N * path.modes * n; ++i) poison += 0.0 * path.inner[i];
  for (std::size_t k = 0; k < N; ++k)
    for (std::size_t i = k * n; i < (k + 1) * n; ++i) {
      const double h = steps[k], z0 = path.z[k * n + i], z1 = path.z[(k + 1) * n + i];
      poison += 0.0 * z0 + 0.0 * z1;
      largest = std::max(largest, std::abs(q[i + n] - q[i] - h * path.v[i] - h * h * z0));
      largest = std::max(largest, std::abs(h * (path.v[i + n] - path.v[i] - h * z1)));
    }
  return largest / size + poison;
}

// Where a step leads, (N, columns, n) in the columns (q0, h v0, q1, h v1, c), or
// (q0, h v0, Z0, Z1, c) where they are not nodal. dq: (N + 1, n), the change of configurations.
inline void move(const IntervalPath& path, const double* step, std::size_t columns,
                 const double* steps, bool nodal, double* dq, double* v, double* z,
                 double* inner) {
  const std::size_t N = path.intervals, r = path.modes, n = path.dof;
  std::copy_n(path.v, (N + 1) * n, v);
  std::copy_n(path.z, N * 2 * n, z);
  std::copy_n(path.inner, N * r * n, inner);
  std::fill_n(dq, (N + 1) * n, 0.0);
  for (std::size_t k = 0; k < N; ++k, step += columns * n) {
    const double h = steps[k], s = 1.0 / (h * h);
    const double *const q0 = step, *const v0 = step + n, *const first = step + 2 * n,
                        *const second = step + 3 * n;
    for (std::size_t a = 0; a < n; ++a) {
      const double Z0 = nodal ? first[a] - q0[a] - v0[a] : first[a];
      const double Z1 = nodal ? second[a] - v0[a] : second[a];
      dq[k * n + a] = q0[a];
      v[k * n + a] += v0[a] / h;
      z[2 * k * n + a] += s * Z0;
      z[(2 * k + 1) * n + a] += s * Z1;
      if (nodal && k + 1 == N) dq[N * n + a] = first[a], v[N * n + a] += second[a] / h;
    }
    add_scaled(s, step + 4 * n, (columns - 4) * n, inner + k * r * n);
  }
}

}  // namespace hovi::intervals
