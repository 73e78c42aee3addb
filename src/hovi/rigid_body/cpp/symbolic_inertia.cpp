#include <pinocchio/algorithm/crba.hpp>

#include "symbolic_parts.hpp"

namespace hovi {

std::string SymbolicModel::mass_matrix() {
  auto& [model, data, q, v, a] = *parts_;
  pinocchio::crba(model, data, to_eigen(q), pinocchio::Convention::WORLD);
  data.M.template triangularView<Eigen::StrictlyLower>() =
      data.M.transpose().template triangularView<Eigen::StrictlyLower>();
  return casadi::Function("mass_matrix", {q}, {to_casadi(data.M)}, {"q"}, {"M"}).serialize();
}

}  // namespace hovi
