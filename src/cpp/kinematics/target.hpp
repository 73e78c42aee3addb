// What a frame is to meet, how far it is from there, and how the joints move it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "chain.hpp"

namespace hovi::kinematics {

constexpr int max_rows = 6;

inline double dot(const double* a, const double* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline void cross(const double* a, const double* b, double* c) {
  c[0] = a[1] * b[2] - a[2] * b[1];
  c[1] = a[2] * b[0] - a[0] * b[2];
  c[2] = a[0] * b[1] - a[1] * b[0];
}

// The rotation vector, in the world, that turns R into target, both by columns.
inline double rotation_vector(const double* R, const double* target, double* vector) {
  double sine[3] = {0, 0, 0}, cosine = -1;
  for (int j = 0; j < 3; ++j) {
    double column[3];
    cross(R + 3 * j, target + 3 * j, column);
    for (int i = 0; i < 3; ++i) sine[i] += 0.5 * column[i];
    cosine += dot(R + 3 * j, target + 3 * j);
  }
  cosine *= 0.5;
  const double length = std::sqrt(dot(sine, sine)), angle = std::atan2(length, cosine);
  if (length > 1e-7 || cosine > 0) {
    const double scale = length > 1e-7 ? angle / length : 1.0;
    for (int i = 0; i < 3; ++i) vector[i] = scale * sine[i];
    return angle;
  }
  // Half a turn about u: target R^T = 2 u u^T - 1, whose largest column lies along u.
  double best = -1;
  for (int k = 0; k < 3; ++k) {
    double column[3] = {0, 0, 0};
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) column[i] += target[3 * j + i] * R[3 * j + k];
    column[k] += 1;
    const double size = std::sqrt(dot(column, column));
    if (!(size > best)) continue;
    best = size;
    for (int i = 0; i < 3; ++i) vector[i] = angle * column[i] / size;
  }
  return angle;
}

// The rotation vector of the shortest turn from one direction to another.
inline double turn_between(const double* from, const double* to, double* vector) {
  cross(from, to, vector);
  const double sine = std::sqrt(dot(vector, vector)), cosine = dot(from, to);
  const double angle = std::atan2(sine, cosine);
  if (sine > 1e-9 || cosine > 0) {
    const double scale = sine > 1e-9 ? angle / sine : 1.0;
    for (int i = 0; i < 3; ++i) vector[i] *= scale;
    return angle;
  }
  const double aside[3] = {std::fabs(to[0]) < 0.5 ? 1.0 : 0.0, std::fabs(to[0]) < 0.5 ? 0.0 : 1.0,
                           0.0};
  cross(to, aside, vector);
  const double size = std::sqrt(dot(vector, vector));
  for (int i = 0; i < 3; ++i) vector[i] *= angle / size;
  return angle;
}

struct Target {
  bool has_position, has_rotation, has_axis;
  Pose pose;         // position and rotation, where there are any
  double inner[3];   // a direction in the frame,
  double world[3];   // and where it points
  double across[6];  // two directions orthogonal to that
  double weight;     // [1/m]: of a position against angles

  int rows() const { return 3 * has_position + 3 * has_rotation + 2 * has_axis; }
};

struct Miss {
  double rows[max_rows];  // the motion of the frame that leads to the target, weighted
  double distance, angle;  // [m], [rad]
  double square;           // of the rows
};

inline Miss miss_of(const Target& target, const Pose& pose) {
  Miss miss{};
  double* row = miss.rows;
  if (target.has_position) {
    for (int i = 0; i < 3; ++i) row[i] = target.pose.p[i] - pose.p[i];
    miss.distance = std::sqrt(dot(row, row));
    for (int i = 0; i < 3; ++i) row[i] *= target.weight;
    row += 3;
  }
  if (target.has_rotation) miss.angle = rotation_vector(pose.R, target.pose.R, row);
  if (target.has_axis) {
    double now[3], vector[3];
    rotate(pose.R, target.inner, now);
    miss.angle = turn_between(now, target.world, vector);
    for (int i = 0; i < 2; ++i) row[i] = dot(target.across + 3 * i, vector);
  }
  for (double x : miss.rows) miss.square += x * x;
  return miss;
}

// Columns (n, max_rows) of the Jacobian of the frame's motion, weighted as the rows of a Miss.
inline void slopes(const Target& target, const Chain& chain, const Pose& pose, const Axis* axes,
                   double* columns) {
  for (std::size_t k = 0; k < chain.size(); ++k) {
    double* row = columns + max_rows * k;
    const double angular = chain[k].angular, linear = chain[k].linear;
    const double* z = axes[k].z;
    if (target.has_position) {
      double arm[3], swept[3];
      for (int i = 0; i < 3; ++i) arm[i] = pose.p[i] - axes[k].p[i];
      cross(z, arm, swept);
      for (int i = 0; i < 3; ++i) row[i] = target.weight * (angular * swept[i] + linear * z[i]);
      row += 3;
    }
    if (target.has_rotation)
      for (int i = 0; i < 3; ++i) row[i] = angular * z[i];
    if (target.has_axis)
      for (int i = 0; i < 2; ++i) row[i] = angular * dot(target.across + 3 * i, z);
  }
}

}  // namespace hovi::kinematics
