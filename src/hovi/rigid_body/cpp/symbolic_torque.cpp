#include <pinocchio/algorithm/rnea.hpp>

#include "symbolic_parts.hpp"

namespace hovi {

std::string SymbolicModel::inverse_dynamics() {
  auto& [model, data, q, v, a] = *parts_;
  pinocchio::rnea(model, data, to_eigen(q), to_eigen(v), to_eigen(a));
  return casadi::Function("inverse_dynamics", {q, v, a}, {to_casadi(data.tau)}, {"q", "v", "a"},
                          {"tau"})
      .serialize();
}

std::string SymbolicModel::generalized_gravity() {
  auto& [model, data, q, v, a] = *parts_;
  pinocchio::computeGeneralizedGravity(model, data, to_eigen(q));
  return casadi::Function("generalized_gravity", {q}, {to_casadi(data.g)}, {"q"}, {"g"})
      .serialize();
}

}  // namespace hovi
