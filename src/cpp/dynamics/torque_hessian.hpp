// From the joints' quantities to J and H: sums over pairs of joints, of which the second is an
// ancestor of the first.
#pragma once

#include "recursions.hpp"

namespace hovi::dynamics {
namespace {

// Where each lane's point lies in the batch: the last pack repeats its last point.
struct Lanes {
  std::size_t point[lanes];
};

inline Lanes lanes_from(std::size_t first, std::size_t last) {
  Lanes where;
  for (std::size_t lane = 0; lane < lanes; ++lane)
    where.point[lane] = first + lane < last ? first + lane : last - 1;
  return where;
}

inline void gather(const double* array, const Lanes& where, int n, Pack* out) {
  for (std::size_t lane = 0; lane < lanes; ++lane)
    for (int i = 0; i < n; ++i) out[i][lane] = array[where.point[lane] * n + i];
}

inline void scatter(const Pack* values, const Lanes& where, std::size_t size, double* array) {
  for (std::size_t lane = 0; lane < lanes; ++lane)
    for (std::size_t i = 0; i < size; ++i) array[where.point[lane] * size + i] = values[i][lane];
}

// dtau_i/d(q,v,a)_j: the columns of a joint lie together.
inline Pack* entry(Pack* J, int n, int i, int j) { return J + 3 * (j * n + i); }

// dtau_j/d(q,v,a)_i and dtau_i/d(q,v,a)_j where joint j is an ancestor of joint i, or i.
__attribute__((noinline)) void jacobian(const TreeView& tree, Workspace& work) {
  const int n = tree.n;
  for (int i = 0; i < n; ++i) {
    const Joint& joint = work.joints[i];
    for (int j = i; j >= 0; j = tree.joints[j].parent) {
      const Joint& ancestor = work.joints[j];
      Pack* upper = entry(work.J, n, j, i);
      Pack* lower = entry(work.J, n, i, j);
      lower[0] = dot(ancestor.dS.w, joint.r) + dot(ancestor.ddS, joint.c_a);
      lower[1] = dot(ancestor.S.w, joint.r) + dot(ancestor.T, joint.c_a);
      upper[0] = dot(ancestor.S, joint.c_q);
      upper[1] = dot(ancestor.S, joint.c_v);
      upper[2] = lower[2] = dot(ancestor.S, joint.c_a);
    }
    entry(work.J, n, i, i)[2] += broadcast(tree.joints[i].armature);
  }
}

// In strips of rows, so that neither side jumps about.
inline void scatter_jacobian(const Workspace& work, int n, const Lanes& where, double* out) {
  for (int strip = 0; strip < n; strip += 4)
    for (int j = 0; j < n; ++j)
      for (int i = strip; i < n && i < strip + 4; ++i)
        for (int k = 0; k < 3; ++k) {
          const Pack value = entry(work.J, n, i, j)[k];
          for (std::size_t lane = 0; lane < lanes; ++lane)
            out[((where.point[lane] * n + i) * 3 + k) * n + j] = value[lane];
        }
}

// The block of d2 phi in (q, v, a)_i and (q, v, a)_j where joint j is an ancestor of i, or i.
// tau is affine in a and quadratic in v: the blocks va and aa vanish.
inline void curvature_block(const Joint& i, const Joint& j, Pack block[9]) {
  block[0] = dot(j.L, i.c_q) + dot(j.ddS, i.e) + dot(j.dS, i.h);  // qq
  block[1] = dot(j.S, i.h) + dot(j.T, i.e);                       // q_i v_j
  block[2] = dot(j.S, i.e);                                       // q_i a_j
  block[3] = dot(j.L, i.c_v) + dot(j.dS, i.k);                    // v_i q_j
  block[4] = dot(j.S, i.k);                                       // vv
  block[6] = dot(j.L, i.c_a);                                     // a_i q_j
  block[5] = block[7] = block[8] = Pack{};
}

// block = start + sum_k weight_k dtau_k/d(q,v,a)_i dtau_k/d(q,v,a)_j over the given joints k.
inline void gauss_newton_block(const Workspace& work, int n, int i, int j, const JointSet& rows,
                               const Pack start[9], Pack block[9]) {
  Pack sum[9];
  for (int b = 0; b < 9; ++b) sum[b] = start[b];
  for (int run = 0; run < rows.count; ++run) {
    const Pack* left = entry(work.weighted_J, n, rows.runs[run].begin, i);
    const Pack* right = entry(work.J, n, rows.runs[run].begin, j);
    const Pack* end = entry(work.J, n, rows.runs[run].end, j);
    for (; right != end; left += 3, right += 3)
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) sum[3 * r + c] += left[r] * right[c];
  }
  for (int b = 0; b < 9; ++b) block[b] = sum[b];
}

// Both move the same bodies only when j is an ancestor of i; the torques that depend on both are
// those of their common ancestors, and then also of the descendants of i. Returns where the block
// is.
inline const Pack* hessian_block(const TreeView& tree, const Workspace& work, bool curved, int i,
                                 int j, Pack block[9]) {
  const int n = tree.n, common_ancestor = tree.common_ancestor[i * n + j];
  if (common_ancestor < 0) return work.zeros;
  const bool descends = common_ancestor == j;
  if (descends && curved) {
    curvature_block(work.joints[i], work.joints[j], block);
    if (moves_base(tree, i)) block[0] += bend(work, work.joints[i], work.joints[j]);
  }
  const JointSet& rows = descends ? tree.relatives[i] : tree.ancestors[common_ancestor];
  const Pack* start = descends && curved ? block : work.zeros;
  gauss_newton_block(work, n, i, j, rows, start, block);
  return block;
}

// Both triangles from one, so that the result is symmetric to the last bit.
inline void scatter_block(const Pack block[9], int n, int i, int j, const Lanes& where,
                          double* out) {
  const std::size_t width = 3 * n, next = n * width;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    double* H = out + where.point[lane] * width * width;
    double* direct = H + i * width + j;
    double* mirrored = H + j * width + i;
    for (int r = 0; r < 3; ++r, direct += next, mirrored += next)
      for (int c = 0; c < 3; ++c) {
        direct[c * n] = block[3 * r + c][lane];
        mirrored[c * n] = block[3 * c + r][lane];
      }
  }
}

inline void scatter_diagonal_block(const Pack block[9], int n, int i, const Lanes& where,
                                   double* out) {
  const Pack symmetric[9] = {block[0], block[1], block[2], block[1], block[4],
                             block[5], block[2], block[5], block[8]};
  scatter_block(symmetric, n, i, i, where, out);
}

// In strips of i, so that what is written to the mirrored blocks lies together.
__attribute__((noinline)) void hessian(const TreeView& tree, Workspace& work, bool curved,
                                       const Lanes& where, double* out) {
  const int n = tree.n;
  for (int j = 0; j < n; ++j)
    for (int k = 0; k < n; ++k)
      for (int c = 0; c < 3; ++c)
        entry(work.weighted_J, n, k, j)[c] = work.weight[k] * entry(work.J, n, k, j)[c];
  Pack storage[9];
  for (int strip = 0; strip < n; strip += 4) {
    const int end = strip + 4 < n ? strip + 4 : n;
    for (int j = 0; j < end; ++j)
      for (int i = j < strip ? strip : j; i < end; ++i) {
        const Pack* block = hessian_block(tree, work, curved, i, j, storage);
        if (i == j)
          scatter_diagonal_block(block, n, i, where, out);
        else
          scatter_block(block, n, i, j, where, out);
      }
  }
}

}  // namespace
}  // namespace hovi::dynamics
