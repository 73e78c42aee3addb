// A batch of points and what is computed at them: plain data, no library's types.
#pragma once

#include <cstddef>

namespace hovi::dynamics {

// A batch of points; row-major, q of shape (count, nq), v and a (count, n).
struct Points {
  std::size_t count;
  const double* q;
  const double* v;
  const double* a;
};

// Row-major: tau (count, n), jacobian (count, n, 3n), hessian (count, 3n, 3n), derivatives in the
// tangent space. What is null is not computed.
struct Expansion {
  double* tau;
  double* jacobian = nullptr;
  double* hessian = nullptr;
};

// hessian = J^T diag(weight) J + sum_i curvature_i d2tau_i, each (count, n); curvature may be null.
struct Multipliers {
  const double* weight;
  const double* curvature;
};

}  // namespace hovi::dynamics
