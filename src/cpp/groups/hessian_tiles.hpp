// Rows of a Hessian at points as those in the nodal columns of intervals, where configurations are
// no vectors.
//
// Rows of a few joint coordinates are done at a time, and of them the columns from the first of
// these coordinates on: the rest is symmetric.
#pragma once

#include "interval_charts.hpp"

namespace hovi::groups {
namespace {

// Some coordinates of a part, whose rows are done at a time.
struct Tile {
  std::size_t part, first, size;
};

// The tile's rows of the Hessian, in a pack of intervals.
struct TileRows {
  const IntervalCharts& intervals;
  Tile tile;
  std::size_t width, m;  // columns of each kind
  Pack* weighted;  // a row over (q, h v, h^2 a), (3, width)
  Pack* half;      // rows (q, h v, h^2 a) over (q0, x, h x', h^2 x''), (3, size, 4, width)
  Pack* both;      // rows (q0, x, h x', h^2 x'') over the same, (4, size, 4, width)
  Pack* products;  // H A of one entry, (4, m)
  Pack* sums;      // in the intervals' columns, (size, width, m, m)

  static std::size_t size(const Charts& charts) {
    const std::size_t n = charts.space.nv, m = charts.columns;
    return 3 * n + (3 + 4) * 4 * largest_group * n + 4 * m + largest_group * n * m * m;
  }

  TileRows(const IntervalCharts& all, const Tile& chosen)
      : intervals(all),
        tile(chosen),
        width(all.dof() - chosen.first),
        m(all.charts.columns) {
    const std::size_t n = all.dof();
    weighted = all.rest;
    half = weighted + 3 * n;
    both = half + 3 * 4 * largest_group * n;
    products = both + 4 * 4 * largest_group * n;
    sums = products + 4 * m;
  }

  const Part& part(std::size_t f) const { return intervals.part(f); }

  // half, from the Hessian at a point.
  void read_point(std::size_t q, const double* hessian) const {
    const std::size_t n = intervals.dof(), k = tile.size;
    const std::size_t stride = intervals.charts.points * 9 * n * n;
    Pack weight[3];
    intervals.weigh(q, weight);
    const Pack powers[3] = {broadcast(1.0), 1.0 / intervals.h,
                            1.0 / (intervals.h * intervals.h)};
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t i = 0; i < k; ++i) {
        const double* const row = hessian + (q * 3 * n + r * n + tile.first + i) * 3 * n;
        for (std::size_t s = 0; s < 3; ++s) {
          Pack* const run = weighted + s * width;
          read(row + s * n + tile.first, stride, intervals.rows, width, run);
          const Pack factor = weight[r] * powers[s];
          for (std::size_t j = 0; j < width; ++j) run[j] *= factor;
        }
        pull_row(q, half + (r * k + i) * 4 * width);
      }
  }

  void pull_row(std::size_t q, Pack* out) const {
    for (std::size_t f = tile.part; f < intervals.charts.space.parts; ++f) {
      const std::size_t begin = std::max<std::size_t>(part(f).v, tile.first);
      const Pack* const own = weighted + begin - tile.first;
      Pack* const to = out + begin - tile.first;
      if (!curved(part(f))) {
        const std::size_t count = part(f).v + part(f).size - begin;
        for (std::size_t s = 0; s < 4; ++s)
          for (std::size_t j = 0; j < count; ++j)
            to[s * width + j] = own[(s > 0 ? s - 1 : 0) * width + j];
      }
      on_group(part(f).kind, [&](auto group) {
        using Group = decltype(group);
        pull<Group>(intervals.at_point<Group>(q, f).jacobian, own, width, 1, to);
      });
    }
  }

  // both, added to the sums.
  void add_point(std::size_t q) const {
    const std::size_t k = tile.size, row = 4 * width, order = k * row;
    const Pack* rows[] = {half, half, half + order, half + 2 * order};
    on_group(part(tile.part).kind, [&](auto group) {
      using Group = decltype(group);
      const PointMaps<Group>& maps = intervals.at_point<Group>(q, tile.part);
      for (std::size_t j = 0; j < row; ++j)
        pull<Group>(maps.jacobian, half + j, order, row, both + j);
      add_bend<Group>(maps);
      for (std::size_t r = 0; r < 4; ++r) rows[r] = both + r * order;
    });
    const Pack* const table = intervals.table(q);
    for (std::size_t i = 0; i < k; ++i)
      for (std::size_t j = i; j < width; ++j)
        contract(table, rows, i * row + j, sums + (i * width + j) * m * m);
  }

  // The sums on the other side of the diagonal.
  void mirror() const {
    for (std::size_t i = 0; i < tile.size; ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const Pack* const from = sums + (j * width + i) * m * m;
        Pack* const to = sums + (i * width + j) * m * m;
        for (std::size_t r = 0; r < m; ++r)
          for (std::size_t s = 0; s < m; ++s) to[r * m + s] = from[s * m + r];
      }
  }

  template <typename Group>
  void add_bend(const PointMaps<Group>& maps) const {
    const std::size_t row = 4 * width, order = Group::k * row;
    const auto at = [&](std::size_t r, std::size_t s, std::size_t i, std::size_t j) -> Pack& {
      return both[r * order + i * row + s * width + j];
    };
    for (std::size_t i = 0; i < Group::k; ++i)
      for (std::size_t j = 0; j < Group::k; ++j) {
        at(0, 1, i, j) += maps.base_x.at[i][j], at(1, 0, j, i) += maps.base_x.at[i][j];
        at(1, 1, i, j) += maps.x_x.at[i][j], at(2, 2, i, j) += maps.dx_dx.at[i][j];
        at(1, 2, i, j) += maps.x_dx.at[i][j], at(2, 1, j, i) += maps.x_dx.at[i][j];
        at(1, 3, i, j) += maps.x_ddx.at[i][j], at(3, 1, j, i) += maps.x_ddx.at[i][j];
      }
  }

  // sum += A^T H A for one entry of the four by four blocks; q0 stands for itself.
  void contract(const Pack* table, const Pack* const (&rows)[4], std::size_t entry,
                Pack* sum) const {
    const Pack *const A = table, *const B = A + m, *const C = B + m;
    for (std::size_t r = 0; r < 4; ++r) {
      const Pack* const H = rows[r] + entry;
      const Pack base = H[0], x = H[width], y = H[2 * width], z = H[3 * width];
      products[r * m] = base;
      for (std::size_t j = 1; j < m; ++j) products[r * m + j] = A[j] * x + B[j] * y + C[j] * z;
    }
    for (std::size_t j = 0; j < m; ++j) sum[j] += products[j];
    std::size_t i = 1;
    for (; i + 2 <= m; i += 2) add_rows<2>(table + i, sum + i * m);
    for (; i < m; ++i) add_rows<1>(table + i, sum + i * m);
  }

  // Rows of A^T (H A).
  template <std::size_t count>
  void add_rows(const Pack* A, Pack* sum) const {
    const Pack *const x = products + m, *const y = x + m, *const z = y + m;
    for (std::size_t j = 0; j < m; ++j) {
      const Pack xj = x[j], yj = y[j], zj = z[j];
      for (std::size_t i = 0; i < count; ++i)
        sum[i * m + j] += A[i] * xj + A[m + i] * yj + A[2 * m + i] * zj;
    }
  }

  // From the charts' columns to the nodal ones.
  void pull_ends() const {
    const std::size_t k = tile.size, entry = m * m;
    for (std::size_t i = 0; i < k; ++i)
      for (std::size_t row = 0; row < m; ++row)
        pull_columns(sums + i * width * entry + row * m);
    for (std::size_t j = 0; j < width; ++j)
      for (std::size_t column = 0; column < m; ++column)
        pull_rows(sums + j * entry + column);
    on_group(part(tile.part).kind, [&](auto group) {
      using Group = decltype(group);
      constexpr std::size_t columns[] = {0, 2, 3};
      for (std::size_t i = 0; i < Group::k; ++i)
        for (std::size_t j = 0; j < Group::k; ++j)
          for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t s = 0; s < 3; ++s)
              sums[(i * width + j) * entry + columns[r] * m + columns[s]] +=
                  intervals.at_end<Group>(tile.part).hessian[r][s].at[i][j];
    });
  }

  void pull_columns(Pack* n) const {
    const std::size_t rest = part(tile.part).v + part(tile.part).size - tile.first;
    if (curved(part(tile.part))) return intervals.pull_ends(tile.part, n, 1, m * m);
    for (std::size_t i = 0; i < rest; ++i) n[i * m * m] -= n[i * m * m + 2];
    if (rest < width) intervals.pull_ends(tile.part + 1, n + rest * m * m, 1, m * m);
  }

  void pull_rows(Pack* n) const {
    const std::size_t spacing = width * m * m;
    if (!curved(part(tile.part)))
      for (std::size_t i = 0; i < tile.size; ++i) n[i * spacing] -= n[i * spacing + 2 * m];
    on_group(part(tile.part).kind, [&](auto group) {
      using Group = decltype(group);
      pull_end<Group>(intervals.at_end<Group>(tile.part).jacobian, n, m, spacing);
    });
  }

  // Both triangles.
  void write_blocks(double* out) const {
    const std::size_t n = intervals.dof(), k = tile.size, entry = m * m, stride = entry * n * n;
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t j = 0; j < m; ++j) {
        const Pack* const from = sums + i * m + j;
        double* const lower = out + ((i * m + j) * n + tile.first) * n + tile.first;
        double* const upper = out + ((j * m + i) * n + tile.first) * n + tile.first;
        for (std::size_t a = 0; a < k; ++a)
          write(from + a * width * entry, width, intervals.rows, stride, lower + a * n, entry);
        for (std::size_t b = k; b < width; ++b)
          write(from + b * entry, k, intervals.rows, stride, upper + b * n, width * entry);
      }
  }
};

}  // namespace
}  // namespace hovi::groups
