// Declarations shared by the units that build expression graphs.
#pragma once

#include <pinocchio/autodiff/casadi.hpp>
#include <pinocchio/multibody.hpp>

#include "model.hpp"

namespace hovi::symbolic {

using casadi::SX;
using SymbolicVector = Eigen::Matrix<SX, Eigen::Dynamic, 1>;

struct SymbolicModel::Parts {
  pinocchio::ModelTpl<SX> model;
  pinocchio::DataTpl<SX> data;
  SX q, v, a;

  SX torque(const SX& velocity, const SX& acceleration);
  SX inertial_torque(const SX& acceleration);
  void place_joints();
};

inline SymbolicVector to_eigen(const SX& x) {
  SymbolicVector y(x.size1());
  for (Eigen::Index i = 0; i < y.size(); ++i) y[i] = x(i);
  return y;
}

template <typename Derived>
SX to_casadi(const Eigen::MatrixBase<Derived>& x) {
  SX y = SX::zeros(x.rows(), x.cols());
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    for (Eigen::Index j = 0; j < x.cols(); ++j) y(i, j) = x(i, j);
  return y;
}

}  // namespace hovi::symbolic
