// The doors to the packed algorithms, one for each instruction set they are compiled for.
//
// Their units share no inline function with any other: the linker could keep the copy that was
// compiled for the larger instruction set. So only plain data passes, and no library's templates.
#pragma once

#include <cstddef>
#include <cstdint>

namespace hovi {

// A scheme's table over a batch of intervals.
struct Contraction {
  std::size_t intervals, points, columns, dof;  // B, Q, m, n
  const double* table;                          // (Q, 3, m)
  const double* weights;                        // (Q)
  const double* steps;                          // (B)
};

constexpr std::size_t panel_columns = 4;

// The lower triangle of a symmetric matrix by panels of four columns. A panel's columns lie one
// after the other, each from the panel's first row on: entry (i, j) at j stride + i - (j - j % 4).
struct Band {
  std::size_t size, panels;
  std::size_t stride;        // from one column to the next
  const std::int64_t* rows;  // of each panel, a multiple of 4; where panels end does not fall
};

struct Doors {
  // Doubles that `contract` works in.
  std::size_t (*workspace)(const Contraction& shape);

  // Derivatives of an interval in its m columns from those in (q, v, a) at its points: with
  // A_q = table_q / (1, h, h^2) the sums over q of h w_q A_q^T g_q and h w_q A_q^T H_q A_q.
  // gradient: (B, Q, 3, n). hessian: (B, Q, 3, n, 3, n), symmetric.
  // columns_gradient: (B, m, n). columns_hessian: (B, m, m, n, n).
  void (*contract)(const Contraction& shape, const double* gradient, const double* hessian,
                   double* workspace, double* columns_gradient, double* columns_hessian);

  // L of A = band + shift metric = L L^T, with the reciprocals of its diagonal in the diagonal's
  // place; false where A is not positive definite. Columns from `size` on only fill up the last
  // panel: they are taken for those of the unit matrix.
  bool (*factor)(const Band& shape, const double* band, const double* metric, double shift,
                 double* factor);

  // x = A^-1 x with that L.
  void (*solve)(const Band& shape, const double* factor, double* x);
};

extern const Doors packed_baseline;
#ifdef HOVI_WITH_AVX2
extern const Doors packed_avx2;
#endif

}  // namespace hovi
