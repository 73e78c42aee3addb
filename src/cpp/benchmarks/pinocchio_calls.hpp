// Pinocchio's own derivatives of RNEA, with which the kernel's time is compared.
#pragma once

#include <pinocchio/multibody.hpp>

namespace hovi::benchmarks {

struct PinocchioCalls {
  explicit PinocchioCalls(const pinocchio::Model& model);

  void first_derivatives();
  void second_derivatives();

  const pinocchio::Model& model;
  pinocchio::Data data;
  Eigen::VectorXd q, v, a;
};

}  // namespace hovi::benchmarks
