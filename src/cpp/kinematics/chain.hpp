// The joints that move a frame, one after the other: its pose and its Jacobian.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace hovi::kinematics {

// Rotation by columns, and translation [m].
struct Pose {
  double R[9];
  double p[3];
};

// Rotates about and translates along the z axis of its own frame.
struct ChainJoint {
  Pose placement;  // of this frame in that of the joint before, at q = 0
  double angular;  // angle about z per unit of q: 1, or 0 for a prismatic joint
  double linear;   // displacement along z per unit of q [m]
  double lower, upper;

  // Whether full turns lead to all of its configurations, so that no bound stops it on the way.
  bool turns_freely() const { return angular != 0 && linear == 0 && upper - lower >= 2 * M_PI; }
};

// z axis of a joint and its origin, in the world.
struct Axis {
  double z[3];
  double p[3];
};

inline void rotate(const double* R, const double* x, double* y) {
  for (int i = 0; i < 3; ++i) y[i] = R[i] * x[0] + R[3 + i] * x[1] + R[6 + i] * x[2];
}

// pose <- pose * by
inline void append(Pose& pose, const Pose& by) {
  Pose product;
  for (int j = 0; j < 3; ++j) rotate(pose.R, by.R + 3 * j, product.R + 3 * j);
  rotate(pose.R, by.p, product.p);
  for (int i = 0; i < 3; ++i) product.p[i] += pose.p[i];
  pose = product;
}

class Chain {
 public:
  Chain(std::vector<ChainJoint> joints, const Pose& tip)
      : joints_(std::move(joints)), tip_(tip) {}

  std::size_t size() const { return joints_.size(); }
  const ChainJoint& operator[](std::size_t k) const { return joints_[k]; }

  // The pose of the frame at q (n,), and the axes (n,) that the Jacobian is made of.
  Pose place(const double* q, Axis* axes) const {
    Pose pose{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const ChainJoint& joint = joints_[k];
      append(pose, joint.placement);
      for (int i = 0; i < 3; ++i) {
        axes[k].z[i] = pose.R[6 + i];
        axes[k].p[i] = pose.p[i];
        pose.p[i] += joint.linear * q[k] * pose.R[6 + i];
      }
      if (joint.angular != 0) turn(pose, joint.angular * q[k]);
    }
    append(pose, tip_);
    return pose;
  }

 private:
  static void turn(Pose& pose, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    for (int i = 0; i < 3; ++i) {
      const double x = pose.R[i], y = pose.R[3 + i];
      pose.R[i] = c * x + s * y;
      pose.R[3 + i] = c * y - s * x;
    }
  }

  std::vector<ChainJoint> joints_;
  Pose tip_;
};

}  // namespace hovi::kinematics
