// A point of a curve q0 exp(x(t)): how (q, v, a) depends on (q0, x, x', x''), to second order.
//
// With z = log(exp(-x) exp(x + dx)) a varied curve is q exp(z) and its velocity
// v - [z, v] + [z, [z, v]] / 2 + z' - [z, z'] / 2 to second order, where
// z = J dx + (dJ . dx) dx / 2.
#pragma once

#include "group_coordinates.hpp"
#include "right_jacobian.hpp"

namespace hovi::groups {
namespace {

template <typename Group>
inline Vector<Curve> curve(const Pack* x, const Pack* dx, const Pack* ddx) {
  const Vector<Dual> at[] = {motion<Group>(x), motion<Group>(dx), motion<Group>(ddx)};
  Vector<Curve> result;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 2; ++j) {
      Curve& number = result.at[i];
      number.at[0][j] = at[0].at[i].at[0][j];
      number.at[1][j] = at[1].at[i].at[0][j];
      number.at[2][j] = 0.5 * at[2].at[i].at[0][j];
    }
  return result;
}

template <std::size_t power, typename Array>  // of t in a vector or a matrix
inline auto coefficient(const Array& array) {
  return each(array, [](const auto& number) { return powers<1>(number, power); });
}

// The point itself: J along the curve, v = J x' and a.
struct Motion {
  Turning turning;
  Matrix<Curve> jacobian;
  Matrix<Truncated<2>> J_along;
  Vector<Truncated<2>> v_along;
  Matrix<Dual> J;
  Vector<Dual> v, a;

  explicit Motion(const Vector<Curve>& x) : turning(x), jacobian(right_jacobian(turning)) {
    J_along = each(jacobian, [](const Curve& number) { return powers<2>(number); });
    v_along = J_along * each(x, [](const Curve& number) { return rate(number); });
    J = coefficient<0>(jacobian);
    v = coefficient<0>(v_along), a = coefficient<1>(v_along);
  }

  // Ad of exp(-x).
  Matrix<Dual> adjoint_of_inverse() const {
    return identity() + -1.0 * cross(coefficient<0>(turning.x), J);
  }
};

// First variations of (q, v, a), blocks of one group: z = J dx, and K = J' + [v, J] is how v
// depends on x.
struct Variation : Motion {
  Matrix<Dual> J1, J2, K, K1;  // the rates of J, K and its rate
  Matrix<Dual> inverse_adjoint;

  explicit Variation(const Vector<Curve>& x)
      : Motion(x), inverse_adjoint(adjoint_of_inverse()) {
    const auto slope = [](const Curve& number) { return rate(number); };
    const Matrix<Truncated<2>> bent = each(jacobian, slope) + cross(v_along, J_along);
    J1 = coefficient<1>(jacobian), J2 = 2.0 * coefficient<2>(jacobian);
    K = coefficient<0>(bent), K1 = coefficient<1>(bent);
  }
};

// The blocks of the Jacobian, rows (q, v, a), columns (q0, x, x', x''):
//
//     inverse_adjoint   J    0      0
//     0                 K    J      0
//     0                 K1   J1+K   J
template <typename Group>
struct PointJacobian {
  Square<Group> inverse_adjoint, J, K, K1, J1_K;

  explicit PointJacobian(const Variation& by)
      : inverse_adjoint(linear<Group>(by.inverse_adjoint)),
        J(linear<Group>(by.J)),
        K(linear<Group>(by.K)),
        K1(linear<Group>(by.K1)),
        J1_K(linear<Group>(by.J1 + by.K)) {}
};

// The Hessian of weighted (q, v, a): its blocks that are not zero, as bilinear forms.
struct PointBend {
  Matrix<Dual> base_x;               // of (q0, x)
  Matrix<Dual> x_x, x_dx, x_ddx;     // of x with x, x' and x''
  Matrix<Dual> dx_dx;

  // n_q, n_v, n_a: the weights.
  PointBend(const Variation& by, const Vector<Dual>& n_q, const Vector<Dual>& n_v,
            const Vector<Dual>& n_a) {
    // what weighs z and z' where they are of second order
    const Vector<Dual> force_z = n_q + cross(n_v, by.v) + cross(n_a, by.a);
    const Vector<Dual> force_dz = n_v + cross(n_a, by.v);
    Vector<Curve> weight;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 2; ++j) {
        weight.at[i].at[0][j] = 2.0 * n_a.at[i].at[0][j];
        weight.at[i].at[1][j] = force_dz.at[i].at[0][j];
        weight.at[i].at[2][j] = force_z.at[i].at[0][j];
      }
    const Matrix<Curve> M = bending(by.turning, weight);
    // -[n]_x pairs y and z to n . [y, z]; half of -z [v, z], -z' [v, z] and the like
    const Matrix<Dual> one = identity(), by_v = cross(by.v, one), by_a = cross(by.a, one);
    const Matrix<Dual> zz = cross(n_v, by_v) + cross(n_a, by_a);
    const Matrix<Dual> z_dz = cross(n_a, by_v);
    const Matrix<Dual> P = 0.5 * (zz + transposed(zz));
    const Matrix<Dual> Q = 0.5 * (cross(n_v, one) + z_dz + transposed(z_dz));
    const Matrix<Dual> R = 0.5 * cross(n_a, one), J_T = transposed(by.J);
    const Matrix<Dual> half = J_T * (0.5 * (P * by.J) + Q * by.J1 + R * by.J2);
    x_x = half + transposed(half) + coefficient<2>(M);
    x_dx = J_T * (Q * by.J + 2.0 * (R * by.J1)) + coefficient<1>(M);
    x_ddx = J_T * (R * by.J) + 0.5 * coefficient<0>(M);
    dx_dx = coefficient<0>(M);
    base_x = -0.5 * (transposed(by.inverse_adjoint) * cross(n_q, by.J));
  }
};

}  // namespace
}  // namespace hovi::groups
