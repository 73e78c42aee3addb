#include <pinocchio/algorithm/rnea-derivatives.hpp>

#include "pinocchio_calls.hpp"

namespace hovi::benchmarks {

void PinocchioCalls::first_derivatives() {
  pinocchio::computeRNEADerivatives(model, data, q, v, a);
}

}  // namespace hovi::benchmarks
