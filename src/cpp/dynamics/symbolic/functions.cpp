// Everything follows from RNEA, so that only one of Pinocchio's algorithms is compiled for
// expressions: each costs up to a minute.
#include <pinocchio/algorithm/rnea.hpp>

#include "parts.hpp"

namespace hovi::symbolic {

namespace {

SX vector_of_zeros(const SX& like) { return SX::zeros(like.size1()); }

}  // namespace

SX SymbolicModel::Parts::torque(const SX& velocity, const SX& acceleration) {
  return to_casadi(
      pinocchio::rnea(model, data, to_eigen(q), to_eigen(velocity), to_eigen(acceleration)));
}

// M a = rnea(q, 0, a) without gravity.
SX SymbolicModel::Parts::inertial_torque(const SX& acceleration) {
  const auto gravity = model.gravity;
  model.gravity.setZero();
  const SX tau = torque(vector_of_zeros(v), acceleration);
  model.gravity = gravity;
  return tau;
}

// RNEA leaves the placement of each joint relative to its parent in liMi.
void SymbolicModel::Parts::place_joints() {
  torque(vector_of_zeros(v), vector_of_zeros(a));
  for (std::size_t i = 1; i < data.oMi.size(); ++i)
    data.oMi[i] = data.oMi[model.parents[i]] * data.liMi[i];
}

std::string SymbolicModel::inverse_dynamics() {
  auto& p = *parts_;
  return casadi::Function("inverse_dynamics", {p.q, p.v, p.a}, {p.torque(p.v, p.a)},
                          {"q", "v", "a"}, {"tau"})
      .serialize();
}

std::string SymbolicModel::mass_matrix() {
  auto& p = *parts_;
  const SX M = SX::triu2symm(SX::triu(SX::jacobian(p.inertial_torque(p.a), p.a)));
  return casadi::Function("mass_matrix", {p.q}, {SX::densify(M)}, {"q"}, {"M"}).serialize();
}

std::string SymbolicModel::generalized_gravity() {
  auto& p = *parts_;
  const SX g = p.torque(vector_of_zeros(p.v), vector_of_zeros(p.a));
  return casadi::Function("generalized_gravity", {p.q}, {g}, {"q"}, {"g"}).serialize();
}

std::string SymbolicModel::kinetic_energy() {
  auto& p = *parts_;
  const SX energy = SX::dot(p.v, p.inertial_torque(p.v)) / 2;
  return casadi::Function("kinetic_energy", {p.q, p.v}, {energy}, {"q", "v"}, {"K"}).serialize();
}

std::string SymbolicModel::potential_energy() {
  auto& p = *parts_;
  p.place_joints();
  SX energy = 0;
  for (std::size_t i = 1; i < p.data.oMi.size(); ++i) {
    const auto& body = p.model.inertias[i];
    const auto center = to_casadi(p.data.oMi[i].act(body.lever()));
    energy -= body.mass() * SX::dot(to_casadi(p.model.gravity.linear()), center);
  }
  return casadi::Function("potential_energy", {p.q}, {energy}, {"q"}, {"V"}).serialize();
}

std::string SymbolicModel::frame_placement(std::size_t index) {
  auto& p = *parts_;
  p.place_joints();
  const auto& frame = p.model.frames.at(index);
  const auto placement = p.data.oMi[frame.parentJoint] * frame.placement;
  return casadi::Function("frame_placement", {p.q},
                          {to_casadi(placement.rotation()), to_casadi(placement.translation())},
                          {"q"}, {"R", "p"})
      .serialize();
}

}  // namespace hovi::symbolic
