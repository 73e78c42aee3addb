// Packs of numbers: HOVI_LANES doubles side by side, on which one instruction works at a time.
//
// Everything is in an unnamed namespace: each instruction set has its own (see dispatch.hpp).
#pragma once

#include <cstddef>

namespace hovi {
namespace {

constexpr std::size_t lanes = HOVI_LANES;
typedef double Pack __attribute__((vector_size(8 * HOVI_LANES)));
typedef double UnalignedPack __attribute__((vector_size(8 * HOVI_LANES), aligned(8), may_alias));

inline Pack load(const double* x) { return *reinterpret_cast<const UnalignedPack*>(x); }
inline void store(double* x, const Pack& pack) { *reinterpret_cast<UnalignedPack*>(x) = pack; }
inline Pack broadcast(double x) { return x - Pack{}; }

inline double sum(const Pack& pack) {
  double total = 0.0;
  for (std::size_t lane = 0; lane < lanes; ++lane) total += pack[lane];
  return total;
}

}  // namespace
}  // namespace hovi
