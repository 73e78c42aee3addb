// The far end of an interval: how (x1, x1') depends on (q0, q1, v1), to second order.
//
// From q1 = q0 exp(x1) and v1 = J(x1) x1', which are differentiated implicitly.
#pragma once

#include "point_chart.hpp"

namespace hovi::groups {
namespace {

struct EndVariation {
  Variation at_end;
  Matrix<Dual> inverse_J;
  Matrix<Dual> x_by[2], dx_by[2];  // x1 and x1' by q0 and by q1; x1' by v1 is J^-1

  explicit EndVariation(const Vector<Curve>& x) : at_end(x) {
    inverse_J = inverse(at_end.J);
    x_by[0] = -1.0 * (inverse_J * at_end.inverse_adjoint), x_by[1] = inverse_J;
    for (std::size_t i = 0; i < 2; ++i) dx_by[i] = -1.0 * (inverse_J * (at_end.K * x_by[i]));
  }
};

// The blocks of the Jacobian, rows (x1, x1'), columns (q0, q1, v1).
template <typename Group>
struct EndJacobian {
  Square<Group> x_by[2], dx_by[2], inverse_J;

  explicit EndJacobian(const EndVariation& end)
      : x_by{linear<Group>(end.x_by[0]), linear<Group>(end.x_by[1])},
        dx_by{linear<Group>(end.dx_by[0]), linear<Group>(end.dx_by[1])},
        inverse_J(linear<Group>(end.inverse_J)) {}
};

// The Hessian of weighted (x1, x1') in (q0, q1, v1), as bilinear forms.
struct EndBend {
  Matrix<Dual> at[3][3];

  // n_x, n_dx: the weights.
  EndBend(const EndVariation& end, const Vector<Dual>& n_x, const Vector<Dual>& n_dx) {
    const Matrix<Dual> back = transposed(end.inverse_J);
    const Vector<Dual> force_v = back * n_dx;
    const Vector<Dual> force_q = back * (n_x - transposed(end.at_end.K) * force_v);
    const PointBend bend(end.at_end, force_q, force_v, Vector<Dual>{});
    const Matrix<Dual> zero{}, *const x_by[] = {&end.x_by[0], &end.x_by[1], &zero},
                                      *const dx_by[] = {&end.dx_by[0], &end.dx_by[1],
                                                        &end.inverse_J};
    for (std::size_t j = 0; j < 3; ++j) {
      const Matrix<Dual> x = bend.x_x * *x_by[j] + bend.x_dx * *dx_by[j];
      const Matrix<Dual> dx = transposed(bend.x_dx) * *x_by[j] + bend.dx_dx * *dx_by[j];
      for (std::size_t i = 0; i <= j; ++i)
        at[i][j] = -1.0 * (transposed(*x_by[i]) * x + transposed(*dx_by[i]) * dx);
    }
    at[0][1] =
        at[0][1] + 0.5 * (transposed(end.at_end.inverse_adjoint) * cross(force_q, identity()));
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t i = 0; i < j; ++i) at[j][i] = transposed(at[i][j]);
  }
};

}  // namespace
}  // namespace hovi::groups
