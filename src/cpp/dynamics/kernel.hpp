// Inverse dynamics in doubles over a batch of points, with analytic first and second derivatives.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "points.hpp"

namespace hovi {

class InverseDynamicsKernel {
 public:
  // portable: not to use the processor's larger vectors.
  explicit InverseDynamicsKernel(const std::string& archive, bool portable = false);
  ~InverseDynamicsKernel();

  std::size_t nq() const;  // numbers in a configuration
  std::size_t n() const;   // degrees of freedom

  // Computes what is not null in `out`.
  void expand(Points points, Multipliers multipliers, Expansion out, int threads);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

// Seconds per point of Pinocchio's own computeRNEADerivatives and
// ComputeRNEASecondOrderDerivatives: the yardstick for expand.
double time_pinocchio_calls(const std::string& archive, Points points, int repeats);

}  // namespace hovi
