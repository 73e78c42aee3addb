// Pinocchio's text archive of a model, as `model.saveToString()` writes it in Python.
#pragma once

#include <string>

#include <pinocchio/multibody.hpp>
#include <pinocchio/serialization.hpp>

namespace hovi {

// Takes a compiler 13 s: for one unit of a module alone.
inline pinocchio::Model read_archive(const std::string& archive) {
  pinocchio::Model model;
  model.loadFromString(archive);
  return model;
}

}  // namespace hovi
