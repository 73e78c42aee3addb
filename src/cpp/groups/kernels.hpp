// Products of groups, and the functions that are compiled once per instruction set: see
// simd/dispatch.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace hovi::groups {

enum class Kind : std::int64_t { plain, so2, se2, so3, se3 };

// A part of a configuration space: a group, or plain coordinates.
struct Part {
  Kind kind;
  std::int64_t q, v, size;  // where it begins in q and in v, and its size in v
};

struct Space {
  std::size_t nq, nv, parts;
  const Part* part;
};

// The charts of intervals, of one scheme or with tables of their own.
struct Charts {
  Space space;
  std::size_t intervals, points, columns;  // B, Q, m
  bool own_tables;                         // of every interval, or shared
  const double* table;                     // (Q, 3, m), or (B, Q, 3, m)
  const double* weights;                   // (Q), or (B, Q)
  const double* steps;                     // (B)
  const double* x;                         // (x, x', x''), (3, B, Q, n)
  const double* ends;                      // (x1, h x1'), (B, 2, n)
};

struct Kernels {
  // v = J x' and a = J x'' + J' x' at P points; of q(t) (+) x(t) where base_rates holds v and a
  // of q(t), (2, P, n), or nothing. x: (3, P, n). v, a: (P, n).
  void (*rates)(const Space& space, std::size_t points, const double* x, const double* base_rates,
                double* v, double* a);

  // x' and x'' of a curve that is at x with velocity v and acceleration a, all (P, n).
  void (*local_rates)(const Space& space, std::size_t points, const double* x, const double* v,
                      const double* a, double* dx, double* ddx);

  // Doubles that the functions below work in, aligned as packs are.
  std::size_t (*workspace_size)(const Charts& charts);

  // Gradient and Hessian of h sum_q w_q L in the columns (q0, h v0, q1, h v1, c), from those of L
  // in (q, v, a) at the points. table: (q, h v, h^2 a) over (q0, h v0, x1, h x1', c).
  // gradient: (B, Q, 3, n). hessian: (B, Q, 3, n, 3, n), symmetric.
  // columns_gradient: (B, m, n). columns_hessian: (B, m, m, n, n).
  void (*expand)(const Charts& charts, const double* gradient, const double* hessian,
                 double* workspace, double* columns_gradient, double* columns_hessian);

  // The gradient alone. regular: the table is over (q0, h v0, Z0, Z1, c).
  void (*pull_gradient)(const Charts& charts, const double* gradient, bool regular,
                        double* workspace, double* columns_gradient);

  // Gradients of the moments h sum_q w_q t_q y of some outputs y against test functions t.
  // tests: (K, Q). jacobian: of the outputs in (q, v, a) at the points, (B, Q, outputs, 3, n).
  // columns_gradients: (B, K, outputs, m, n).
  void (*pull_moments)(const Charts& charts, std::size_t tests_count, const double* tests,
                       std::size_t outputs, const double* jacobian, double* workspace,
                       double* columns_gradients);

  // Doubles that pull_moments works in.
  std::size_t (*moments_workspace_size)(const Charts& charts, std::size_t tests_count);

  // Change of (q, v, a) at the points, (B, Q, 3, n), in a step of the columns (B, m, n).
  void (*push_steps)(const Charts& charts, const double* step, double* workspace, double* change);

  static const Kernels baseline, avx2;
};

}  // namespace hovi::groups
