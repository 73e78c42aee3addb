// Limited quantities at points and along intervals: changes pushed forward, multipliers pulled back.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "kernels.hpp"

namespace hovi::intervals {

// K of the numbers (q, v, ..., outputs) at a point, each divided by its range.
struct Selection {
  std::size_t count, outputs;   // K and the number of outputs p
  const std::int64_t* columns;  // (K), below R n + p
  const double* scales;         // (K), 1 / range
  const double* jacobian;       // (P, p, R n)
};

// table / (1, h, h^2, ...) of a point, (R, m).
inline void scaled_table(const Contraction& shape, std::size_t k, std::size_t q, double* A) {
  const std::size_t m = shape.columns, first = shape.own_tables ? k * shape.points : 0;
  const double* const table = shape.table + (first + q) * shape.rows * m;
  double power = 1.0;
  for (std::size_t r = 0; r < shape.rows; ++r, power *= shape.steps[k])
    for (std::size_t j = 0; j < m; ++j) A[r * m + j] = table[r * m + j] / power;
}

// The change of the selection, (P, K), in a step of the intervals' columns, (B, m, n).
// work: R m + R n numbers.
inline void push(const Contraction& shape, const Selection& of, const double* step, double* work,
                 double* out) {
  const std::size_t R = shape.rows, m = shape.columns, n = shape.dof, size = R * n;
  double *const A = work, *const dx = work + R * m;
  const double* J = of.jacobian;
  for (std::size_t k = 0; k < shape.intervals; ++k, step += m * n)
    for (std::size_t q = 0; q < shape.points; ++q, out += of.count, J += of.outputs * size) {
      scaled_table(shape, k, q, A);
      std::fill_n(dx, size, 0.0);
      for (std::size_t r = 0; r < R; ++r)
        for (std::size_t j = 0; j < m; ++j)
          for (std::size_t a = 0; a < n; ++a) dx[r * n + a] += A[r * m + j] * step[j * n + a];
      for (std::size_t c = 0; c < of.count; ++c) {
        const std::size_t column = of.columns[c];
        double change = column < size ? dx[column] : 0.0;
        if (column >= size) {
          const double* const row = J + (column - size) * size;
          for (std::size_t i = 0; i < size; ++i) change += row[i] * dx[i];
        }
        out[c] = of.scales[c] * change;
      }
    }
}

// Forces on the selection, (P, K), as a covector in the intervals' columns, (B, m, n).
inline void pull(const Contraction& shape, const Selection& of, const double* forces, double* work,
                 double* out) {
  const std::size_t R = shape.rows, m = shape.columns, n = shape.dof, size = R * n;
  double *const A = work, *const g = work + R * m;
  const double* J = of.jacobian;
  std::fill_n(out, shape.intervals * m * n, 0.0);
  for (std::size_t k = 0; k < shape.intervals; ++k, out += m * n)
    for (std::size_t q = 0; q < shape.points; ++q, forces += of.count, J += of.outputs * size) {
      const std::size_t weight = shape.own_tables ? k * shape.points + q : q;
      const double share = shape.steps[k] * shape.weights[weight];
      scaled_table(shape, k, q, A);
      std::fill_n(g, size, 0.0);
      for (std::size_t c = 0; c < of.count; ++c) {
        const std::size_t column = of.columns[c];
        const double force = share * of.scales[c] * forces[c];
        if (column < size) {
          g[column] += force;
          continue;
        }
        const double* const row = J + (column - size) * size;
        for (std::size_t i = 0; i < size; ++i) g[i] += force * row[i];
      }
      for (std::size_t r = 0; r < R; ++r)
        for (std::size_t j = 0; j < m; ++j)
          for (std::size_t a = 0; a < n; ++a) out[j * n + a] += A[r * m + j] * g[r * n + a];
    }
}

// Rows that are linear in the columns of one interval and joint: y = row . x_(., joint).
struct LinearRows {
  std::size_t count, columns, dof;            // E, m, n
  const std::int64_t *intervals, *joints;     // (E)
  const double* rows;                         // (E, m)
};

// Calls work(first, last) for every run of rows in one interval and of one joint.
template <typename Work>
void in_runs(const LinearRows& of, const Work& work) {
  for (std::size_t first = 0, last = 0; first < of.count; first = last) {
    for (last = first + 1; last < of.count && of.intervals[last] == of.intervals[first] &&
                           of.joints[last] == of.joints[first];)
      ++last;
    work(first, last);
  }
}

// The change of the rows, (E), in a step of the intervals' columns, (N, m, n). work: m numbers.
inline void push_rows(const LinearRows& of, const double* step, double* work, double* out) {
  const std::size_t m = of.columns, n = of.dof;
  in_runs(of, [&](std::size_t first, std::size_t last) {
    const double* const x = step + of.intervals[first] * m * n + of.joints[first];
    for (std::size_t j = 0; j < m; ++j) work[j] = x[j * n];
    for (std::size_t e = first; e < last; ++e) {
      double change = 0.0;
      for (std::size_t j = 0; j < m; ++j) change += of.rows[e * m + j] * work[j];
      out[e] = change;
    }
  });
}

// Add forces on the rows, (E), to a covector in the intervals' columns, (N, m, n). work: m numbers.
inline void pull_rows(const LinearRows& of, const double* forces, double* work, double* out) {
  const std::size_t m = of.columns, n = of.dof;
  in_runs(of, [&](std::size_t first, std::size_t last) {
    std::fill_n(work, m, 0.0);
    for (std::size_t e = first; e < last; ++e)
      for (std::size_t j = 0; j < m; ++j) work[j] += forces[e] * of.rows[e * m + j];
    double* const g = out + of.intervals[first] * m * n + of.joints[first];
    for (std::size_t j = 0; j < m; ++j) g[j * n] += work[j];
  });
}

// Add weights of the rows' squares, (E), to a Hessian, (N, m, m, n, n). work: m^2 numbers.
inline void add_squares(const LinearRows& of, const double* weights, double* work, double* out) {
  const std::size_t m = of.columns, n = of.dof;
  in_runs(of, [&](std::size_t first, std::size_t last) {
    std::fill_n(work, m * m, 0.0);
    for (std::size_t e = first; e < last; ++e) {
      const double* const row = of.rows + e * m;
      for (std::size_t i = 0; i < m; ++i) {
        const double weighted = weights[e] * row[i];
        for (std::size_t j = 0; j < m; ++j) work[i * m + j] += weighted * row[j];
      }
    }
    double* const block =
        out + of.intervals[first] * m * m * n * n + of.joints[first] * (n + 1);
    for (std::size_t i = 0; i < m * m; ++i) block[i * n * n] += work[i];
  });
}

}  // namespace hovi::intervals
