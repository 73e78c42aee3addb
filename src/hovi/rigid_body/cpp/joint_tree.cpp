#include "joint_tree.hpp"

#include <algorithm>
#include <utility>

namespace hovi {

JointTree::JointTree(std::vector<TreeJoint> joints, const double* gravity)
    : joints_(std::move(joints)) {
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
  related_.assign(n * n, -1);
  related_count_.assign(n, 0);
  carriers_.assign(n * n, -1);
  carrier_count_.assign(n, 0);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k) {
      const int meeting = meeting_[i * n + k];
      if (meeting == i || meeting == k) related_[i * n + related_count_[i]++] = k;
      if (meeting == k) carriers_[i * n + carrier_count_[i]++] = k;
    }
}

TreeView JointTree::view() const {
  TreeView view{};
  view.n = static_cast<int>(joints_.size());
  view.joints = joints_.data();
  std::copy_n(gravity_, 6, view.gravity);
  view.meeting = meeting_.data();
  view.related = related_.data();
  view.related_count = related_count_.data();
  view.carriers = carriers_.data();
  view.carrier_count = carrier_count_.data();
  return view;
}

}  // namespace hovi
