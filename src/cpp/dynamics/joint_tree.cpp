#include "joint_tree.hpp"

#include <algorithm>
#include <utility>

namespace hovi {

namespace {

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
  for (auto& joint : joints_) joint.subtree_mass = joint.mass;
  for (std::size_t i = joints_.size(); i-- > 0;)
    if (joints_[i].parent >= 0) joints_[joints_[i].parent].subtree_mass += joints_[i].subtree_mass;
  relate();
}

void JointTree::relate() {
  const int n = static_cast<int>(joints_.size());
  meeting_.assign(n * n, -1);
  // A joint meets an earlier one where its parent does.
  for (int i = 0; i < n; ++i) {
    const int parent = joints_[i].parent;
    meeting_[i * n + i] = i;
    for (int j = 0; j < i && parent >= 0; ++j)
      meeting_[i * n + j] = meeting_[j * n + i] = meeting_[parent * n + j];
  }
  related_runs_.resize(n);
  carrier_runs_.resize(n);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k) {
      const int meeting = meeting_[i * n + k];
      if (meeting == i || meeting == k) append(related_runs_[i], k);
      if (meeting == k) append(carrier_runs_[i], k);
    }
  related_ = sets(related_runs_);
  carriers_ = sets(carrier_runs_);
}

TreeView JointTree::view() const {
  TreeView view{};
  view.n = static_cast<int>(joints_.size());
  view.nq = nq_;
  view.joints = joints_.data();
  view.base = base_;
  std::copy_n(gravity_, 6, view.gravity);
  view.meeting = meeting_.data();
  view.related = related_.data();
  view.carriers = carriers_.data();
  return view;
}

}  // namespace hovi
