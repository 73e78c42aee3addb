#include "inverse_dynamics_kernel.hpp"

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

#include "simd/dispatch.hpp"
#include "simd/threads.hpp"

namespace hovi::dynamics {

namespace {

constexpr std::align_val_t alignment{64};

// Approximate time per point, with AVX2 [ns].
double point_cost(double n, const Expansion& out) {
  if (out.hessian) return 15 * n * n;
  return out.jacobian ? 30 * n + 2 * n * n : 20 * n;
}

}  // namespace

InverseDynamicsKernel::InverseDynamicsKernel(JointTree tree, bool portable)
    : tree_(std::move(tree)), kernels_(choose_kernels<Kernels>(portable)) {}

void InverseDynamicsKernel::Free::operator()(void* memory) const {
  ::operator delete(memory, alignment);
}

InverseDynamicsKernel::Workspace InverseDynamicsKernel::make_workspace() const {
  const std::size_t size = kernels_.workspace_size(n());
  void* memory = ::operator new(size, alignment);
  std::memset(memory, 0, size);
  return Workspace(memory);
}

// The threads take contiguous chunks of whole packs.
void InverseDynamicsKernel::expand(Points points, Multipliers multipliers, Expansion out,
                                   int threads) {
  const std::lock_guard<std::mutex> lock(busy_);
  const TreeView view = tree_.view();
  const std::size_t lanes = kernels_.lanes, packs = (points.count + lanes - 1) / lanes;
  const std::size_t chunks = useful_threads(threads, points.count * point_cost(view.n, out));
  while (workspaces_.size() < chunks) workspaces_.push_back(make_workspace());
  share_out(chunks, [&](std::size_t chunk) {
    const std::size_t first = packs * chunk / chunks * lanes;
    const std::size_t last = packs * (chunk + 1) / chunks * lanes;
    kernels_.expand(view, workspaces_[chunk].get(), points, multipliers, out, first,
                    std::min(last, points.count));
  });
}

}  // namespace hovi::dynamics
