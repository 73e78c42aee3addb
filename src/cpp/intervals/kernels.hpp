// The functions that are compiled once per instruction set: see simd/dispatch.hpp.
#pragma once

#include <cstddef>

namespace hovi::intervals {

// Rows of a table at each point, k + 1 for Lagrangians of order k, that `contract` knows.
constexpr std::size_t least_rows = 2, most_rows = 5;

// Tables over a batch of intervals: one for all of them, or one for each.
struct Contraction {
  std::size_t intervals, points, rows, columns, dof;  // B, Q, R, m, n
  bool own_tables;
  const double* table;    // (Q, R, m), (B, Q, R, m) with own tables
  const double* weights;  // (Q), (B, Q) with own tables
  const double* steps;    // (B)
};

struct Kernels {
  // Doubles that `contract` works in.
  std::size_t (*workspace_size)(const Contraction& shape);

  // Derivatives of an interval in its m columns from those in (q, v, ...) at its points: with
  // A_q = table_q / (1, h, h^2, ...) the sums over q of h w_q A_q^T g_q and h w_q A_q^T H_q A_q.
  // gradient: (B, Q, R, n). hessian: (B, Q, R, n, R, n), symmetric.
  // columns_gradient: (B, m, n). columns_hessian: (B, m, m, n, n).
  void (*contract)(const Contraction& shape, const double* gradient, const double* hessian,
                   double* workspace, double* columns_gradient, double* columns_hessian);

  static const Kernels baseline, avx2;
};

}  // namespace hovi::intervals
