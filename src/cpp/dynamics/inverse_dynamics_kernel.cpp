#include "inverse_dynamics_kernel.hpp"

#include <algorithm>
#include <cstring>
#include <new>
#include <system_error>
#include <thread>
#include <utility>

#include "simd/dispatch.hpp"

namespace hovi::dynamics {

namespace {

constexpr std::align_val_t alignment{64};

// Approximate time per point, with AVX2 [ns].
double point_cost(double n, const Expansion& out) {
  if (out.hessian) return 15 * n * n;
  return out.jacobian ? 30 * n + 2 * n * n : 20 * n;
}

// Starting and joining a thread takes 20 to 90 us, so each gets more work than that.
std::size_t useful_threads(std::size_t asked, double work) {
  static const std::size_t cores = std::max(1u, std::thread::hardware_concurrency());  // 6 us
  const auto worthwhile = static_cast<std::size_t>(work / 150e3);
  return std::max<std::size_t>(1, std::min({asked, cores, worthwhile}));
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
  const auto run = [&](std::size_t chunk) {
    const std::size_t first = packs * chunk / chunks * lanes;
    const std::size_t last = packs * (chunk + 1) / chunks * lanes;
    kernels_.expand(view, workspaces_[chunk].get(), points, multipliers, out, first,
                    std::min(last, points.count));
  };
  std::vector<std::thread> others;
  others.reserve(chunks);
  try {
    while (others.size() + 1 < chunks) others.emplace_back(run, others.size() + 1);
  } catch (const std::system_error&) {  // a limit on threads: this one does the rest
  }
  run(0);
  for (std::size_t chunk = others.size() + 1; chunk < chunks; ++chunk) run(chunk);
  for (auto& other : others) other.join();
}

}  // namespace hovi::dynamics
