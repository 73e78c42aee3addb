// The functions that are compiled once per instruction set: see simd/dispatch.hpp.
#pragma once

#include <cstddef>

#include "points.hpp"
#include "tree_view.hpp"

namespace hovi::dynamics {

struct Kernels {
  std::size_t lanes;                             // points in a pack
  std::size_t (*workspace_size)(std::size_t n);  // in bytes

  // Computes the points [first, last). What is null in `out` is not computed.
  // workspace: aligned to 64 bytes, all zero the first time.
  void (*expand)(const TreeView& tree, void* workspace, const Points& points,
                 const Multipliers& multipliers, const Expansion& out, std::size_t first,
                 std::size_t last);

  static const Kernels baseline, avx2;
};

}  // namespace hovi::dynamics
