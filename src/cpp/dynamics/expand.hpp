// The whole evaluation of packs of points: included once per instruction set.
#pragma once

#include "torque_hessian.hpp"

namespace hovi::dynamics {
namespace {

constexpr std::size_t alignment = 64;

inline std::size_t rounded(std::size_t bytes) {
  return (bytes + alignment - 1) / alignment * alignment;
}

// A joint has at most two numbers in a configuration.
inline std::size_t packs_of(std::size_t n) { return 7 * n + 6 * n * n + 9; }

std::size_t workspace_size(std::size_t n) {
  return rounded(n * sizeof(Joint)) + packs_of(n) * sizeof(Pack);
}

Workspace divide(void* memory, std::size_t n) {
  char* bytes = static_cast<char*>(memory);
  Pack* packs = reinterpret_cast<Pack*>(bytes + rounded(n * sizeof(Joint)));
  Pack* J = packs + 7 * n;
  const Vec zero = zero_vec();
  return {reinterpret_cast<Joint*>(bytes), packs, packs + 2 * n, packs + 3 * n, packs + 4 * n,
          packs + 5 * n, packs + 6 * n, J, J + 3 * n * n, J + 6 * n * n, {zero, zero}};
}

void expand_pack(const TreeView& tree, Workspace& work, const Multipliers& multipliers,
                 const Lanes& where, const Expansion& out) {
  const int n = tree.n;
  inverse_dynamics(tree, work);
  scatter(work.tau, where, n, out.tau);
  if (!out.jacobian) return;
  const bool curved = out.hessian && multipliers.curvature;
  first_order(tree, work);
  if (curved) second_order(tree, work);
  add_first_order(tree, work);
  jacobian(tree, work);
  scatter_jacobian(work, n, where, out.jacobian);
  if (!out.hessian) return;
  if (curved) add_second_order(tree, work);
  hessian(tree, work, curved, where, out.hessian);
}

void expand(const TreeView& tree, void* memory, const Points& points,
            const Multipliers& multipliers, const Expansion& out, std::size_t first,
            std::size_t last) {
  const int n = tree.n;
  Workspace work = divide(memory, n);
  for (; first < last; first += lanes) {
    const Lanes where = lanes_from(first, last);
    gather(points.q, where, tree.nq, work.q);
    gather(points.v, where, n, work.v);
    gather(points.a, where, n, work.a);
    if (out.hessian) gather(multipliers.weight, where, n, work.weight);
    if (out.hessian && multipliers.curvature)
      gather(multipliers.curvature, where, n, work.curvature);
    expand_pack(tree, work, multipliers, where, out);
  }
}

constexpr Kernels kernels{lanes, workspace_size, expand};

}  // namespace
}  // namespace hovi::dynamics
