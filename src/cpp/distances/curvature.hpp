// First and second derivatives of a distance, where the nearest points lie on known features.
//
// With w(q, s) from a point of the first core to one of the second, where s are coordinates along
// the features (vertices, edges, faces, lateral surfaces) that the nearest points lie on, and
// n = w / d, the distance is the minimum over s of |w|, so that
//
//   d'  = n . w_q,
//   d'' = w_q^T (1 - n n^T) w_q / d + n . w_qq - B^T A^-1 B,
//   A   = w_s^T w_s / d + n . w_ss,   B = w_s^T w_q / d + n . w_sq.
#pragma once

#include "kernels.hpp"
#include "poses.hpp"
#include "simplex.hpp"
#include "vectors.hpp"

namespace hovi::distances {
namespace {

// Directions at most, along the features of both shapes.
constexpr std::size_t most_directions = 4;
// Squares of sines below which directions count as parallel; then A is singular.
constexpr double parallel = 1e-9;
// Share of a cylinder's size, or of a normal, below which a point is on its edge, or the normal is
// one of a cap or of the lateral surface.
constexpr double on_edge = 1e-6;

// Orthonormal directions of one shape's feature in the world, and n . (second derivative of the
// point) along each.
struct Feature {
  std::size_t size = 0;
  Vector direction[2];
  double bend[2];

  void add(const Vector& unit, double along_normal) {
    direction[size] = unit;
    bend[size++] = along_normal;
  }
};

// The affine hull of the points of a simplex, which is normal to n.
inline Feature feature_of_points(const Rotation& R, std::size_t count, const Vector* points,
                                 const Vector& n) {
  Feature feature;
  for (std::size_t i = 1; i < count && feature.size < 2; ++i) {
    const Vector edge = R * (points[i] - points[0]);
    Vector rest = edge - dot(edge, n) * n;
    for (std::size_t k = 0; k < feature.size; ++k)
      rest = rest - dot(rest, feature.direction[k]) * feature.direction[k];
    const double square = dot(rest, rest);
    if (square <= parallel * dot(edge, edge)) continue;
    feature.add((1.0 / __builtin_sqrt(square)) * rest, 0.0);
  }
  return feature;
}

// point: of a cylinder, in its frame.
inline Feature feature_of_cylinder(const Rotation& R, const Shape& shape, const Vector& point,
                                   const Vector& n) {
  Feature feature;
  const double r = shape.cylinder_radius, h = shape.half_length;
  const double across = __builtin_sqrt(point.x * point.x + point.y * point.y);
  const double height = point.z < 0.0 ? -point.z : point.z;
  const bool at_rim = across > (1.0 - on_edge) * r, at_cap = height > (1.0 - on_edge) * h;
  if (!at_rim) {
    feature.add(column(R, 0), 0.0);
    feature.add(column(R, 1), 0.0);
    return feature;
  }
  const Vector outward{point.x / across, point.y / across, 0.0};
  feature.add(R * Vector{-outward.y, outward.x, 0.0}, -dot(n, R * outward) / r);
  if (!at_cap) feature.add(column(R, 2), 0.0);
  return feature;
}

inline Feature feature_of(const Rotation& R, const Shape& shape, std::size_t count,
                          const Vector* points, const Vector& nearest, const Vector& n) {
  if (shape.kind == ShapeKind::cylinder) return feature_of_cylinder(R, shape, nearest, n);
  return feature_of_points(R, count, points, n);
}

// Moves a point of a cylinder, in its frame, to the surface that the outward normal suggests.
inline Vector on_surface(const Shape& shape, const Vector& point, const Vector& normal) {
  constexpr double near = 1e-3;
  const double r = shape.cylinder_radius, h = shape.half_length;
  const double across = __builtin_sqrt(point.x * point.x + point.y * point.y);
  const double slope = __builtin_sqrt(normal.x * normal.x + normal.y * normal.y);
  const double up = normal.z < 0.0 ? -normal.z : normal.z;
  const double height = point.z < 0.0 ? -point.z : point.z;
  const bool cap = slope < near && across < (1.0 - near) * r;
  const bool lateral = up < near && height < (1.0 - near) * h;
  Vector moved = point;
  if (!cap && across > 0.0) moved.x *= r / across, moved.y *= r / across;
  if (!lateral) moved.z = point.z < 0.0 ? -h : h;
  return moved;
}

// A point of a feature, in its shape's frame, moved by distances along the directions.
inline Vector moved_along(const Rotation& R, const Shape& shape, const Feature& feature,
                          const double* distances, const Vector& point) {
  Vector moved = point;
  for (std::size_t i = 0; i < feature.size; ++i) {
    if (feature.bend[i] == 0.0 || shape.kind != ShapeKind::cylinder) {
      moved = moved + distances[i] * turned_back(R, feature.direction[i]);
      continue;
    }
    const double angle = distances[i] / shape.cylinder_radius;
    const double c = __builtin_cos(angle), s = __builtin_sin(angle);
    moved = {c * moved.x - s * moved.y, s * moved.x + c * moved.y, moved.z};
  }
  return moved;
}

// Solves A X = B in place, A symmetric and positive semidefinite (k, k), B (k, c); directions in
// which A is singular are left out.
inline void solve(std::size_t k, double (*A)[most_directions], double* B, std::size_t c) {
  double largest = 0.0;
  for (std::size_t i = 0; i < k; ++i)
    if (A[i][i] > largest) largest = A[i][i];
  bool used[most_directions];
  for (std::size_t i = 0; i < k; ++i) {
    used[i] = A[i][i] > 1e-6 * largest;
    if (!used[i]) continue;
    for (std::size_t j = i + 1; j < k; ++j) {
      const double share = A[j][i] / A[i][i];
      for (std::size_t l = i + 1; l <= j; ++l) A[j][l] -= share * A[l][i];
      for (std::size_t l = 0; l < c; ++l) B[j * c + l] -= share * B[i * c + l];
    }
  }
  for (std::size_t i = k; i-- > 0;) {
    for (std::size_t l = 0; l < c; ++l) {
      double rest = B[i * c + l];
      for (std::size_t j = i + 1; j < k; ++j) rest -= A[j][i] * B[j * c + l];
      B[i * c + l] = used[i] ? rest / A[i][i] : 0.0;
    }
  }
}

// A symmetric matrix (2, 2).
struct Plane {
  double xx = 0.0, xy = 0.0, yy = 0.0;

  void add(double weight, double x, double y) {
    xx += weight * x * x;
    xy += weight * x * y;
    yy += weight * y * y;
  }
};

// The nearest points of two cores and the features that they lie on.
// own_first, own_second: the points in their shapes' frames; first, second: in the world.
// n: the normal from the first core to the second. distance: of the cores, negative where they
// overlap.
struct Contact {
  Vector own_first, own_second, first, second, n;
  double distance;
  Feature at_first, at_second;
  const PairColumn* column;
  std::size_t columns;
  const Twist* twist;
  // Of rounded shapes: see rounding.hpp.
  bool rounded;
  double apart;
  Vector tangent[2];
  Plane bend[2];
};

// The velocity of w in each column.
inline void write_velocities(const Contact& c, Vector* velocity) {
  for (std::size_t i = 0; i < c.columns; ++i) {
    const Twist& twist = c.twist[c.column[i].column];
    velocity[i] = c.column[i].second ? twist.at(c.second) : -twist.at(c.first);
  }
}

// n . w_qq, for columns i <= j: the later joint's velocity turns with the earlier joint.
inline double bending(const Contact& c, const Vector* velocity, std::size_t i, std::size_t j) {
  const PairColumn &a = c.column[i], &b = c.column[j];
  if (a.second != b.second) return 0.0;
  const double first = dot(c.n, cross(c.twist[a.column].angular, velocity[j]));
  if (a.joint != b.joint) return first;
  return 0.5 * (first + dot(c.n, cross(c.twist[b.column].angular, velocity[i])));
}

// w_s and A.
inline void write_system(const Contact& c, Vector* along, double (*A)[most_directions]) {
  const std::size_t first = c.at_first.size, k = first + c.at_second.size;
  const double inverse = 1.0 / c.distance;
  for (std::size_t i = 0; i < k; ++i)
    along[i] = i < first ? -c.at_first.direction[i] : c.at_second.direction[i - first];
  for (std::size_t i = 0; i < k; ++i)
    for (std::size_t j = 0; j <= i; ++j) A[i][j] = inverse * dot(along[i], along[j]);
  for (std::size_t i = 0; i < k; ++i)
    A[i][i] += i < first ? -c.at_first.bend[i] : c.at_second.bend[i - first];
}

// Adds force d'' to a matrix (nv, nv). work: most_directions x columns.
inline void add_curvature(const Contact& c, const Vector* velocity, double force, std::size_t nv,
                          double* work, double* curvature) {
  const std::size_t m = c.columns, first = c.at_first.size, k = first + c.at_second.size;
  const double inverse = 1.0 / c.distance;
  Vector along[most_directions];
  double A[most_directions][most_directions];
  write_system(c, along, A);
  const double sign = c.distance < 0.0 ? -1.0 : 1.0;  // A is negative where cores overlap
  for (std::size_t i = 0; i < k; ++i)
    for (std::size_t j = 0; j <= i; ++j) A[i][j] *= sign;
  double* const B = work;
  double* const X = work + most_directions * m;
  for (std::size_t i = 0; i < k; ++i)
    for (std::size_t j = 0; j < m; ++j) {
      double value = inverse * dot(along[i], velocity[j]);
      if (c.column[j].second == (i >= first))
        value += dot(c.n, cross(c.twist[c.column[j].column].angular, along[i]));
      B[i * m + j] = value;
      X[i * m + j] = sign * value;
    }
  solve(k, A, X, m);
  for (std::size_t i = 0; i < m; ++i) {
    const Vector across = velocity[i] - dot(c.n, velocity[i]) * c.n;
    for (std::size_t j = i; j < m; ++j) {
      double value = inverse * dot(across, velocity[j]) + bending(c, velocity, i, j);
      for (std::size_t l = 0; l < k; ++l) value -= B[l * m + i] * X[l * m + j];
      const std::size_t row = c.column[i].column, other = c.column[j].column;
      curvature[row * nv + other] += force * value;
      if (i != j) curvature[other * nv + row] += force * value;
    }
  }
}

}  // namespace
}  // namespace hovi::distances
