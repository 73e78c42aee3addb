// Second derivatives at points, contracted with a scheme's table into those of the intervals.
#pragma once

#include <algorithm>

#include "kernels.hpp"
#include "limited_outputs.hpp"
#include "simd/pack.hpp"

namespace hovi::intervals {
namespace {

constexpr std::size_t largest_tile = 64;  // numbers of an n x n block that are done at a time

// Tables of order k have R = k + 1 rows at each point: q, v, ..., q^(k).

// Rows of the n x n blocks that are done at a time, and the numbers that they take in whole packs.
inline std::size_t tile_rows(std::size_t n) {
  return std::max<std::size_t>(1, std::min(n, largest_tile / n));
}
inline std::size_t tile_size(std::size_t n) {
  return (tile_rows(n) * n + lanes - 1) / lanes * lanes;
}

std::size_t workspace_size(const Contraction& shape) {
  const std::size_t R = shape.rows, m = shape.columns, terms = R * shape.points;
  return (R * R + terms * m + m * (m + 1) / 2) * tile_size(shape.dof) + 2 * terms * m;
}

// The table of interval k, by its length: A = table / (1, h, h^2, ...) and h w A, (Q, R, m) each.
template <std::size_t R>
inline void scale_table(const Contraction& shape, std::size_t k, double* A, double* weighted) {
  const std::size_t m = shape.columns, first = shape.own_tables ? k * shape.points : 0;
  const double h = shape.steps[k];
  double powers[R], power = 1.0;
  for (std::size_t r = 0; r < R; ++r, power *= h) powers[r] = 1.0 / power;
  for (std::size_t q = 0; q < shape.points; ++q)
    for (std::size_t r = 0; r < R; ++r)
      for (std::size_t j = 0; j < m; ++j) {
        const std::size_t at = (R * q + r) * m + j;
        A[at] = shape.table[R * first * m + at] * powers[r];
        weighted[at] = h * shape.weights[first + q] * A[at];
      }
}

// Some rows of the R x R blocks of n x n of a point's Hessian, each in one piece.
template <std::size_t R>
inline void read_tile(const double* hessian, std::size_t n, std::size_t first, std::size_t rows,
                      std::size_t size, double* tile) {
  for (std::size_t r = 0; r < R; ++r)
    for (std::size_t a = 0; a < rows; ++a) {
      const double* row = hessian + (r * n + first + a) * R * n;
      for (std::size_t s = 0; s < R; ++s) {
        double* out = tile + (R * r + s) * size + a * n;
        const double* in = row + s * n;
        std::size_t b = 0;
        for (; b + lanes <= n; b += lanes) store(out + b, load(in + b));
        for (; b < n; ++b) out[b] = in[b];
      }
    }
}

// H_q A_q: for each column j the R blocks of n x n of rows (q, v, ...).
template <std::size_t R>
inline void multiply_point(const double* tile, const double* A, std::size_t m, std::size_t terms,
                           std::size_t size, double* halves) {
  for (std::size_t r = 0; r < R; ++r, tile += R * size)
    for (std::size_t j = 0; j < m; ++j) {
      Pack factors[R];
      for (std::size_t s = 0; s < R; ++s) factors[s] = broadcast(A[s * m + j]);
      double* out = halves + (terms * j + r) * size;
      for (std::size_t p = 0; p < size; p += lanes) {
        Pack total = factors[0] * load(tile + p);
        for (std::size_t s = 1; s < R; ++s) total += factors[s] * load(tile + s * size + p);
        store(out + p, total);
      }
    }
}

// Some packs of some blocks (i, j), (i + 1, j), ...: the sums over the terms of A_i (H A)_j.
template <std::size_t blocks, std::size_t packs>
inline void sum_terms(const double* weighted, const double* half, std::size_t m,
                      std::size_t terms, std::size_t size, double* sums) {
  Pack total[blocks][packs] = {};
  for (std::size_t t = 0; t < terms; ++t, weighted += m, half += size)
    for (std::size_t b = 0; b < blocks; ++b) {
      const Pack factor = broadcast(weighted[b]);
      for (std::size_t p = 0; p < packs; ++p) total[b][p] += factor * load(half + p * lanes);
    }
  for (std::size_t b = 0; b < blocks; ++b)
    for (std::size_t p = 0; p < packs; ++p) store(sums + b * size + p * lanes, total[b][p]);
}

template <std::size_t blocks>
inline void sum_blocks(const double* weighted, const double* half, std::size_t m,
                       std::size_t terms, std::size_t size, double* sums) {
  std::size_t p = 0;
  for (; p + 3 * lanes <= size; p += 3 * lanes)
    sum_terms<blocks, 3>(weighted, half + p, m, terms, size, sums + p);
  for (; p < size; p += lanes)
    sum_terms<blocks, 1>(weighted, half + p, m, terms, size, sums + p);
}

// The blocks (i, j) of the lower triangle, column by column.
inline void sum_points(const double* weighted, const double* halves, std::size_t m,
                       std::size_t terms, std::size_t size, double* sums) {
  for (std::size_t j = 0; j < m; ++j, halves += terms * size) {
    std::size_t i = j;
    for (; i + 3 <= m; i += 3, sums += 3 * size)
      sum_blocks<3>(weighted + i, halves, m, terms, size, sums);
    for (; i < m; ++i, sums += size)
      sum_blocks<1>(weighted + i, halves, m, terms, size, sums);
  }
}

// Both triangles from the lower one.
inline void write_tile(const double* sums, std::size_t m, std::size_t n, std::size_t first,
                       std::size_t rows, std::size_t size, double* out) {
  for (std::size_t j = 0; j < m; ++j)
    for (std::size_t i = j; i < m; ++i, sums += size) {
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
  for (std::size_t row = 0; row < shape.rows * shape.points; ++row, gradient += n)
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t a = 0; a < n; ++a) out[i * n + a] += weighted[row * m + i] * gradient[a];
}

template <std::size_t R>
void contract_rows(const Contraction& shape, const double* gradient, const double* hessian,
                   double* work, double* columns_gradient, double* columns_hessian) {
  const std::size_t Q = shape.points, m = shape.columns, n = shape.dof, terms = R * Q;
  const std::size_t size = tile_size(n), rows = tile_rows(n);
  double *tile = work, *halves = tile + R * R * size, *sums = halves + terms * m * size;
  double *A = sums + m * (m + 1) / 2 * size, *weighted = A + terms * m;
  std::fill(tile, tile + R * R * size, 0.0);
  for (std::size_t k = 0; k < shape.intervals; ++k) {
    if (k == 0 || shape.own_tables || shape.steps[k] != shape.steps[k - 1])
      scale_table<R>(shape, k, A, weighted);
    contract_gradient(shape, weighted, gradient + k * terms * n, columns_gradient + k * m * n);
    for (std::size_t first = 0; first < n; first += rows) {
      const std::size_t count = std::min(rows, n - first);
      for (std::size_t q = 0; q < Q; ++q) {
        read_tile<R>(hessian + (k * Q + q) * R * R * n * n, n, first, count, size, tile);
        multiply_point<R>(tile, A + R * q * m, m, terms, size, halves + R * q * size);
      }
      sum_points(weighted, halves, m, terms, size, sums);
      write_tile(sums, m, n, first, count, size, columns_hessian + k * m * m * n * n);
    }
  }
}

// Does nothing for another number of rows than 2 to 5.
void contract(const Contraction& shape, const double* gradient, const double* hessian,
              double* work, double* columns_gradient, double* columns_hessian) {
  using Function = decltype(&contract_rows<3>);
  constexpr Function of_rows[] = {contract_rows<2>, contract_rows<3>, contract_rows<4>,
                                  contract_rows<5>};
  if (shape.rows < least_rows || shape.rows > most_rows) return;
  of_rows[shape.rows - least_rows](shape, gradient, hessian, work, columns_gradient,
                                   columns_hessian);
}

constexpr Kernels kernels{workspace_size, contract,  push, pull,
                          push_rows,      pull_rows, add_squares};

}  // namespace
}  // namespace hovi::intervals
