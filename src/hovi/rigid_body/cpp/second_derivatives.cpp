#include <pinocchio/algorithm/rnea-second-order-derivatives.hpp>

#include "worker.hpp"

namespace hovi {

// The tensors' zeros are those of the kinematic tree: set once, when data was made.
void Worker::second_derivatives() {
  pinocchio::ComputeRNEASecondOrderDerivatives(model, data, q, v, a, data.d2tau_dqdq,
                                               data.d2tau_dvdv, data.d2tau_dqdv, data.d2tau_dadq);
}

}  // namespace hovi
