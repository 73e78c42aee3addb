// The functions that are compiled once per instruction set: see simd/dispatch.hpp.
#pragma once

#include "band.hpp"

namespace hovi::band {

struct Kernels {
  // L of A = band + shift metric = L L^T, with the reciprocals of its diagonal in place of the
  // diagonal; false where A is not positive definite. Columns from `size` on only fill up the last
  // panel: they are taken for those of the unit matrix.
  bool (*factor)(const Band& shape, const double* band, const double* metric, double shift,
                 double* factor);

  // x = A^-1 x with that L.
  void (*solve)(const Band& shape, const double* factor, double* x);

  static const Kernels baseline, avx2;
};

}  // namespace hovi::band
