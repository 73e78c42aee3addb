// The product of a symmetric band matrix, stored as in band.hpp, with a vector.
#pragma once

#include <algorithm>

#include "band.hpp"

namespace hovi::band {

inline void product(const Band& shape, const double* band, const double* x, double* out) {
  std::fill_n(out, shape.size, 0.0);
  for (std::size_t j = 0; j < shape.size; ++j) {
    const std::size_t first = j - j % panel_columns;
    const std::size_t rows = shape.rows[j / panel_columns];
    const std::size_t last = std::min(first + rows, shape.size);
    const double* const column = band + j * shape.stride;
    double sum = column[j - first] * x[j];
    for (std::size_t i = j + 1; i < last; ++i) {
      out[i] += column[i - first] * x[j];
      sum += column[i - first] * x[i];
    }
    out[j] += sum;
  }
}

}  // namespace hovi::band
