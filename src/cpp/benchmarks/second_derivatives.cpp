#include <pinocchio/algorithm/rnea-second-order-derivatives.hpp>

#include "pinocchio_calls.hpp"

namespace hovi::benchmarks {

void PinocchioCalls::second_derivatives() {
  for (auto* tensor : {&data.d2tau_dqdq, &data.d2tau_dvdv, &data.d2tau_dqdv, &data.d2tau_dadq})
    tensor->setZero();  // as Pinocchio's own overload does
  pinocchio::ComputeRNEASecondOrderDerivatives(model, data, q, v, a, data.d2tau_dqdq,
                                               data.d2tau_dvdv, data.d2tau_dqdv, data.d2tau_dadq);
}

}  // namespace hovi::benchmarks
