// Pinocchio's text archive of a model, as `model.saveToString()` writes it in Python.
#pragma once

#include <string>

#include <pinocchio/multibody.hpp>

namespace hovi {

pinocchio::Model read_archive(const std::string& archive);

}  // namespace hovi
