// Inverse dynamics in doubles over a batch of points, with analytic first and second derivatives.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "joint_tree.hpp"
#include "kernels.hpp"
#include "points.hpp"

namespace hovi::dynamics {

class InverseDynamicsKernel {
 public:
  // portable: see choose_kernels.
  explicit InverseDynamicsKernel(JointTree tree, bool portable = false);

  std::size_t nq() const { return tree_.view().nq; }  // numbers in a configuration
  std::size_t n() const { return tree_.view().n; }    // degrees of freedom

  // Computes what is not null in `out`.
  void expand(Points points, Multipliers multipliers, Expansion out, int threads);

 private:
  struct Free {
    void operator()(void* memory) const;
  };
  using Workspace = std::unique_ptr<void, Free>;

  Workspace make_workspace() const;

  JointTree tree_;
  const Kernels& kernels_;
  std::vector<Workspace> workspaces_;  // one for each thread
  std::mutex busy_;
};

}  // namespace hovi::dynamics
