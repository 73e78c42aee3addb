// Second derivatives at points, contracted with a scheme's table into those of the intervals.
#pragma once

#include <algorithm>

#include "doors.hpp"
#include "packed.hpp"

namespace hovi {
namespace {

constexpr std::size_t largest_tile = 128;  // numbers of an n x n block that are done at a time

// Rows of the n x n blocks that are done at a time, and the room of what they hold.
inline std::size_t tile_rows(std::size_t n) {
  return std::max<std::size_t>(1, std::min(n, largest_tile / n));
}
inline std::size_t tile_room(std::size_t n) {
  return (tile_rows(n) * n + lanes - 1) / lanes * lanes;
}

std::size_t workspace(const Contraction& shape) {
  const std::size_t m = shape.columns;
  return (9 + 3 * m + m * (m + 1) / 2) * tile_room(shape.dof) + 6 * shape.points * m;
}

// The table of one interval, by its length: A = table / (1, h, h^2) and h w A, each (Q, 3, m).
inline void scale_table(const Contraction& shape, double h, double* A, double* weighted) {
  const std::size_t m = shape.columns;
  const double powers[3] = {1.0, 1.0 / h, 1.0 / (h * h)};
  for (std::size_t q = 0; q < shape.points; ++q)
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t j = 0; j < m; ++j) {
        const std::size_t at = (3 * q + r) * m + j;
        A[at] = shape.table[at] * powers[r];
        weighted[at] = h * shape.weights[q] * A[at];
      }
}

// Some rows of the nine n x n blocks of a point's Hessian, each in one piece.
inline void read_tile(const double* hessian, std::size_t n, std::size_t first, std::size_t rows,
                      std::size_t room, double* tile) {
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t a = 0; a < rows; ++a) {
      const double* row = hessian + (r * n + first + a) * 3 * n;
      for (std::size_t s = 0; s < 3; ++s) {
        double* out = tile + (3 * r + s) * room + a * n;
        const double* in = row + s * n;
        std::size_t b = 0;
        for (; b + lanes <= n; b += lanes) store(out + b, load(in + b));
        for (; b < n; ++b) out[b] = in[b];
      }
    }
}

// out (+)= x[0] a + x[1] b + x[2] c over whole packs.
template <bool add>
inline void combine(const double* x, std::size_t stride, const double* a, const double* b,
                    const double* c, std::size_t room, double* out) {
  const Pack x0 = broadcast(x[0]), x1 = broadcast(x[stride]), x2 = broadcast(x[2 * stride]);
  for (std::size_t p = 0; p < room; p += lanes) {
    const Pack term = x0 * load(a + p) + x1 * load(b + p) + x2 * load(c + p);
    store(out + p, add ? load(out + p) + term : term);
  }
}

// One point's share of the lower triangle of the blocks.
inline void add_point(const double* tile, const double* A, const double* weighted, std::size_t m,
                      std::size_t room, double* half, double* sums) {
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t j = 0; j < m; ++j) {
      const double* row = tile + 3 * r * room;
      combine<false>(A + j, m, row, row + room, row + 2 * room, room, half + (3 * j + r) * room);
    }
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j <= i; ++j, sums += room) {
      const double* column = half + 3 * j * room;
      combine<true>(weighted + i, m, column, column + room, column + 2 * room, room, sums);
    }
}

// Both triangles from the lower one.
inline void write_tile(const double* sums, std::size_t m, std::size_t n, std::size_t first,
                       std::size_t rows, std::size_t room, double* out) {
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j <= i; ++j, sums += room) {
      double* lower = out + ((i * m + j) * n + first) * n;
      double* upper = out + (j * m + i) * n * n + first;
      std::copy(sums, sums + rows * n, lower);
      if (i == j) continue;
      for (std::size_t b = 0; b < n; ++b)
        for (std::size_t a = 0; a < rows; ++a) upper[b * n + a] = sums[a * n + b];
    }
}

inline void contract_gradient(const Contraction& shape, const double* weighted,
                              const double* gradient, double* out) {
  const std::size_t m = shape.columns, n = shape.dof;
  std::fill(out, out + m * n, 0.0);
  for (std::size_t row = 0; row < 3 * shape.points; ++row, gradient += n)
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t a = 0; a < n; ++a) out[i * n + a] += weighted[row * m + i] * gradient[a];
}

void contract(const Contraction& shape, const double* gradient, const double* hessian,
              double* work, double* columns_gradient, double* columns_hessian) {
  const std::size_t Q = shape.points, m = shape.columns, n = shape.dof;
  const std::size_t room = tile_room(n), rows = tile_rows(n), pairs = m * (m + 1) / 2;
  double *tile = work, *half = tile + 9 * room, *sums = half + 3 * m * room;
  double *A = sums + pairs * room, *weighted = A + 3 * Q * m;
  std::fill(tile, tile + 9 * room, 0.0);
  for (std::size_t k = 0; k < shape.intervals; ++k) {
    if (k == 0 || shape.steps[k] != shape.steps[k - 1])
      scale_table(shape, shape.steps[k], A, weighted);
    contract_gradient(shape, weighted, gradient + k * Q * 3 * n, columns_gradient + k * m * n);
    for (std::size_t first = 0; first < n; first += rows) {
      const std::size_t count = std::min(rows, n - first);
      std::fill(sums, sums + pairs * room, 0.0);
      for (std::size_t q = 0; q < Q; ++q) {
        read_tile(hessian + (k * Q + q) * 9 * n * n, n, first, count, room, tile);
        add_point(tile, A + 3 * q * m, weighted + 3 * q * m, m, room, half, sums);
      }
      write_tile(sums, m, n, first, count, room, columns_hessian + k * m * m * n * n);
    }
  }
}

}  // namespace
}  // namespace hovi
