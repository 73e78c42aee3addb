// A robot as a tree of joints that turn about and slide along their z axis: numbers only.
#pragma once

#include <vector>

#include "tree_view.hpp"

namespace hovi {

class JointTree {
 public:
  // gravity: the spatial acceleration of free fall, linear then angular part.
  JointTree(std::vector<TreeJoint> joints, const double* gravity);

  TreeView view() const;

 private:
  void relate();

  std::vector<TreeJoint> joints_;
  double gravity_[6];
  std::vector<int> meeting_, related_, related_count_, carriers_, carrier_count_;
};

}  // namespace hovi
