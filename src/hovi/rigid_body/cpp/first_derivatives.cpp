#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include "worker.hpp"

namespace hovi {

void Worker::torque() { pinocchio::rnea(model, data, q, v, a); }

void Worker::first_derivatives() { pinocchio::computeRNEADerivatives(model, data, q, v, a); }

}  // namespace hovi
