// A robot as a tree of joints that rotate about and translate along their z axis, with or without a
// base that moves: numbers only.
#pragma once

#include <vector>

#include "tree_view.hpp"

namespace hovi::dynamics {

class JointTree {
 public:
  // nq, base, gravity: see TreeView. Throws std::invalid_argument if the joints are not a
  // tree, or would make a kernel read or write out of bounds.
  JointTree(std::vector<TreeJoint> joints, int nq, const TreeBase& base, const double* gravity);

  JointTree(JointTree&&) = default;
  JointTree(const JointTree&) = delete;

  TreeView view() const;

 private:
  using RunLists = std::vector<std::vector<Run>>;

  void check() const;
  void check_base() const;
  void add_subtree_masses();
  void relate();
  void list_relatives();

  std::vector<TreeJoint> joints_;
  int nq_;
  TreeBase base_;
  double gravity_[6];
  std::vector<int> common_ancestor_;
  RunLists relative_runs_, ancestor_runs_;
  std::vector<JointSet> relatives_, ancestors_;  // views of these lists
};

}  // namespace hovi::dynamics
