#include "archive.hpp"

#include <pinocchio/serialization.hpp>

namespace hovi {

pinocchio::Model read_archive(const std::string& archive) {
  pinocchio::Model model;
  model.loadFromString(archive);
  return model;
}

}  // namespace hovi
