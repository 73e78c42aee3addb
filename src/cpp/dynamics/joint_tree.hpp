// A robot as a tree of joints that turn about and slide along their z axis, with or without a base
// that moves: numbers only.
#pragma once

#include <vector>

#include "tree_view.hpp"

namespace hovi {

class JointTree {
 public:
  // nq, base, gravity: see TreeView.
  JointTree(std::vector<TreeJoint> joints, int nq, const TreeBase& base, const double* gravity);

  JointTree(JointTree&&) = default;
  JointTree(const JointTree&) = delete;

  TreeView view() const;

 private:
  using RunLists = std::vector<std::vector<Run>>;

  void relate();

  std::vector<TreeJoint> joints_;
  int nq_;
  TreeBase base_;
  double gravity_[6];
  std::vector<int> meeting_;
  RunLists related_runs_, carrier_runs_;
  std::vector<JointSet> related_, carriers_;  // views of these lists
};

}  // namespace hovi
