// Derivatives at points as those in the nodal columns of intervals, and steps the other way.
#pragma once

#include "hessian_tiles.hpp"

namespace hovi::groups {
namespace {

std::size_t workspace_size(const Charts& charts) {
  return (IntervalCharts::size(charts) + TileRows::size(charts)) * lanes;
}

inline void expand_tile(const IntervalCharts& intervals, const Tile& tile, const double* hessian,
                        double* columns_hessian) {
  const TileRows rows(intervals, tile);
  std::fill(rows.sums, rows.sums + tile.size * rows.width * rows.m * rows.m, Pack{});
  for (std::size_t q = 0; q < intervals.charts.points; ++q) {
    rows.read_point(q, hessian);
    rows.add_point(q);
  }
  rows.mirror();
  rows.pull_ends();
  rows.write_blocks(columns_hessian);
}

void expand(const Charts& charts, const double* gradient, const double* hessian, double* workspace,
            double* columns_gradient, double* columns_hessian) {
  const std::size_t n = charts.space.nv, m = charts.columns;
  for (std::size_t first = 0; first < charts.intervals; first += lanes) {
    const IntervalCharts intervals(charts, first, workspace);
    intervals.lift(gradient, true);
    intervals.find_ends(true);
    for (std::size_t f = 0; f < charts.space.parts; ++f) {
      const std::size_t begin = charts.space.part[f].v, end = begin + charts.space.part[f].size;
      for (std::size_t row = begin; row < end; row += largest_group)
        expand_tile(intervals, {f, row, std::min(largest_group, end - row)}, hessian,
                    columns_hessian);
    }
    intervals.pull_ends(0, intervals.gradient, n, 1);
    write(intervals.gradient, m * n, intervals.rows, m * n, columns_gradient);
  }
}

void pull_gradient(const Charts& charts, const double* at_points, bool regular, double* workspace,
                   double* columns_gradient) {
  const std::size_t n = charts.space.nv, m = charts.columns;
  for (std::size_t first = 0; first < charts.intervals; first += lanes) {
    const IntervalCharts intervals(charts, first, workspace);
    Pack* const g = intervals.gradient;
    intervals.lift(at_points, false);
    if (regular)  // Z0 = x1 - h v0 and Z1 = h x1' - h v0
      for (std::size_t i = 0; i < n; ++i) g[n + i] -= g[2 * n + i] + g[3 * n + i];
    intervals.find_ends(false);
    intervals.pull_ends(0, g, n, 1);
    write(g, m * n, intervals.rows, m * n, columns_gradient);
  }
}

std::size_t moments_workspace_size(const Charts& charts, std::size_t tests_count) {
  const std::size_t n = charts.space.nv, m = charts.columns;
  return (IntervalCharts::size(charts) + 3 * n + tests_count * m * n) * lanes;
}

// sums (K, m, n): the gradients of one output's moments in the charts' columns.
inline void sum_moments(const IntervalCharts& intervals, std::size_t tests_count,
                        const double* tests, const double* jacobian, std::size_t outputs,
                        Pack* sums) {
  const std::size_t n = intervals.dof(), Q = intervals.charts.points;
  const std::size_t size = intervals.charts.columns * n, row = 3 * n;
  std::fill(sums, sums + tests_count * size, Pack{});
  for (std::size_t q = 0; q < Q; ++q) {
    const double* const at_point = jacobian + q * outputs * row;
    std::fill(intervals.gradient, intervals.gradient + size, Pack{});
    intervals.lift_point(q, intervals.weighted(q, at_point, Q * outputs * row));
    intervals.contract(q);
    for (std::size_t k = 0; k < tests_count; ++k) {
      const Pack test = broadcast(tests[k * Q + q]);
      for (std::size_t i = 0; i < size; ++i) sums[k * size + i] += test * intervals.gradient[i];
    }
  }
}

void pull_moments(const Charts& charts, std::size_t tests_count, const double* tests,
                  std::size_t outputs, const double* jacobian, double* workspace,
                  double* columns_gradients) {
  const std::size_t n = charts.space.nv, size = charts.columns * n;
  const std::size_t stride = tests_count * outputs * size;
  for (std::size_t first = 0; first < charts.intervals; first += lanes) {
    const IntervalCharts intervals(charts, first, workspace);
    for (std::size_t q = 0; q < charts.points; ++q)
      for (std::size_t f = 0; f < charts.space.parts; ++f)
        intervals.find_point(q, f, nullptr, false);
    intervals.find_ends(false);
    Pack* const sums = intervals.rest + 3 * n;
    for (std::size_t i = 0; i < outputs; ++i) {
      sum_moments(intervals, tests_count, tests, jacobian + 3 * i * n, outputs, sums);
      for (std::size_t k = 0; k < tests_count; ++k) {
        intervals.pull_ends(0, sums + k * size, n, 1);
        write(sums + k * size, size, intervals.rows, stride,
              columns_gradients + (k * outputs + i) * size);
      }
    }
  }
}

inline void push_ends(const IntervalCharts& intervals, Pack* step) {
  const std::size_t n = intervals.dof();
  for (std::size_t f = 0; f < intervals.charts.space.parts; ++f) {
    const Part& part = intervals.part(f);
    Pack* const own = step + part.v;
    if (!curved(part))
      for (std::int64_t i = 0; i < part.size; ++i) own[2 * n + i] -= own[i];
    on_group(part.kind, [&](auto group) {
      push_end<decltype(group)>(intervals.at_end<decltype(group)>(f).jacobian, own, n);
    });
  }
}

// A step in the charts' columns as that of (q, v, a) at a point, (3, n) of (4, n).
inline void push_point(const IntervalCharts& intervals, std::size_t q, const Pack* step,
                       Pack* change) {
  const std::size_t n = intervals.dof(), m = intervals.charts.columns;
  const Pack* const table = intervals.table(q);
  std::copy_n(step, n, change);
  std::fill(change + n, change + 4 * n, Pack{});
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t j = 1; j < m; ++j)
      for (std::size_t i = 0; i < n; ++i)
        change[(r + 1) * n + i] += table[r * m + j] * step[j * n + i];
  for (std::size_t f = 0; f < intervals.charts.space.parts; ++f) {
    const Part& part = intervals.part(f);
    Pack* const own = change + part.v;
    if (!curved(part))
      for (std::int64_t i = 0; i < part.size; ++i) {
        own[i] += own[n + i];
        own[n + i] = own[2 * n + i];
        own[2 * n + i] = own[3 * n + i];
      }
    on_group(part.kind, [&](auto group) {
      using Group = decltype(group);
      push<Group>(PointJacobian<Group>(intervals.variation<Group>(q, part.v)), own, n);
    });
  }
  const Pack over = 1.0 / intervals.h;
  for (std::size_t i = 0; i < n; ++i) change[n + i] *= over, change[2 * n + i] *= over * over;
}

void push_steps(const Charts& charts, const double* step, double* workspace, double* change) {
  const std::size_t n = charts.space.nv, m = charts.columns, Q = charts.points;
  for (std::size_t first = 0; first < charts.intervals; first += lanes) {
    const IntervalCharts intervals(charts, first, workspace);
    Pack *const local = intervals.gradient, *const moved = intervals.lifted;
    intervals.find_ends(false);
    read(step, m * n, intervals.rows, m * n, local);
    push_ends(intervals, local);
    for (std::size_t q = 0; q < Q; ++q) {
      push_point(intervals, q, local, moved);
      write(moved, 3 * n, intervals.rows, 3 * Q * n, change + 3 * q * n);
    }
  }
}

constexpr Kernels kernels{rates,         local_rates,  workspace_size,         expand,
                          pull_gradient, pull_moments, moments_workspace_size, push_steps};

}  // namespace
}  // namespace hovi::groups
