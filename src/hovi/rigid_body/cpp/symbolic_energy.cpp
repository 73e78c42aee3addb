#include <pinocchio/algorithm/energy.hpp>
#include <pinocchio/algorithm/frames.hpp>

#include "symbolic_parts.hpp"

namespace hovi {

std::string SymbolicModel::kinetic_energy() {
  auto& [model, data, q, v, a] = *parts_;
  const SX energy = pinocchio::computeKineticEnergy(model, data, to_eigen(q), to_eigen(v));
  return casadi::Function("kinetic_energy", {q, v}, {energy}, {"q", "v"}, {"K"}).serialize();
}

std::string SymbolicModel::potential_energy() {
  auto& [model, data, q, v, a] = *parts_;
  const SX energy = pinocchio::computePotentialEnergy(model, data, to_eigen(q));
  return casadi::Function("potential_energy", {q}, {energy}, {"q"}, {"V"}).serialize();
}

std::string SymbolicModel::frame_placement(std::size_t frame) {
  auto& [model, data, q, v, a] = *parts_;
  pinocchio::forwardKinematics(model, data, to_eigen(q));
  const auto& placement = pinocchio::updateFramePlacement(model, data, frame);
  return casadi::Function("frame_placement", {q},
                          {to_casadi(placement.rotation()), to_casadi(placement.translation())},
                          {"q"}, {"R", "p"})
      .serialize();
}

}  // namespace hovi
