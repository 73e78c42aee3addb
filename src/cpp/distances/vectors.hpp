// Vectors of space and poses. Everything is in an unnamed namespace: see simd/dispatch.hpp.
#pragma once

#include <cstddef>

namespace hovi::distances {
namespace {

struct Vector {
  double x, y, z;
};

inline Vector operator+(const Vector& a, const Vector& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vector operator-(const Vector& a, const Vector& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vector operator-(const Vector& a) { return {-a.x, -a.y, -a.z}; }
inline Vector operator*(double s, const Vector& a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector cross(const Vector& a, const Vector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vector& a) { return __builtin_sqrt(dot(a, a)); }
inline bool same(const Vector& a, const Vector& b) {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}
inline Vector vector_of(const double* x) { return {x[0], x[1], x[2]}; }

// Row-major.
struct Rotation {
  double m[9];
};

inline Vector operator*(const Rotation& R, const Vector& a) {
  const double* m = R.m;
  return {m[0] * a.x + m[1] * a.y + m[2] * a.z, m[3] * a.x + m[4] * a.y + m[5] * a.z,
          m[6] * a.x + m[7] * a.y + m[8] * a.z};
}
// R^T a.
inline Vector turned_back(const Rotation& R, const Vector& a) {
  const double* m = R.m;
  return {m[0] * a.x + m[3] * a.y + m[6] * a.z, m[1] * a.x + m[4] * a.y + m[7] * a.z,
          m[2] * a.x + m[5] * a.y + m[8] * a.z};
}
inline Rotation operator*(const Rotation& A, const Rotation& B) {
  Rotation C;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      C.m[3 * i + j] =
          A.m[3 * i] * B.m[j] + A.m[3 * i + 1] * B.m[3 + j] + A.m[3 * i + 2] * B.m[6 + j];
  return C;
}
inline Vector column(const Rotation& R, int k) { return {R.m[k], R.m[3 + k], R.m[6 + k]}; }
inline Rotation rotation_of(const double* m) {
  Rotation R;
  for (int i = 0; i < 9; ++i) R.m[i] = m[i];
  return R;
}

struct Pose {
  Rotation rotation;
  Vector translation;
};

inline Pose operator*(const Pose& a, const Pose& b) {
  return {a.rotation * b.rotation, a.translation + a.rotation * b.translation};
}
inline Vector operator*(const Pose& a, const Vector& x) { return a.translation + a.rotation * x; }

}  // namespace
}  // namespace hovi::distances
