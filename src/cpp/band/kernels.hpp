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

  // L and S of A = L S L^T, without pivoting; S: the signs of the pivots, one for each column of the
  // panels. False where a pivot is zero or not finite.
  bool (*factor_signed)(const Band& shape, const double* band, const double* metric, double shift,
                        double* factor, double* signs);

  // x = A^-1 x with that L, and with S where there are signs.
  void (*solve)(const Band& shape, const double* factor, const double* signs, double* x);

  static const Kernels baseline, avx2;
};

}  // namespace hovi::band
