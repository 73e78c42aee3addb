// The doors to the packed algorithms, one for each instruction set they are compiled for.
//
// Their units share no inline function with any other: the linker could keep the copy that was
// compiled for the larger instruction set. So only plain data passes, and no library's templates.
#pragma once

#include <cstddef>

#include "points.hpp"
#include "tree_view.hpp"

namespace hovi {

struct PackedKernel {
  std::size_t lanes;                              // points in a pack
  std::size_t (*workspace_size)(std::size_t n);   // in bytes

  // Computes the points [first, last). What is null in `out` is not computed.
  // workspace: aligned to 64 bytes, all zero the first time.
  void (*expand)(const TreeView& tree, void* workspace, const Points& points,
                 const Multipliers& multipliers, const Expansion& out, std::size_t first,
                 std::size_t last);
};

extern const PackedKernel packed_baseline;
#ifdef HOVI_WITH_AVX2
extern const PackedKernel packed_avx2;
#endif

}  // namespace hovi
