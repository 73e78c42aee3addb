// Packs of numbers that lie side by side, at any address.
//
// Everything is in an unnamed namespace: each instruction set has its own (see doors.hpp).
#pragma once

#include <cstddef>

namespace hovi {
namespace {

constexpr std::size_t lanes = HOVI_LANES;
typedef double Pack __attribute__((vector_size(8 * HOVI_LANES)));
typedef double Loose __attribute__((vector_size(8 * HOVI_LANES), aligned(8), may_alias));

inline Pack load(const double* x) { return *reinterpret_cast<const Loose*>(x); }
inline void store(double* x, const Pack& pack) { *reinterpret_cast<Loose*>(x) = pack; }
inline Pack broadcast(double x) { return x - Pack{}; }

inline double sum(const Pack& pack) {
  double total = 0.0;
  for (std::size_t lane = 0; lane < lanes; ++lane) total += pack[lane];
  return total;
}

}  // namespace
}  // namespace hovi
