// Products of vectors, complex numbers and quaternions.
#pragma once

#include <cmath>

namespace hovi::groups {

constexpr double series_below = 1.0;  // angles squared for which closed forms lose digits

// Results may be arguments.
inline void cross(const double* x, const double* y, double* result) {
  const double z[] = {x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2],
                      x[0] * y[1] - x[1] * y[0]};
  for (int i = 0; i < 3; ++i) result[i] = z[i];
}

inline double dot(const double* x, const double* y, int size = 3) {
  double sum = 0.0;
  for (int i = 0; i < size; ++i) sum += x[i] * y[i];
  return sum;
}

// The product of complex numbers (real, imaginary): p turned by c.
inline void turn(const double* c, const double* p, double* result) {
  const double real = c[0] * p[0] - c[1] * p[1], imaginary = c[1] * p[0] + c[0] * p[1];
  result[0] = real, result[1] = imaginary;
}

inline void multiply(const double* p, const double* q, double* result) {
  double across[3];
  cross(p, q, across);
  const double real = p[3] * q[3] - dot(p, q);
  for (int i = 0; i < 3; ++i) result[i] = p[3] * q[i] + q[3] * p[i] + across[i];
  result[3] = real;
}

// x turned by a unit quaternion.
inline void rotate(const double* quaternion, const double* x, double* result) {
  double once[3], twice[3];
  cross(quaternion, x, once);
  cross(quaternion, once, twice);
  for (int i = 0; i < 3; ++i) result[i] = x[i] + 2.0 * (quaternion[3] * once[i] + twice[i]);
}

}  // namespace hovi::groups
