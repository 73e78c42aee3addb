#include "read_tree.hpp"

#include <algorithm>
#include <string>
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

bool continuous(const pinocchio::JointModel& joint) { return joint.nq() == 2 && joint.nv() == 1; }

TreeBase read_base(const pinocchio::Model& model) {
  const std::string kind = model.njoints > 1 ? model.joints[1].shortname() : "";
  if (kind == "JointModelFreeFlyer") return {6, {0, 1, 2, 3, 4, 5}, 3, false};
  if (kind == "JointModelSpherical") return {3, {3, 4, 5}, 0, false};
  if (kind == "JointModelPlanar") return {3, {0, 1, 5}, 2, true};
  return {};
}

struct Frame {
  int joint;   // in the tree
  Matrix3d Q;  // from its axes to those of Pinocchio's frame
};

// The components of a base's velocity; the last of them bears the body. Returns where that is.
Frame add_base(const pinocchio::Model& model, int size, std::vector<TreeJoint>& joints) {
  for (int k = 0; k < size; ++k) {
    TreeJoint joint{};
    joint.parent = k - 1;
    joint.armature = model.armature[k];
    if (k + 1 == size) set_body(model.inertias[1], Matrix3d::Identity(), joint);
    joints.push_back(joint);
  }
  return {size - 1, Matrix3d::Identity()};
}

}  // namespace

JointTree read_tree(const std::string& archive) {
  const pinocchio::Model model = read_archive(archive);
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(model.nq);
  std::vector<Frame> frames{{-1, Matrix3d::Identity()}};
  std::vector<TreeJoint> joints;
  const TreeBase base = read_base(model);
  pinocchio::Motion gravity = model.gravity;
  if (base.size > 0) {
    gravity = model.jointPlacements[1].actInv(gravity);
    frames.push_back(add_base(model, base.size, joints));
  }
  for (std::size_t i = frames.size(); i < model.joints.size(); ++i) {
    Frame frame = frames[model.parents[i]];
    pinocchio::SE3 placement = model.jointPlacements[i];
    const auto S = axes(model.joints[i], q);
    for (Eigen::Index k = 0; k < S.cols(); ++k) {
      const Vector3d linear = S.col(k).head<3>(), angular = S.col(k).tail<3>();
      TreeJoint joint{};
      joint.parent = frame.joint;
      joint.q = model.joints[i].idx_q() + static_cast<int>(k);
      joint.continuous = continuous(model.joints[i]);
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
  return {joints, model.nq, base, gravity.toVector().data()};
}

}  // namespace hovi
