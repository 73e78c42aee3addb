#include "kernel.hpp"

#include <algorithm>
#include <cstring>
#include <mutex>
#include <new>
#include <thread>
#include <vector>

#include "packed_kernel.hpp"
#include "read_tree.hpp"

namespace hovi {

namespace {

const PackedKernel& packed_kernel(bool portable) {
#ifdef HOVI_WITH_AVX2
  if (!portable && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    return packed_avx2;
#endif
  (void)portable;
  return packed_baseline;
}

constexpr std::align_val_t alignment{64};

struct Free {
  void operator()(void* memory) const { ::operator delete(memory, alignment); }
};
using Workspace = std::unique_ptr<void, Free>;

Workspace make_workspace(std::size_t size) {
  void* memory = ::operator new(size, alignment);
  std::memset(memory, 0, size);
  return Workspace(memory);
}

// Roughly, with the larger vectors [ns].
double point_cost(double n, const Expansion& out) {
  if (out.hessian) return 15 * n * n;
  return out.jacobian ? 30 * n + 2 * n * n : 20 * n;
}

// To start and join a thread takes 20 to 90 us: not for little more work than that.
std::size_t useful_threads(std::size_t asked, double work) {
  static const std::size_t cores = std::max(1u, std::thread::hardware_concurrency());  // 6 us
  const auto worthwhile = static_cast<std::size_t>(work / 150e3);
  return std::max<std::size_t>(1, std::min({asked, cores, worthwhile}));
}

}  // namespace

struct InverseDynamicsKernel::Parts {
  JointTree tree;
  const PackedKernel& packed;
  std::vector<Workspace> workspaces;  // one for each thread
  std::mutex busy;
};

InverseDynamicsKernel::InverseDynamicsKernel(const std::string& archive, bool portable)
    : parts_(new Parts{read_tree(archive), packed_kernel(portable), {}, {}}) {}

InverseDynamicsKernel::~InverseDynamicsKernel() = default;

std::size_t InverseDynamicsKernel::nq() const { return parts_->tree.view().nq; }

std::size_t InverseDynamicsKernel::n() const { return parts_->tree.view().n; }

// The threads take contiguous chunks of whole packs.
void InverseDynamicsKernel::expand(Points points, Multipliers multipliers, Expansion out,
                                   int threads) {
  auto& [tree, packed, workspaces, busy] = *parts_;
  const std::lock_guard<std::mutex> lock(busy);
  const TreeView view = tree.view();
  const std::size_t packs = (points.count + packed.lanes - 1) / packed.lanes;
  const std::size_t chunks = useful_threads(threads, points.count * point_cost(view.n, out));
  while (workspaces.size() < chunks)
    workspaces.push_back(make_workspace(packed.workspace_size(view.n)));
  const auto run = [&](std::size_t chunk) {
    const std::size_t first = packs * chunk / chunks * packed.lanes;
    const std::size_t last = packs * (chunk + 1) / chunks * packed.lanes;
    packed.expand(view, workspaces[chunk].get(), points, multipliers, out, first,
                  std::min(last, points.count));
  };
  std::vector<std::thread> others;
  for (std::size_t chunk = 1; chunk < chunks; ++chunk) others.emplace_back(run, chunk);
  run(0);
  for (auto& other : others) other.join();
}

}  // namespace hovi
