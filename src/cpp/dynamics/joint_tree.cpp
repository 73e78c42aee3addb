#include "joint_tree.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace hovi::dynamics {

namespace {

constexpr std::size_t max_joints = 10000;  // so that the number of entries of J fits an int

void require(bool holds, const std::string& expected) {
  if (!holds) throw std::invalid_argument("joint tree: " + expected + ".");
}

std::string joint_name(std::size_t k) { return "joint " + std::to_string(k); }

void append(std::vector<Run>& runs, int joint) {
  if (runs.empty() || runs.back().end != joint) runs.push_back({joint, joint});
  ++runs.back().end;
}

std::vector<JointSet> sets(const std::vector<std::vector<Run>>& lists) {
  std::vector<JointSet> sets;
  for (const auto& runs : lists) sets.push_back({runs.data(), static_cast<int>(runs.size())});
  return sets;
}

}  // namespace

JointTree::JointTree(std::vector<TreeJoint> joints, int nq, const TreeBase& base,
                     const double* gravity)
    : joints_(std::move(joints)), nq_(nq), base_(base) {
  std::copy_n(gravity, 6, gravity_);
  check();
  check_base();
  add_subtree_masses();
  relate();
  list_relatives();
}

void JointTree::check() const {
  require(joints_.size() <= max_joints, "at most " + std::to_string(max_joints) + " joints");
  const int n = static_cast<int>(joints_.size());
  require(0 <= nq_ && nq_ <= 2 * n, "a joint has one or two numbers in a configuration");
  for (int k = 0; k < n; ++k) {
    const TreeJoint& joint = joints_[k];
    require(-1 <= joint.parent && joint.parent < k, joint_name(k) + " must come after its parent");
    const int last = joint.q + (joint.continuous ? 1 : 0);
    require(k < base_.size || (0 <= joint.q && last < nq_),
            joint_name(k) + " must have its coordinate within a configuration");
  }
}

void JointTree::check_base() const {
  const int n = static_cast<int>(joints_.size());
  require(0 <= base_.size && base_.size <= std::min(n, 6),
          "a base has at most six components, which are joints of the tree");
  if (base_.size == 0) return;
  require(0 <= base_.q && base_.q + (base_.planar ? 2 : 4) <= nq_,
          "a base must have its rotation within a configuration");
  for (int k = 0; k < base_.size; ++k)
    require(0 <= base_.twist_indices[k] && base_.twist_indices[k] < 6,
            "components of a twist are numbered from 0 to 5");
  for (int k = 0; k < n; ++k)
    require(k < base_.size ? joints_[k].parent == k - 1 : joints_[k].parent >= base_.size - 1,
            joint_name(k) + " must be a component of the base or stand on it");
}

void JointTree::add_subtree_masses() {
  for (auto& joint : joints_) joint.subtree_mass = joint.mass;
  for (std::size_t i = joints_.size(); i-- > 0;)
    if (joints_[i].parent >= 0) joints_[joints_[i].parent].subtree_mass += joints_[i].subtree_mass;
}

void JointTree::relate() {
  const std::size_t n = joints_.size();
  common_ancestor_.assign(n * n, -1);
  // A joint shares with an earlier one what its parent shares with it.
  for (std::size_t i = 0; i < n; ++i) {
    const int parent = joints_[i].parent;
    common_ancestor_[i * n + i] = static_cast<int>(i);
    for (std::size_t j = 0; j < i && parent >= 0; ++j)
      common_ancestor_[i * n + j] = common_ancestor_[j * n + i] = common_ancestor_[parent * n + j];
  }
}

void JointTree::list_relatives() {
  const int n = static_cast<int>(joints_.size());
  relative_runs_.resize(n);
  ancestor_runs_.resize(n);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k) {
      const int common = common_ancestor_[i * n + k];
      if (common == i || common == k) append(relative_runs_[i], k);
      if (common == k) append(ancestor_runs_[i], k);
    }
  relatives_ = sets(relative_runs_);
  ancestors_ = sets(ancestor_runs_);
}

TreeView JointTree::view() const {
  TreeView view{};
  view.n = static_cast<int>(joints_.size());
  view.nq = nq_;
  view.joints = joints_.data();
  view.base = base_;
  std::copy_n(gravity_, 6, view.gravity);
  view.common_ancestor = common_ancestor_.data();
  view.relatives = relatives_.data();
  view.ancestors = ancestors_.data();
  return view;
}

}  // namespace hovi::dynamics
