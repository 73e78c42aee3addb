// The right Jacobian of exp on SO(3) over truncated polynomials, and how it bends.
//
// A curve g exp(x(t)) has the velocity J(x) x'. With u = |x|^2
//
//     J(x) = (1 - u C) - B [x]_x + C x x^T,  B = (1 - cos |x|) / u,  C = (1 - sin |x| / |x|) / u
//
// where B and C are entire functions of u, so that nothing is singular at zero
// [Barfoot2024, section 8.1.5].
#pragma once

#include "dual_numbers.hpp"

namespace hovi::groups {
namespace {

constexpr std::size_t series_terms = 21;  // exact to rounding for angles up to 2 pi
constexpr std::size_t derivatives = 5;    // that are needed, the function itself included

// The coefficients of sum_k (-1)^k / (2 k + shift)! u^k and of its derivatives.
struct Series {
  double at[derivatives][series_terms];
};
constexpr Series series(std::size_t shift) {
  Series result{};
  double coefficient = shift == 2 ? 1.0 / 2.0 : 1.0 / 6.0;
  for (std::size_t k = 0; k < series_terms; ++k) {
    double differentiated = coefficient;
    for (std::size_t d = 0; d < derivatives && d <= k; ++d) {
      result.at[d][k - d] = differentiated;
      differentiated *= static_cast<double>(k - d);
    }
    coefficient /= -static_cast<double>((2 * k + shift + 1) * (2 * k + shift + 2));
  }
  return result;
}
constexpr Series cosine_series = series(2);  // (1 - cos t) / t^2 in t^2
constexpr Series sine_series = series(3);    // (t - sin t) / t^3 in t^2

// An entire function and its derivatives at a number.
struct Entire {
  Pack at[derivatives];
};

inline Entire sum(const Series& series, const Pack& u) {
  Entire total{};
  for (std::size_t k = series_terms; k-- > 0;)
    for (std::size_t d = 0; d < derivatives; ++d)
      total.at[d] = total.at[d] * u + series.at[d][k];
  return total;
}

// The function's d-th derivative at u, from its derivatives at u's constant part: the fourth
// power of the rest is zero.
inline Curve at(const Entire& function, std::size_t d, const Curve& u) {
  Curve rest = u;
  rest.at[0][0] = Pack{};
  const Curve square = rest * rest, cube = square * rest;
  Curve value;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 2; ++j)
      value.at[i][j] = function.at[d + 1] * rest.at[i][j] +
                       function.at[d + 2] * (0.5 * square.at[i][j]) +
                       function.at[d + 3] * ((1.0 / 6.0) * cube.at[i][j]);
  value.at[0][0] += function.at[d];
  return value;
}

// A curve x(t) in the Lie algebra with what all functions of it share.
struct Turning {
  Vector<Curve> x;
  Curve square;
  Entire cosine, sine;

  explicit Turning(const Vector<Curve>& curve)
      : x(curve),
        square(dot(curve, curve)),
        cosine(sum(cosine_series, square.at[0][0])),
        sine(sum(sine_series, square.at[0][0])) {}
};

inline Matrix<Curve> right_jacobian(const Turning& turning) {
  const Vector<Curve>& x = turning.x;
  const Curve B = at(turning.cosine, 0, turning.square), C = at(turning.sine, 0, turning.square);
  const Curve diagonal = number<3>(1.0) - turning.square * C;
  const auto times_B = [&B](const Curve& entry) { return B * entry; };
  const auto times_C = [&C](const Curve& entry) { return C * entry; };
  const Vector<Curve> Bx = each(x, times_B), Cx = each(x, times_C);
  Matrix<Curve> J;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const Curve both = Cx.at[i] * x.at[j];
    J.at[i][i] = diagonal + Cx.at[i] * x.at[i];
    J.at[i][j] = both + Bx.at[k];
    J.at[j][i] = both - Bx.at[k];
  }
  return J;
}

// M(x; n), the symmetric part of the matrix of y, z -> n . (dJ(x) . y) z.
inline Matrix<Curve> bending(const Turning& turning, const Vector<Curve>& n) {
  const Vector<Curve>& x = turning.x;
  const Curve C = at(turning.sine, 0, turning.square), dB = at(turning.cosine, 1, turning.square),
              dC = at(turning.sine, 1, turning.square);
  const Curve along = dot(x, n), diagonal = C * along;
  const Curve by_n = -0.5 * C - turning.square * dC, by_x = dC * along;
  const Vector<Curve> across = cross(n, x);
  // M = x y^T + y x^T + diagonal
  Vector<Curve> y;
  for (std::size_t i = 0; i < 3; ++i)
    y.at[i] = by_n * n.at[i] - dB * across.at[i] + by_x * x.at[i];
  Matrix<Curve> M;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    M.at[i][i] = 2.0 * (x.at[i] * y.at[i]) + diagonal;
    M.at[i][j] = M.at[j][i] = x.at[i] * y.at[j] + y.at[i] * x.at[j];
  }
  return M;
}

}  // namespace
}  // namespace hovi::groups
