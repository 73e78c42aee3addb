// Pinocchio's model as a tree of joints that turn about and slide along their z axis.
#pragma once

#include <string>

#include "joint_tree.hpp"

namespace hovi {

// Every joint's axes must be fixed in its frame; a joint of several coordinates becomes as many. A
// first joint that moves on SE(3), SO(3) or SE(2) is a base, which must carry all others.
JointTree read_tree(const std::string& archive);

}  // namespace hovi
