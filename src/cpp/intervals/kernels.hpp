// The functions that are compiled once per instruction set: see simd/dispatch.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

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

// K of the numbers (q, v, ..., outputs) at a point, each divided by its range.
struct Selection {
  std::size_t count, outputs;   // K and the number of outputs p
  const std::int64_t* columns;  // (K), below R n + p
  const double* scales;         // (K), 1 / range
  const double* jacobian;       // (P, p, R n)
};

// Rows that are linear in the columns of one interval and joint: y = row . x_(., joint).
struct LinearRows {
  std::size_t count, columns, dof;         // E, m, n
  const std::int64_t *intervals, *joints;  // (E)
  const double* rows;                      // (E, m)
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

  // The change of the selection, (P, K), in a step of the intervals' columns, (B, m, n).
  // work: R n numbers.
  void (*push)(const Contraction& shape, const Selection& of, const double* step, double* work,
               double* out);

  // Forces on the selection, (P, K), as a covector in the intervals' columns, (B, m, n).
  // work: R n numbers.
  void (*pull)(const Contraction& shape, const Selection& of, const double* forces, double* work,
               double* out);

  // The change of the rows, (E), in a step of the intervals' columns, (N, m, n). work: m numbers.
  void (*push_rows)(const LinearRows& of, const double* step, double* work, double* out);

  // Add forces on the rows, (E), to a covector in the intervals' columns, (N, m, n).
  // work: m numbers.
  void (*pull_rows)(const LinearRows& of, const double* forces, double* work, double* out);

  // Add weights of the rows' squares, (E), to a Hessian, (N, m, m, n, n). work: m^2 numbers.
  void (*add_squares)(const LinearRows& of, const double* weights, double* work, double* out);

  static const Kernels baseline, avx2;
};

}  // namespace hovi::intervals
