// How a symmetric band matrix is stored.
#pragma once

#include <cstddef>
#include <cstdint>

namespace hovi::band {

constexpr std::size_t panel_columns = 4;

// The lower triangle of a symmetric matrix by panels of four columns. A panel's columns lie one
// after the other, each from the panel's first row on: entry (i, j) at j stride + i - (j - j % 4).
struct Band {
  std::size_t size, panels;
  std::size_t stride;        // from one column to the next
  const std::int64_t* rows;  // of each panel, a multiple of 4; where panels end does not fall
};

}  // namespace hovi::band
