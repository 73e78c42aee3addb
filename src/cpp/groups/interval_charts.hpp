// The charts of a pack of intervals: their Jacobians, gradients pulled back, steps pushed forward.
#pragma once

#include "chain_rule.hpp"

namespace hovi::groups {
namespace {

// Of a part of the space at a quadrature point.
template <typename Group>
struct PointMaps {
  PointJacobian<Group> jacobian;
  Square<Group> base_x, x_x, x_dx, x_ddx, dx_dx;  // the Hessian's blocks that are not zero
};

// Of a part of the space at the far end.
template <typename Group>
struct EndMaps {
  EndJacobian<Group> jacobian;
  Square<Group> hessian[3][3];
};

// A pack of intervals at work.
struct IntervalCharts {
  const Charts& charts;
  Rows rows;
  Pack h;
  Pack *points, *ends;        // maps of every part
  Pack *tables, *weights;     // (Q, 3, m) and (Q)
  Pack *gradient, *lifted;    // (m, n) and (4, n)
  Pack* rest;                 // what is left of the workspace

  static constexpr std::size_t point_packs = sizeof(PointMaps<SE3>) / sizeof(Pack);
  static constexpr std::size_t end_packs = sizeof(EndMaps<SE3>) / sizeof(Pack);

  static std::size_t size(const Charts& charts) {
    return charts.space.parts * (charts.points * point_packs + end_packs) +
           charts.points * (3 * charts.columns + 1) + (charts.columns + 4) * charts.space.nv;
  }

  IntervalCharts(const Charts& all, std::size_t first, double* workspace)
      : charts(all), rows(first, all.intervals) {
    read(charts.steps, 1, rows, 1, &h);
    points = reinterpret_cast<Pack*>(workspace);
    ends = points + charts.space.parts * charts.points * point_packs;
    tables = ends + charts.space.parts * end_packs;
    const std::size_t Q = charts.points, entries = Q * 3 * charts.columns;
    read(charts.table, charts.own_tables * entries, rows, entries, tables);
    weights = tables + entries;
    read(charts.weights, charts.own_tables * Q, rows, Q, weights);
    gradient = weights + Q;
    lifted = gradient + charts.columns * charts.space.nv;
    rest = lifted + 4 * charts.space.nv;
  }

  std::size_t dof() const { return charts.space.nv; }
  const Part& part(std::size_t f) const { return charts.space.part[f]; }
  const Pack* table(std::size_t q) const { return tables + 3 * q * charts.columns; }

  template <typename Group>
  PointMaps<Group>& at_point(std::size_t q, std::size_t f) const {
    Pack* const maps = points + (q * charts.space.parts + f) * point_packs;
    return *reinterpret_cast<PointMaps<Group>*>(maps);
  }
  template <typename Group>
  EndMaps<Group>& at_end(std::size_t f) const {
    return *reinterpret_cast<EndMaps<Group>*>(ends + f * end_packs);
  }

  template <typename Group>
  Variation variation(std::size_t q, std::size_t first) const {
    Pack x[3][Group::k];
    const std::size_t n = dof(), stride = charts.points * n;
    for (std::size_t r = 0; r < 3; ++r) {
      const double* const from = charts.x + r * charts.intervals * stride;
      read(from + q * n + first, stride, rows, Group::k, x[r]);
    }
    for (std::size_t i = 0; i < Group::k; ++i) x[1][i] *= h, x[2][i] *= h * h;
    return Variation(curve<Group>(x[0], x[1], x[2]));
  }

  template <typename Group>
  EndVariation end_variation(std::size_t first) const {
    Pack x[2][Group::k], still[Group::k] = {};
    const std::size_t n = dof();
    for (std::size_t r = 0; r < 2; ++r)
      read(charts.ends + r * n + first, 2 * n, rows, Group::k, x[r]);
    return EndVariation(curve<Group>(x[0], x[1], still));
  }

  // h w_q / (1, h, h^2).
  void weigh(std::size_t q, Pack (&weight)[3]) const {
    weight[0] = weights[q] * h;
    weight[1] = weights[q];
    weight[2] = weights[q] / h;
  }

  // The weighted gradient at the points, as that in the charts' columns (q0, h v0, x1, h x1', c).
  void lift(const double* at_points, bool bends) const {
    const std::size_t n = dof(), m = charts.columns;
    std::fill(gradient, gradient + m * n, Pack{});
    for (std::size_t q = 0; q < charts.points; ++q) {
      const Pack* const covector = weighted(q, at_points + 3 * q * n, 3 * charts.points * n);
      for (std::size_t f = 0; f < charts.space.parts; ++f) find_point(q, f, covector, bends);
      lift_point(q, covector);
      contract(q);
    }
  }

  // A covector of (q, v, a) at a point, weighted, (3, n). stride: from one interval to the next.
  const Pack* weighted(std::size_t q, const double* at_point, std::size_t stride) const {
    const std::size_t n = dof();
    Pack weight[3];
    weigh(q, weight);
    Pack* const covector = rest;
    read(at_point, stride, rows, 3 * n, covector);
    for (std::size_t i = 0; i < 3 * n; ++i) covector[i] *= weight[i / n];
    return covector;
  }

  // lifted, of a covector at a point whose Jacobians are known.
  void lift_point(std::size_t q, const Pack* covector) const {
    const std::size_t n = dof();
    for (std::size_t f = 0; f < charts.space.parts; ++f) {
      const std::size_t first = part(f).v;
      const Pack* const own = covector + first;
      if (!curved(part(f)))
        for (std::int64_t i = 0; i < part(f).size; ++i)
          for (std::size_t s = 0; s < 4; ++s)
            lifted[s * n + first + i] = own[(s > 0 ? s - 1 : 0) * n + i];
      on_group(part(f).kind, [&](auto group) {
        using Group = decltype(group);
        pull<Group>(at_point<Group>(q, f).jacobian, own, n, 1, lifted + first);
      });
    }
  }

  // The Jacobian of a part at a point, and its Hessians weighted by a covector.
  void find_point(std::size_t q, std::size_t f, const Pack* covector, bool bends) const {
    const std::size_t n = dof(), first = part(f).v;
    on_group(part(f).kind, [&](auto group) {
      using Group = decltype(group);
      const Variation by = variation<Group>(q, first);
      PointMaps<Group>& maps = at_point<Group>(q, f);
      maps.jacobian = PointJacobian<Group>(by);
      if (!bends) return;
      const Pack* const own = covector + first;
      const PointBend bend(by, force<Group>(own), force<Group>(own + n), force<Group>(own + 2 * n));
      maps.base_x = form<Group>(bend.base_x);
      maps.x_x = form<Group>(bend.x_x), maps.x_dx = form<Group>(bend.x_dx);
      maps.x_ddx = form<Group>(bend.x_ddx), maps.dx_dx = form<Group>(bend.dx_dx);
    });
  }

  // gradient += table_q^T lifted; q0 moves the chart and nothing in it.
  void contract(std::size_t q) const {
    const std::size_t n = dof(), m = charts.columns;
    const Pack* const A = table(q);
    for (std::size_t i = 0; i < n; ++i) gradient[i] += lifted[i];
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t j = 1; j < m; ++j)
        for (std::size_t i = 0; i < n; ++i)
          gradient[j * n + i] += A[r * m + j] * lifted[(r + 1) * n + i];
  }

  // The charts' Jacobians at the ends, and their Hessians weighted by the gradient.
  void find_ends(bool bends) const {
    const std::size_t n = dof();
    for (std::size_t f = 0; f < charts.space.parts; ++f)
      on_group(part(f).kind, [&](auto group) {
        using Group = decltype(group);
        const std::size_t first = part(f).v;
        const EndVariation end = end_variation<Group>(first);
        at_end<Group>(f).jacobian = EndJacobian<Group>(end);
        if (!bends) return;
        const EndBend bend(end, force<Group>(gradient + 2 * n + first),
                           force<Group>(gradient + 3 * n + first));
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j)
            at_end<Group>(f).hessian[i][j] = form<Group>(bend.at[i][j]);
      });
  }

  // A covector of some parts in the charts' columns as one in the nodal columns, in place.
  void pull_ends(std::size_t first_part, Pack* n, std::size_t order, std::size_t spacing) const {
    const std::size_t first = part(first_part).v;
    for (std::size_t f = first_part; f < charts.space.parts; ++f) {
      Pack* const own = n + (part(f).v - first) * spacing;
      if (!curved(part(f)))
        for (std::int64_t i = 0; i < part(f).size; ++i)
          own[i * spacing] -= own[i * spacing + 2 * order];
      on_group(part(f).kind, [&](auto group) {
        pull_end<decltype(group)>(at_end<decltype(group)>(f).jacobian, own, order, spacing);
      });
    }
  }
};

}  // namespace
}  // namespace hovi::groups
