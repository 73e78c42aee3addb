// Poses of joints and shapes at a configuration, and the twists of all columns.
#pragma once

#include "kernels.hpp"
#include "vectors.hpp"

namespace hovi::distances {
namespace {

// A velocity field of space: v(x) = linear + angular x x.
struct Twist {
  Vector linear, angular;
  Vector at(const Vector& x) const { return linear + cross(angular, x); }
};

// Rotation about a unit vector, by its sine and cosine.
inline Rotation about(const Vector& u, double sine, double cosine) {
  const Vector w = (1.0 - cosine) * u, s = sine * u;
  return {{cosine + w.x * u.x, w.x * u.y - s.z, w.x * u.z + s.y,  //
           w.y * u.x + s.z, cosine + w.y * u.y, w.y * u.z - s.x,  //
           w.z * u.x - s.y, w.z * u.y + s.x, cosine + w.z * u.z}};
}

// Of a unit quaternion (x, y, z, w).
inline Rotation of_quaternion(const double* q) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),  //
           2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),  //
           2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
}

inline Pose displacement(const Joint& joint, const double* q) {
  const double* x = q + joint.coordinate;
  const Vector linear = vector_of(joint.axis), angular = vector_of(joint.axis + 3);
  const Vector z{0.0, 0.0, 1.0}, none{0.0, 0.0, 0.0};
  const Rotation unit = about(z, 0.0, 1.0);
  switch (joint.kind) {
    case JointKind::axis: {
      const double rate = length(angular);
      if (rate == 0.0) return {unit, x[0] * linear};
      const double angle = rate * x[0];
      return {about((1.0 / rate) * angular, __builtin_sin(angle), __builtin_cos(angle)),
              x[0] * linear};
    }
    case JointKind::continuous:
      return {about(angular, x[1], x[0]), none};
    case JointKind::floating:
      return {of_quaternion(x + 3), vector_of(x)};
    case JointKind::spherical:
      return {of_quaternion(x), none};
    case JointKind::planar:
      return {about(z, x[3], x[2]), {x[0], x[1], 0.0}};
  }
  return {unit, none};
}

// Twists of rotation about, and of translation along, an axis of a pose.
inline Twist turning(const Pose& pose, const Vector& axis) {
  const Vector angular = pose.rotation * axis;
  return {cross(pose.translation, angular), angular};
}
inline Twist sliding(const Pose& pose, const Vector& axis) {
  return {pose.rotation * axis, {0.0, 0.0, 0.0}};
}

inline void write_twists(const Joint& joint, const Pose& pose, Twist* twist) {
  twist += joint.column;
  const Vector linear = vector_of(joint.axis), angular = vector_of(joint.axis + 3);
  const Vector axes[] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
  if (joint.kind == JointKind::axis || joint.kind == JointKind::continuous) {
    *twist = turning(pose, angular);
    twist->linear = twist->linear + sliding(pose, linear).linear;
  } else if (joint.kind == JointKind::planar) {
    twist[0] = sliding(pose, axes[0]);
    twist[1] = sliding(pose, axes[1]);
    twist[2] = turning(pose, axes[2]);
  } else {
    if (joint.kind == JointKind::floating)
      for (const Vector& axis : axes) *twist++ = sliding(pose, axis);
    for (const Vector& axis : axes) *twist++ = turning(pose, axis);
  }
}

inline Pose fixed(const double* rotation, const double* translation) {
  return {rotation_of(rotation), vector_of(translation)};
}

inline void place_joints(const Model& model, const double* q, Pose* pose, Twist* twist) {
  for (std::size_t k = 0; k < model.joints; ++k) {
    const Joint& joint = model.joint[k];
    Pose at = fixed(joint.rotation, joint.translation);
    if (joint.parent >= 0) at = pose[joint.parent] * at;
    pose[k] = at * displacement(joint, q);
    write_twists(joint, pose[k], twist);
  }
}

inline void place_shapes(const Model& model, const Pose* joints, Pose* pose, Vector* center) {
  for (std::size_t k = 0; k < model.shapes; ++k) {
    const Shape& shape = model.shape[k];
    pose[k] = fixed(shape.rotation, shape.translation);
    if (shape.joint >= 0) pose[k] = joints[shape.joint] * pose[k];
    center[k] = pose[k] * vector_of(shape.center);
  }
}

}  // namespace
}  // namespace hovi::distances
