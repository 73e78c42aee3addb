// What one thread works with: Pinocchio's data and room for one point, allocated once.
#pragma once

#include <pinocchio/multibody.hpp>

namespace hovi {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Tiles of 4 x 4: the columns of J are padded with zeros to a multiple of it.
constexpr Eigen::Index tile = 4;

struct Worker {
  explicit Worker(const pinocchio::Model& model);

  // Aligned copies: with the caller's alignment Eigen would round differently from point to point.
  void read_point(const double* q, const double* v, const double* a);

  // Each of these runs Pinocchio at the point that was read.
  void torque();
  void first_derivatives();   // tau, dtau_dq, dtau_dv and the upper triangle of M
  void second_derivatives();  // the four tensors d2tau_*

  const pinocchio::Model& model;
  pinocchio::Data data;
  Eigen::VectorXd q, v, a, curvature;
  RowMatrix J, weighted_J;  // (n, 3n padded), columns dq | dv | da
  RowMatrix H;              // (3n padded, 3n padded)
  Eigen::VectorXd curved_qq, curved_vv, curved_qv, curved_aq;  // (n * n,) each
};

}  // namespace hovi
