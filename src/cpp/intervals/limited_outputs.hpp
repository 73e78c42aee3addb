// Limited quantities at points and along intervals: changes pushed forward, multipliers pulled back.
//
// Everything is in an unnamed namespace: each instruction set has its own (see simd/dispatch.hpp).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "kernels.hpp"
#include "simd/pack.hpp"

namespace hovi::intervals {
namespace {

inline double dot(const double* x, const double* y, std::size_t count) {
  const std::size_t whole = count - count % lanes;
  Pack total = {};
  for (std::size_t i = 0; i < whole; i += lanes) total += load(x + i) * load(y + i);
  double rest = sum(total);
  for (std::size_t i = whole; i < count; ++i) rest += x[i] * y[i];
  return rest;
}

// y += factor x.
inline void add_multiple(double factor, const double* x, std::size_t count, double* y) {
  const std::size_t whole = count - count % lanes;
  const Pack factors = broadcast(factor);
  for (std::size_t i = 0; i < whole; i += lanes)
    store(y + i, load(y + i) + factors * load(x + i));
  for (std::size_t i = whole; i < count; ++i) y[i] += factor * x[i];
}

// 1, 1/h, 1/h^2, ...
inline void inverse_powers(double h, std::size_t rows, double* powers) {
  double power = 1.0;
  for (std::size_t r = 0; r < rows; ++r, power *= h) powers[r] = 1.0 / power;
}

// The table of a point, (R, m).
inline const double* table_of(const Contraction& shape, std::size_t k, std::size_t q) {
  const std::size_t first = shape.own_tables ? k * shape.points : 0;
  return shape.table + (first + q) * shape.rows * shape.columns;
}

// work: R n numbers.
void push(const Contraction& shape, const Selection& of, const double* step, double* work,
          double* out) {
  const std::size_t R = shape.rows, m = shape.columns, n = shape.dof, size = R * n;
  double powers[most_rows];
  const double* J = of.jacobian;
  for (std::size_t k = 0; k < shape.intervals; ++k, step += m * n) {
    inverse_powers(shape.steps[k], R, powers);
    for (std::size_t q = 0; q < shape.points; ++q, out += of.count, J += of.outputs * size) {
      const double* const table = table_of(shape, k, q);
      std::fill_n(work, size, 0.0);
      for (std::size_t r = 0; r < R; ++r)
        for (std::size_t j = 0; j < m; ++j)
          add_multiple(table[r * m + j] * powers[r], step + j * n, n, work + r * n);
      for (std::size_t c = 0; c < of.count; ++c) {
        const auto column = std::size_t(of.columns[c]);
        const double change =
            column < size ? work[column] : dot(J + (column - size) * size, work, size);
        out[c] = of.scales[c] * change;
      }
    }
  }
}

// work: R n numbers.
void pull(const Contraction& shape, const Selection& of, const double* forces, double* work,
          double* out) {
  const std::size_t R = shape.rows, m = shape.columns, n = shape.dof, size = R * n;
  double powers[most_rows];
  const double* J = of.jacobian;
  std::fill_n(out, shape.intervals * m * n, 0.0);
  for (std::size_t k = 0; k < shape.intervals; ++k, out += m * n) {
    inverse_powers(shape.steps[k], R, powers);
    for (std::size_t q = 0; q < shape.points; ++q, forces += of.count, J += of.outputs * size) {
      const std::size_t weight = shape.own_tables ? k * shape.points + q : q;
      const double share = shape.steps[k] * shape.weights[weight];
      const double* const table = table_of(shape, k, q);
      std::fill_n(work, size, 0.0);
      for (std::size_t c = 0; c < of.count; ++c) {
        const auto column = std::size_t(of.columns[c]);
        const double force = share * of.scales[c] * forces[c];
        if (column < size)
          work[column] += force;
        else
          add_multiple(force, J + (column - size) * size, size, work);
      }
      for (std::size_t r = 0; r < R; ++r)
        for (std::size_t j = 0; j < m; ++j)
          add_multiple(table[r * m + j] * powers[r], work + r * n, n, out + j * n);
    }
  }
}

// Calls work(first, last) for every run of rows in one interval and of one joint.
template <typename Work>
inline void in_runs(const LinearRows& of, const Work& work) {
  for (std::size_t first = 0, last = 0; first < of.count; first = last) {
    for (last = first + 1; last < of.count && of.intervals[last] == of.intervals[first] &&
                           of.joints[last] == of.joints[first];)
      ++last;
    work(first, last);
  }
}

// A number of columns that is known at compile time, so that loops are unrolled; 0 for any number.
template <std::size_t columns>
struct Known {
  static constexpr std::size_t value = columns;
};

// Calls work(Known<m>()) for the numbers of columns that most rows have, else work(Known<0>()).
template <typename Work>
inline void with_known_columns(std::size_t m, const Work& work) {
  switch (m) {
    case 4: return work(Known<4>());
    case 5: return work(Known<5>());
    case 6: return work(Known<6>());
    case 7: return work(Known<7>());
    case 8: return work(Known<8>());
    case 9: return work(Known<9>());
    case 10: return work(Known<10>());
    case 11: return work(Known<11>());
    case 12: return work(Known<12>());
    default: return work(Known<0>());
  }
}

template <std::size_t known>
inline std::size_t columns_of(const LinearRows& of) {
  return known == 0 ? of.columns : known;
}

template <std::size_t known>
void push_rows_of(const LinearRows& of, const double* step, double* work, double* out) {
  const std::size_t m = columns_of<known>(of), n = of.dof;
  in_runs(of, [&](std::size_t first, std::size_t last) {
    const double* const x = step + of.intervals[first] * m * n + of.joints[first];
    for (std::size_t j = 0; j < m; ++j) work[j] = x[j * n];
    for (std::size_t e = first; e < last; ++e) out[e] = dot(of.rows + e * m, work, m);
  });
}

template <std::size_t known>
void pull_rows_of(const LinearRows& of, const double* forces, double* work, double* out) {
  const std::size_t m = columns_of<known>(of), n = of.dof;
  in_runs(of, [&](std::size_t first, std::size_t last) {
    std::fill_n(work, m, 0.0);
    for (std::size_t e = first; e < last; ++e) add_multiple(forces[e], of.rows + e * m, m, work);
    double* const g = out + of.intervals[first] * m * n + of.joints[first];
    for (std::size_t j = 0; j < m; ++j) g[j * n] += work[j];
  });
}

template <std::size_t known>
void add_squares_of(const LinearRows& of, const double* weights, double* work, double* out) {
  const std::size_t m = columns_of<known>(of), n = of.dof;
  in_runs(of, [&](std::size_t first, std::size_t last) {
    std::fill_n(work, m * m, 0.0);
    for (std::size_t e = first; e < last; ++e) {
      const double* const row = of.rows + e * m;
      for (std::size_t i = 0; i < m; ++i) add_multiple(weights[e] * row[i], row, m, work + i * m);
    }
    double* const block = out + of.intervals[first] * m * m * n * n + of.joints[first] * (n + 1);
    for (std::size_t i = 0; i < m * m; ++i) block[i * n * n] += work[i];
  });
}

void push_rows(const LinearRows& of, const double* step, double* work, double* out) {
  with_known_columns(of.columns, [&](auto columns) {
    push_rows_of<decltype(columns)::value>(of, step, work, out);
  });
}

void pull_rows(const LinearRows& of, const double* forces, double* work, double* out) {
  with_known_columns(of.columns, [&](auto columns) {
    pull_rows_of<decltype(columns)::value>(of, forces, work, out);
  });
}

void add_squares(const LinearRows& of, const double* weights, double* work, double* out) {
  with_known_columns(of.columns, [&](auto columns) {
    add_squares_of<decltype(columns)::value>(of, weights, work, out);
  });
}

}  // namespace
}  // namespace hovi::intervals
