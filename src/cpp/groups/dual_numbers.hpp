// Truncated polynomials in t and e, with e^2 = 0, over packs of numbers; vectors and matrices of
// them.
//
// Powers of t hold derivatives along a curve: the coefficient of t^i is the i-th derivative over
// i!. The part in e makes a rotation a rigid motion: with turn w and translation v, w + e v obeys
// the rules of SO(3), and SE(3) is SO(3) over these numbers [Study1903].
#pragma once

#include "simd/pack.hpp"

namespace hovi::groups {
namespace {

// sum of at[i][j] t^i e^j with t^orders = 0.
template <std::size_t orders>
struct Truncated {
  Pack at[orders][2];
};
using Dual = Truncated<1>;
using Curve = Truncated<3>;  // a number along a curve, with its first and second rate

template <typename Number>
struct Vector {
  Number at[3];
};
template <typename Number>
struct Matrix {
  Number at[3][3];
};

template <std::size_t orders>
inline Truncated<orders> operator+(const Truncated<orders>& x, const Truncated<orders>& y) {
  Truncated<orders> sum;
  for (std::size_t i = 0; i < orders; ++i)
    for (std::size_t j = 0; j < 2; ++j) sum.at[i][j] = x.at[i][j] + y.at[i][j];
  return sum;
}

template <std::size_t orders>
inline Truncated<orders> operator*(double factor, const Truncated<orders>& x) {
  Truncated<orders> multiple;
  for (std::size_t i = 0; i < orders; ++i)
    for (std::size_t j = 0; j < 2; ++j) multiple.at[i][j] = factor * x.at[i][j];
  return multiple;
}

template <std::size_t orders>
inline Truncated<orders> operator-(const Truncated<orders>& x, const Truncated<orders>& y) {
  Truncated<orders> difference;
  for (std::size_t i = 0; i < orders; ++i)
    for (std::size_t j = 0; j < 2; ++j) difference.at[i][j] = x.at[i][j] - y.at[i][j];
  return difference;
}

template <std::size_t orders>
inline Truncated<orders> operator*(const Truncated<orders>& x, const Truncated<orders>& y) {
  Truncated<orders> product{};
  for (std::size_t i = 0; i < orders; ++i)
    for (std::size_t k = 0; i + k < orders; ++k) {
      product.at[i + k][0] += x.at[i][0] * y.at[k][0];
      product.at[i + k][1] += x.at[i][0] * y.at[k][1] + x.at[i][1] * y.at[k][0];
    }
  return product;
}

template <std::size_t orders>
inline Truncated<orders> number(double x) {
  Truncated<orders> constant{};
  constant.at[0][0] += x;
  return constant;
}

// The first `kept` powers of t from t^first on.
template <std::size_t kept, std::size_t orders>
inline Truncated<kept> powers(const Truncated<orders>& x, std::size_t first = 0) {
  Truncated<kept> part;
  for (std::size_t i = 0; i < kept; ++i)
    for (std::size_t j = 0; j < 2; ++j) part.at[i][j] = x.at[first + i][j];
  return part;
}

// d/dt.
inline Truncated<2> rate(const Curve& x) {
  return {{{x.at[1][0], x.at[1][1]}, {2.0 * x.at[2][0], 2.0 * x.at[2][1]}}};
}

// The same operation on every entry.
template <typename Number, typename Operation>
inline auto each(const Vector<Number>& x, const Operation& operation) {
  return Vector<decltype(operation(x.at[0]))>{
      {operation(x.at[0]), operation(x.at[1]), operation(x.at[2])}};
}
template <typename Number, typename Operation>
inline auto each(const Matrix<Number>& x, const Operation& operation) {
  Matrix<decltype(operation(x.at[0][0]))> result;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) result.at[i][j] = operation(x.at[i][j]);
  return result;
}

template <typename Number>
inline Vector<Number> operator+(const Vector<Number>& x, const Vector<Number>& y) {
  return {{x.at[0] + y.at[0], x.at[1] + y.at[1], x.at[2] + y.at[2]}};
}
template <typename Number>
inline Vector<Number> operator-(const Vector<Number>& x, const Vector<Number>& y) {
  return {{x.at[0] - y.at[0], x.at[1] - y.at[1], x.at[2] - y.at[2]}};
}
template <typename Number>
inline Number dot(const Vector<Number>& x, const Vector<Number>& y) {
  return x.at[0] * y.at[0] + x.at[1] * y.at[1] + x.at[2] * y.at[2];
}
template <typename Number>
inline Vector<Number> cross(const Vector<Number>& x, const Vector<Number>& y) {
  return {{x.at[1] * y.at[2] - x.at[2] * y.at[1], x.at[2] * y.at[0] - x.at[0] * y.at[2],
           x.at[0] * y.at[1] - x.at[1] * y.at[0]}};
}

template <typename Number>
inline Matrix<Number> operator+(const Matrix<Number>& x, const Matrix<Number>& y) {
  Matrix<Number> sum;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) sum.at[i][j] = x.at[i][j] + y.at[i][j];
  return sum;
}
template <typename Number>
inline Matrix<Number> operator*(double factor, const Matrix<Number>& x) {
  return each(x, [factor](const Number& entry) { return factor * entry; });
}
template <typename Number>
inline Matrix<Number> operator*(const Matrix<Number>& x, const Matrix<Number>& y) {
  Matrix<Number> product;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      product.at[i][j] =
          x.at[i][0] * y.at[0][j] + x.at[i][1] * y.at[1][j] + x.at[i][2] * y.at[2][j];
  return product;
}
template <typename Number>
inline Vector<Number> operator*(const Matrix<Number>& x, const Vector<Number>& y) {
  Vector<Number> product;
  for (std::size_t i = 0; i < 3; ++i)
    product.at[i] = x.at[i][0] * y.at[0] + x.at[i][1] * y.at[1] + x.at[i][2] * y.at[2];
  return product;
}
template <typename Number>
inline Matrix<Number> transposed(const Matrix<Number>& x) {
  Matrix<Number> result;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) result.at[i][j] = x.at[j][i];
  return result;
}

// The matrix with the columns x * y.
template <typename Number>
inline Matrix<Number> cross(const Vector<Number>& x, const Matrix<Number>& y) {
  Matrix<Number> result;
  for (std::size_t j = 0; j < 3; ++j) {
    const Vector<Number> column =
        cross(x, Vector<Number>{{y.at[0][j], y.at[1][j], y.at[2][j]}});
    for (std::size_t i = 0; i < 3; ++i) result.at[i][j] = column.at[i];
  }
  return result;
}

inline Matrix<Dual> identity() {
  const Dual one = number<1>(1.0), zero{};
  return {{{one, zero, zero}, {zero, one, zero}, {zero, zero, one}}};
}

// The inverse, by cofactors and (A + e B)^-1 = A^-1 - e A^-1 B A^-1.
inline Matrix<Dual> inverse(const Matrix<Dual>& x) {
  const auto row = [&x](std::size_t i) {
    return Vector<Dual>{{x.at[i][0], x.at[i][1], x.at[i][2]}};
  };
  const Vector<Dual> columns[] = {cross(row(1), row(2)), cross(row(2), row(0)),
                                  cross(row(0), row(1))};
  const Dual determinant = dot(row(0), columns[0]);
  const Pack over = 1.0 / determinant.at[0][0];
  const Dual factor{{{over, -over * over * determinant.at[0][1]}}};
  Matrix<Dual> result;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) result.at[i][j] = factor * columns[j].at[i];
  return result;
}

}  // namespace
}  // namespace hovi::groups
