// A robot whose scalars are CasADi expressions, and its algorithms as serialized functions.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

namespace hovi::symbolic {

class SymbolicModel {
 public:
  explicit SymbolicModel(const std::string& archive);
  ~SymbolicModel();

  std::string inverse_dynamics();
  std::string mass_matrix();
  std::string generalized_gravity();
  std::string kinetic_energy();
  std::string potential_energy();
  std::string frame_placement(std::size_t frame);

 private:
  struct Parts;  // defined in parts.hpp: keeps Pinocchio out of the binding's unit
  std::unique_ptr<Parts> parts_;
};

}  // namespace hovi::symbolic
