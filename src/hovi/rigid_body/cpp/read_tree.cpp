#include "read_tree.hpp"

#include <algorithm>
#include <vector>

#include "archive.hpp"

namespace hovi {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A rotation that takes z to `axis`: a permutation when that is x, y or z.
Matrix3d frame_along(const Vector3d& axis) {
  Eigen::Index least;
  axis.cwiseAbs().minCoeff(&least);
  Matrix3d Q;
  Q.col(2) = axis;
  Q.col(0) = (Vector3d::Unit(least) - axis[least] * axis).normalized();
  Q.col(1) = Q.col(2).cross(Q.col(0));
  return Q;
}

void set_placement(const Matrix3d& rotation, const Vector3d& translation, TreeJoint& joint) {
  std::copy_n(rotation.data(), 9, joint.rotation);
  std::copy_n(translation.data(), 3, joint.translation);
}

void set_body(const pinocchio::Inertia& body, const Matrix3d& Q, TreeJoint& joint) {
  const Matrix3d inertia = body.inertia().matrix();
  const Matrix3d moment =
      Q.transpose() * (0.5 * inertia.trace() * Matrix3d::Identity() - inertia) * Q;
  const Vector3d center = Q.transpose() * body.lever();
  joint.mass = body.mass();
  std::copy_n(center.data(), 3, joint.center);
  const double upper[6] = {moment(0, 0), moment(0, 1), moment(0, 2),
                           moment(1, 1), moment(1, 2), moment(2, 2)};
  std::copy_n(upper, 6, joint.moment);
}

// The axes of a joint in its own frame, one column (linear, angular) for each coordinate.
Eigen::Matrix<double, 6, Eigen::Dynamic> axes(const pinocchio::JointModel& joint,
                                              const Eigen::VectorXd& q) {
  auto data = joint.createData();
  joint.calc(data, q);
  return data.S().matrix();
}

struct Frame {
  int joint;   // in the tree
  Matrix3d Q;  // from its axes to those of Pinocchio's frame
};

}  // namespace

JointTree read_tree(const std::string& archive) {
  const pinocchio::Model model = read_archive(archive);
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(model.nq);
  std::vector<Frame> frames{{-1, Matrix3d::Identity()}};
  std::vector<TreeJoint> joints;
  for (std::size_t i = 1; i < model.joints.size(); ++i) {
    Frame frame = frames[model.parents[i]];
    pinocchio::SE3 placement = model.jointPlacements[i];
    const auto S = axes(model.joints[i], q);
    for (Eigen::Index k = 0; k < S.cols(); ++k) {
      const Vector3d linear = S.col(k).head<3>(), angular = S.col(k).tail<3>();
      TreeJoint joint{};
      joint.parent = frame.joint;
      joint.turn = angular.isZero() ? 0 : 1;
      const Matrix3d Q = frame_along((joint.turn ? angular : linear).normalized());
      joint.slide = Q.col(2).dot(linear);
      set_placement(frame.Q.transpose() * placement.rotation() * Q,
                    frame.Q.transpose() * placement.translation(), joint);
      if (k + 1 == S.cols()) set_body(model.inertias[i], Q, joint);
      joint.armature = model.armature[model.joints[i].idx_v() + k];
      placement.setIdentity();
      frame = {static_cast<int>(joints.size()), Q};
      joints.push_back(joint);
    }
    frames.push_back(frame);
  }
  return {joints, model.gravity.toVector().data()};
}

}  // namespace hovi
