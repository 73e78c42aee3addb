// Cholesky factorisation of a band matrix by panels of four columns, within its profile.
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

// The Cholesky factor of the panel's first four rows, with the reciprocals of its diagonal.
inline bool factor_corner(double* const column[panel_columns]) {
  for (std::size_t k = 0; k < panel_columns; ++k) {
    double pivot = column[k][k];
    for (std::size_t l = 0; l < k; ++l) pivot -= column[l][k] * column[l][k];
    if (!(pivot > 0.0)) return false;
    column[k][k] = 1.0 / std::sqrt(pivot);
    for (std::size_t i = k + 1; i < panel_columns; ++i) {
      double entry = column[k][i];
      for (std::size_t l = 0; l < k; ++l) entry -= column[l][i] * column[l][k];
      column[k][i] = entry * column[k][k];
    }
  }
  return true;
}

// The other rows of the panel.
inline void factor_rows(double* const column[panel_columns], std::size_t rows) {
  double *const a = column[0], *const b = column[1], *const c = column[2], *const d = column[3];
  const Pack aa = broadcast(a[0]), ab = broadcast(a[1]), ac = broadcast(a[2]),
             ad = broadcast(a[3]), bb = broadcast(b[1]), bc = broadcast(b[2]),
             bd = broadcast(b[3]), cc = broadcast(c[2]), cd = broadcast(c[3]),
             dd = broadcast(d[3]);
  for (std::size_t i = panel_columns; i < rows; i += lanes) {
    const Pack ai = aa * load(a + i);
    const Pack bi = bb * (load(b + i) - ab * ai);
    const Pack ci = cc * (load(c + i) - ac * ai - bc * bi);
    const Pack di = dd * (load(d + i) - ad * ai - bd * bi - cd * ci);
    store(a + i, ai), store(b + i, bi), store(c + i, ci), store(d + i, di);
  }
}

// Two columns of a later panel, whose first row is the panel's row `first`, without the panel's
// share.
inline void subtract_panel(double* const column[panel_columns], std::size_t first,
                           std::size_t rows, std::size_t k, double* left, double* right) {
  const double *const a = column[0], *const b = column[1], *const c = column[2],
                      *const d = column[3];
  const std::size_t l = first + k, r = l + 1;
  const Pack al = broadcast(a[l]), bl = broadcast(b[l]), cl = broadcast(c[l]),
             dl = broadcast(d[l]), ar = broadcast(a[r]), br = broadcast(b[r]),
             cr = broadcast(c[r]), dr = broadcast(d[r]);
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

bool factor(const Band& shape, const double* unshifted, const double* metric, double shift,
            double* band) {
  add(shape, unshifted, metric, shift, band);
  for (std::size_t panel = 0; panel < shape.panels; ++panel) {
    const std::size_t rows = shape.rows[panel];
    double* const start = panel_of(shape, band, panel);
    double* const column[] = {start, start + shape.stride, start + 2 * shape.stride,
                              start + 3 * shape.stride};
    if (!factor_corner(column)) return false;
    factor_rows(column, rows);
    for (std::size_t first = panel_columns; first < rows; first += panel_columns) {
      double* const later = panel_of(shape, band, panel + first / panel_columns);
      for (std::size_t k = 0; k < panel_columns; k += 2)
        subtract_panel(column, first, rows, k, later + k * shape.stride,
                       later + (k + 1) * shape.stride);
    }
  }
  return true;
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

void solve(const Band& shape, const double* factor, double* x) {
  const std::size_t size = panel_columns * shape.stride;
  for (std::size_t panel = 0; panel < shape.panels; ++panel)
    forward(shape, factor + panel * size, shape.rows[panel], x + panel * panel_columns);
  for (std::size_t panel = shape.panels; panel-- > 0;)
    backward(shape, factor + panel * size, shape.rows[panel], x + panel * panel_columns);
}

constexpr Kernels kernels{factor, solve};

}  // namespace
}  // namespace hovi::band
