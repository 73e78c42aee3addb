// Inverse dynamics in doubles over a batch of points, with analytic first and second derivatives.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

namespace hovi {

// A batch of points; each array is row-major, shape (count, n).
struct Points {
  std::size_t count;
  const double* q;
  const double* v;
  const double* a;
};

// Row-major: tau (count, n), jacobian (count, n, 3n), hessian (count, 3n, 3n).
// What is null is not computed.
struct Expansion {
  double* tau;
  double* jacobian = nullptr;
  double* hessian = nullptr;
};

class InverseDynamicsKernel {
 public:
  explicit InverseDynamicsKernel(const std::string& archive);
  ~InverseDynamicsKernel();

  std::size_t dof() const;

  void torque(Points points, Expansion out, int threads);
  void linearize(Points points, Expansion out, int threads);

  // hessian = J^T diag(weight) J + sum_i curvature_i d2tau_i at each point, with weight and
  // curvature (count, n), the latter null for none.
  void expand(Points points, const double* weight, const double* curvature, Expansion out,
              int threads);

  // Seconds per point of Pinocchio's own computeRNEADerivatives and
  // ComputeRNEASecondOrderDerivatives: the yardstick for expand.
  double time_pinocchio_calls(Points points, int repeats);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace hovi
