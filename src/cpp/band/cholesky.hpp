// Triangular factorisations of a band matrix by panels of four columns, within its profile:
// L L^T of Cholesky, and L S L^T with signs S = +-1 where a matrix is not positive definite.
#pragma once

#include <cmath>

#include "kernels.hpp"
#include "simd/pack.hpp"

namespace hovi::band {
namespace {

static_assert(panel_columns == 4 && panel_columns % lanes == 0, "panels are written out below");

inline double* panel_of(const Band& shape, double* band, std::size_t panel) {
  return band + panel * panel_columns * shape.stride;
}

// The signs of a positive definite matrix, which nothing is multiplied by.
struct Positive {
  double times(std::size_t, double value) const { return value; }
};

// The signs of a panel's four columns.
struct Signs {
  double* sign;
  double times(std::size_t column, double value) const { return sign[column] * value; }
};

// The sign of a pivot, and whether there is one: none for zero, NaN, or a wrong sign.
inline bool take_sign(Positive, std::size_t, double pivot) { return pivot > 0.0; }

inline bool take_sign(Signs signs, std::size_t column, double pivot) {
  signs.sign[column] = pivot < 0.0 ? -1.0 : 1.0;
  return std::isfinite(pivot) && pivot != 0.0;
}

// The factor of the panel's first four rows, with the reciprocals of its diagonal.
template <typename S>
inline bool factor_corner(double* const column[panel_columns], S signs) {
  for (std::size_t k = 0; k < panel_columns; ++k) {
    double pivot = column[k][k];
    for (std::size_t l = 0; l < k; ++l) pivot -= signs.times(l, column[l][k]) * column[l][k];
    if (!take_sign(signs, k, pivot)) return false;
    column[k][k] = 1.0 / std::sqrt(signs.times(k, pivot));
    for (std::size_t i = k + 1; i < panel_columns; ++i) {
      double entry = column[k][i];
      for (std::size_t l = 0; l < k; ++l) entry -= column[l][i] * signs.times(l, column[l][k]);
      column[k][i] = entry * signs.times(k, column[k][k]);
    }
  }
  return true;
}

// The other rows of the panel.
template <typename S>
inline void factor_rows(double* const column[panel_columns], std::size_t rows, S signs) {
  double *const a = column[0], *const b = column[1], *const c = column[2], *const d = column[3];
  const auto of = [signs](std::size_t k, double value) {
    return broadcast(signs.times(k, value));
  };
  const Pack aa = of(0, a[0]), ab = of(0, a[1]), ac = of(0, a[2]), ad = of(0, a[3]),
             bb = of(1, b[1]), bc = of(1, b[2]), bd = of(1, b[3]), cc = of(2, c[2]),
             cd = of(2, c[3]), dd = of(3, d[3]);
  for (std::size_t i = panel_columns; i < rows; i += lanes) {
    const Pack ai = aa * load(a + i);
    const Pack bi = bb * (load(b + i) - ab * ai);
    const Pack ci = cc * (load(c + i) - ac * ai - bc * bi);
    const Pack di = dd * (load(d + i) - ad * ai - bd * bi - cd * ci);
    store(a + i, ai), store(b + i, bi), store(c + i, ci), store(d + i, di);
  }
}

// Two columns of a later panel, whose first row is the panel's row `first`, without what the panel
// contributes.
template <typename S>
inline void subtract_panel(double* const column[panel_columns], std::size_t first,
                           std::size_t rows, std::size_t k, double* left, double* right,
                           S signs) {
  const double *const a = column[0], *const b = column[1], *const c = column[2],
                      *const d = column[3];
  const std::size_t l = first + k, r = l + 1;
  const auto of = [signs](std::size_t j, double value) {
    return broadcast(signs.times(j, value));
  };
  const Pack al = of(0, a[l]), bl = of(1, b[l]), cl = of(2, c[l]), dl = of(3, d[l]),
             ar = of(0, a[r]), br = of(1, b[r]), cr = of(2, c[r]), dr = of(3, d[r]);
  for (std::size_t i = first; i < rows; i += lanes) {
    const Pack ai = load(a + i), bi = load(b + i), ci = load(c + i), di = load(d + i);
    double *const x = left + i - first, *const y = right + i - first;
    store(x, load(x) - al * ai - bl * bi - cl * ci - dl * di);
    store(y, load(y) - ar * ai - br * bi - cr * ci - dr * di);
  }
}

inline void add(const Band& shape, const double* band, const double* metric, double shift,
                double* sum) {
  const Pack factor = broadcast(shift);
  const std::size_t columns = shape.panels * panel_columns, entries = columns * shape.stride;
  for (std::size_t i = 0; i < entries; i += lanes)
    store(sum + i, load(band + i) + factor * load(metric + i));
  for (std::size_t j = shape.size; j < columns; ++j)
    sum[j * shape.stride + j % panel_columns] = 1.0;
}

// signs_of: the signs of a panel's columns.
template <typename SignsOf>
inline bool factor_panels(const Band& shape, double* band, SignsOf signs_of) {
  for (std::size_t panel = 0; panel < shape.panels; ++panel) {
    const auto signs = signs_of(panel);
    const std::size_t rows = shape.rows[panel];
    double* const start = panel_of(shape, band, panel);
    double* const column[] = {start, start + shape.stride, start + 2 * shape.stride,
                              start + 3 * shape.stride};
    if (!factor_corner(column, signs)) return false;
    factor_rows(column, rows, signs);
    for (std::size_t first = panel_columns; first < rows; first += panel_columns) {
      double* const later = panel_of(shape, band, panel + first / panel_columns);
      for (std::size_t k = 0; k < panel_columns; k += 2)
        subtract_panel(column, first, rows, k, later + k * shape.stride,
                       later + (k + 1) * shape.stride, signs);
    }
  }
  return true;
}

bool factor(const Band& shape, const double* unshifted, const double* metric, double shift,
            double* band) {
  add(shape, unshifted, metric, shift, band);
  return factor_panels(shape, band, [](std::size_t) { return Positive{}; });
}

bool factor_signed(const Band& shape, const double* unshifted, const double* metric, double shift,
                   double* band, double* signs) {
  add(shape, unshifted, metric, shift, band);
  return factor_panels(shape, band,
                       [signs](std::size_t panel) { return Signs{signs + panel * panel_columns}; });
}

inline void forward(const Band& shape, const double* start, std::size_t rows, double* x) {
  const double *const a = start, *const b = a + shape.stride, *const c = b + shape.stride,
                      *const d = c + shape.stride;
  x[0] = x[0] * a[0];
  x[1] = (x[1] - a[1] * x[0]) * b[1];
  x[2] = (x[2] - a[2] * x[0] - b[2] * x[1]) * c[2];
  x[3] = (x[3] - a[3] * x[0] - b[3] * x[1] - c[3] * x[2]) * d[3];
  const Pack xa = broadcast(x[0]), xb = broadcast(x[1]), xc = broadcast(x[2]),
             xd = broadcast(x[3]);
  for (std::size_t i = panel_columns; i < rows; i += lanes)
    store(x + i, load(x + i) - xa * load(a + i) - xb * load(b + i) - xc * load(c + i) -
                     xd * load(d + i));
}

inline void backward(const Band& shape, const double* start, std::size_t rows, double* x) {
  const double *const a = start, *const b = a + shape.stride, *const c = b + shape.stride,
                      *const d = c + shape.stride;
  Pack sa{}, sb{}, sc{}, sd{};
  for (std::size_t i = panel_columns; i < rows; i += lanes) {
    const Pack xi = load(x + i);
    sa += load(a + i) * xi, sb += load(b + i) * xi, sc += load(c + i) * xi, sd += load(d + i) * xi;
  }
  x[3] = (x[3] - sum(sd)) * d[3];
  x[2] = (x[2] - sum(sc) - c[3] * x[3]) * c[2];
  x[1] = (x[1] - sum(sb) - b[3] * x[3] - b[2] * x[2]) * b[1];
  x[0] = (x[0] - sum(sa) - a[3] * x[3] - a[2] * x[2] - a[1] * x[1]) * a[0];
}

void solve(const Band& shape, const double* factor, const double* signs, double* x) {
  const std::size_t size = panel_columns * shape.stride;
  for (std::size_t panel = 0; panel < shape.panels; ++panel)
    forward(shape, factor + panel * size, shape.rows[panel], x + panel * panel_columns);
  if (signs)
    for (std::size_t i = 0; i < shape.panels * panel_columns; ++i) x[i] *= signs[i];
  for (std::size_t panel = shape.panels; panel-- > 0;)
    backward(shape, factor + panel * size, shape.rows[panel], x + panel * panel_columns);
}

constexpr Kernels kernels{factor, factor_signed, solve};

}  // namespace
}  // namespace hovi::band
