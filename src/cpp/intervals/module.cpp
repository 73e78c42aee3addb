// The Python binding, which checks its arguments against each other.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <optional>
#include <string>

#include "kernels.hpp"
#include "paths.hpp"
#include "prefix_sums.hpp"
#include "simd/arrays.hpp"
#include "simd/dispatch.hpp"
#include "squared_effort.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hovi::arrays;
using hovi::intervals::Contraction;
using hovi::intervals::IntervalPath;
using hovi::intervals::Kernels;
using hovi::intervals::LinearRows;
using hovi::intervals::Residuals;
using hovi::intervals::Selection;

namespace {

const Kernels& kernels(bool portable = false) { return hovi::choose_kernels<Kernels>(portable); }

// N intervals, as many as z has. q has n numbers at a node; it is checked where it is used.
IntervalPath path_of(const Input<2>& v, const Input<3>& z, const Input<3>& inner) {
  v.require_kind("v");
  z.require_kind("z");
  inner.require_kind("inner");
  const std::size_t N = z.shape(0), r = inner.shape(1), n = v.shape(1);
  v.require("v", {N + 1, n});
  z.require("z", {N, 2, n});
  inner.require("inner", {N, r, n});
  return {N, r, n, v.data(), z.data(), inner.data()};
}

Residuals residuals_of(const Input<2>& values, const Input<1>& metric) {
  values.require_kind("residuals");
  metric.require("metric", {values.shape(1)});
  return {values.shape(0), values.shape(1), values.data(), metric.data()};
}

// Tables over intervals with P points in all: one for each interval, or one for all of them.
Contraction tables_of(const Input<3>& table, const Input<1>& weights, const Input<1>& steps,
                      std::size_t P, std::size_t n) {
  table.require_kind("table");
  steps.require_kind("steps");
  const std::size_t tables = table.shape(0), R = table.shape(1), m = table.shape(2);
  const std::size_t B = steps.shape(0);
  using hovi::intervals::least_rows, hovi::intervals::most_rows;
  if (R < least_rows || R > most_rows)
    refuse("table must have " + std::to_string(least_rows) + " to " + std::to_string(most_rows) +
           " rows at a point, got " + std::to_string(R) + ".");
  weights.require("weights", {tables});
  const bool own = B > 1 && tables == P;
  const std::size_t Q = own ? P / B : tables;
  return {B, Q, R, m, n, own, table.data(), weights.data(), steps.data()};
}

void contract(const Input<3>& table, const Input<1>& weights, const Input<1>& steps,
              const Input<2>& gradient, const Input<3>& hessian, const Output<3>& columns_gradient,
              const Output<5>& columns_hessian, bool portable) {
  columns_gradient.require_kind("columns_gradient");
  gradient.require_kind("gradient");
  const std::size_t n = columns_gradient.shape(2);
  const Contraction shape = tables_of(table, weights, steps, gradient.shape(0), n);
  const std::size_t B = shape.intervals, P = B * shape.points, R = shape.rows, m = shape.columns;
  gradient.require("gradient", {P, R * n});
  hessian.require("hessian", {P, R * n, R * n});
  columns_gradient.require("columns_gradient", {B, m, n});
  columns_hessian.require("columns_hessian", {B, m, m, n, n});
  if (B == 0 || n == 0) return;
  const nb::gil_scoped_release released;
  const auto work = allocate(kernels(portable).workspace_size(shape));
  kernels(portable).contract(shape, gradient.data(), hessian.data(), work.get(),
                             columns_gradient.data(), columns_hessian.data());
}

// What is selected at P points, of R n numbers and p outputs.
Selection selection_of(const Contraction& shape, const Index& selected, const Input<1>& scales,
                       const Input<3>& jacobian) {
  jacobian.require_kind("jacobian");
  selected.require_kind("selected");
  const std::size_t p = jacobian.shape(1), size = shape.rows * shape.dof, K = selected.shape(0);
  jacobian.require("jacobian", {shape.intervals * shape.points, p, size});
  scales.require("scales", {K});
  for (std::size_t c = 0; c < K; ++c) {
    const std::int64_t column = selected.data()[c];
    if (column < 0 || std::size_t(column) >= size + p)
      refuse("there is no column " + std::to_string(column) + " of " + std::to_string(size + p) +
             ".");
  }
  return {K, p, selected.data(), scales.data(), jacobian.data()};
}

void push(const Input<3>& table, const Input<1>& weights, const Input<1>& steps,
          const Input<3>& step, const Index& selected, const Input<1>& scales,
          const Input<3>& jacobian, const Output<2>& out) {
  step.require_kind("step");
  out.require_kind("out");
  const std::size_t n = step.shape(2);
  const Contraction shape = tables_of(table, weights, steps, out.shape(0), n);
  const Selection of = selection_of(shape, selected, scales, jacobian);
  step.require("step", {shape.intervals, shape.columns, n});
  out.require("out", {shape.intervals * shape.points, of.count});
  const nb::gil_scoped_release released;
  const auto work = allocate(shape.rows * n);
  kernels().push(shape, of, step.data(), work.get(), out.data());
}

void pull(const Input<3>& table, const Input<1>& weights, const Input<1>& steps,
          const Input<2>& forces, const Index& selected, const Input<1>& scales,
          const Input<3>& jacobian, const Output<3>& out) {
  forces.require_kind("forces");
  out.require_kind("out");
  const std::size_t n = out.shape(2);
  const Contraction shape = tables_of(table, weights, steps, forces.shape(0), n);
  const Selection of = selection_of(shape, selected, scales, jacobian);
  forces.require("forces", {shape.intervals * shape.points, of.count});
  out.require("out", {shape.intervals, shape.columns, n});
  const nb::gil_scoped_release released;
  const auto work = allocate(shape.rows * n);
  kernels().pull(shape, of, forces.data(), work.get(), out.data());
}

LinearRows rows_of(const Index& intervals, const Index& joints, const Input<2>& rows,
                   std::size_t N, std::size_t m, std::size_t n) {
  intervals.require_kind("intervals");
  const std::size_t E = intervals.shape(0);
  joints.require("joints", {E});
  rows.require("rows", {E, m});
  for (std::size_t e = 0; e < E; ++e) {
    const std::int64_t k = intervals.data()[e], i = joints.data()[e];
    if (k < 0 || std::size_t(k) >= N || i < 0 || std::size_t(i) >= n)
      refuse("there is no joint " + std::to_string(i) + " of " + std::to_string(n) +
             " in interval " + std::to_string(k) + " of " + std::to_string(N) + ".");
  }
  return {E, m, n, intervals.data(), joints.data(), rows.data()};
}

void push_rows(const Index& intervals, const Index& joints, const Input<2>& rows,
               const Input<3>& step, const Output<1>& out) {
  step.require_kind("step");
  const LinearRows of =
      rows_of(intervals, joints, rows, step.shape(0), step.shape(1), step.shape(2));
  out.require("out", {of.count});
  const auto work = allocate(of.columns);
  kernels().push_rows(of, step.data(), work.get(), out.data());
}

void pull_rows(const Index& intervals, const Index& joints, const Input<2>& rows,
               const Input<1>& forces, const Output<3>& sums) {
  sums.require_kind("sums");
  const LinearRows of =
      rows_of(intervals, joints, rows, sums.shape(0), sums.shape(1), sums.shape(2));
  forces.require("forces", {of.count});
  const auto work = allocate(of.columns);
  kernels().pull_rows(of, forces.data(), work.get(), sums.data());
}

void add_squares(const Index& intervals, const Index& joints, const Input<2>& rows,
                 const Input<1>& weights, const Output<5>& sums) {
  sums.require_kind("sums");
  const std::size_t N = sums.shape(0), m = sums.shape(1), n = sums.shape(3);
  sums.require("sums", {N, m, m, n, n});
  const LinearRows of = rows_of(intervals, joints, rows, N, m, n);
  weights.require("weights", {of.count});
  const auto work = allocate(of.columns * of.columns);
  kernels().add_squares(of, weights.data(), work.get(), sums.data());
}

void require_columns(const char* name, std::size_t columns, const IntervalPath& path) {
  if (columns < 3 || columns > 3 + path.modes)
    refuse(std::string(name) + " must have 3 to " + std::to_string(3 + path.modes) +
           " columns for " + std::to_string(path.modes) + " inner modes, got " +
           std::to_string(columns) + ".");
}

void require_intervals(const Index& intervals, const IntervalPath& path) {
  for (std::size_t b = 0; b < intervals.shape(0); ++b) {
    const std::int64_t k = intervals.data()[b];
    if (k < 0 || std::size_t(k) >= path.intervals)
      refuse("there is no interval " + std::to_string(k) + " of " +
             std::to_string(path.intervals) + ".");
  }
}

void interpolate(const Input<3>& table, const Input<1>& steps, const Index& intervals,
                 const Input<2>& q, const Input<2>& v, const Input<3>& z, const Input<3>& inner,
                 const Output<3>& out) {
  const IntervalPath path = path_of(v, z, inner);
  table.require_kind("table");
  steps.require_kind("steps");
  const std::size_t Q = table.shape(0), columns = table.shape(2), B = steps.shape(0);
  table.require("table", {Q, 3, columns});
  require_columns("table", columns, path);
  intervals.require("intervals", {B});
  q.require("q", {path.intervals + 1, path.dof});
  out.require("out", {3, B * Q, path.dof});
  require_intervals(intervals, path);
  const nb::gil_scoped_release released;
  hovi::intervals::interpolate(path, q.data(), table.data(), Q, columns, steps.data(),
                               intervals.data(), B, out.data());
}

void displacements_at(const Input<2>& rows, const Input<1>& steps, const Index& intervals,
                      const Input<2>& v, const Input<3>& z, const Input<3>& inner,
                      const Output<2>& out) {
  const IntervalPath path = path_of(v, z, inner);
  rows.require_kind("rows");
  const std::size_t count = rows.shape(0), columns = rows.shape(1);
  require_columns("rows", columns, path);
  steps.require("steps", {path.intervals});
  intervals.require("intervals", {count});
  out.require("out", {count, path.dof});
  require_intervals(intervals, path);
  const nb::gil_scoped_release released;
  hovi::intervals::displacements_at(path, rows.data(), columns, steps.data(), intervals.data(),
                                    count, out.data());
}

double misfit(const Input<1>& steps, const Input<2>& q, const Input<2>& v, const Input<3>& z,
              const Input<3>& inner) {
  const IntervalPath path = path_of(v, z, inner);
  steps.require("steps", {path.intervals});
  q.require("q", {path.intervals + 1, path.dof});
  const nb::gil_scoped_release released;
  return hovi::intervals::misfit(path, q.data(), steps.data());
}

void move(const Input<3>& step, const Input<1>& steps, bool nodal, const Input<2>& v,
          const Input<3>& z, const Input<3>& inner, const Output<2>& dq, const Output<2>& new_v,
          const Output<3>& new_z, const Output<3>& new_inner) {
  const IntervalPath path = path_of(v, z, inner);
  const std::size_t N = path.intervals, r = path.modes, n = path.dof;
  step.require_kind("step");
  const std::size_t columns = step.shape(1);
  step.require("step", {N, std::min(std::max<std::size_t>(4, columns), 4 + r), n});
  steps.require("steps", {N});
  dq.require("dq", {N + 1, n});
  new_v.require("new_v", {N + 1, n});
  new_z.require("new_z", {N, 2, n});
  new_inner.require("new_inner", {N, r, n});
  const nb::gil_scoped_release released;
  hovi::intervals::move(path, step.data(), columns, steps.data(), nodal, dq.data(), new_v.data(),
                        new_z.data(), new_inner.data());
}

void replace_by_prefix_sums(const Input<2>& increments, double share, const Output<3>& values) {
  increments.require_kind("increments");
  values.require_kind("values");
  const std::size_t N = increments.shape(0), n = increments.shape(1), rows = values.shape(1);
  values.require("values", {N + 1, std::max<std::size_t>(1, rows), n});
  const nb::gil_scoped_release released;
  hovi::intervals::replace_by_prefix_sums(N, n, increments.data(), share, rows * n, values.data());
}

double weighted_square(const Input<2>& residuals, const Input<1>& metric, const Input<1>& weights) {
  const Residuals r = residuals_of(residuals, metric);
  weights.require("weights", {r.points});
  const nb::gil_scoped_release released;
  return hovi::intervals::weighted_square(r, weights.data());
}

void expand_squares(const Input<2>& residuals, const Input<1>& metric, const Input<3>& jacobian,
                    const std::optional<Input<2>>& force, const Output<1>& values,
                    const Output<2>& gradient) {
  const Residuals r = residuals_of(residuals, metric);
  jacobian.require_kind("jacobian");
  const std::size_t k = jacobian.shape(2);
  jacobian.require("jacobian", {r.points, r.size, k});
  const double* const added = data_or_null("force", force, {r.points, r.size});
  values.require("values", {r.points});
  gradient.require("gradient", {r.points, k});
  const nb::gil_scoped_release released;
  hovi::intervals::expand_squares(r, jacobian.data(), k, added, values.data(), gradient.data());
}

void predict(const Input<2>& residuals, const Input<1>& metric, const Input<3>& jacobian,
             const Input<2>& change, const Output<2>& out) {
  const Residuals r = residuals_of(residuals, metric);
  jacobian.require_kind("jacobian");
  const std::size_t k = jacobian.shape(2);
  jacobian.require("jacobian", {r.points, r.size, k});
  change.require("change", {r.points, k});
  out.require("out", {r.points, r.size});
  const nb::gil_scoped_release released;
  hovi::intervals::predict(r, jacobian.data(), change.data(), k, out.data());
}

}  // namespace

NB_MODULE(intervals, m) {
  m.def("contract", &contract, "table"_a, "weights"_a, "steps"_a, "gradient"_a, "hessian"_a,
        "columns_gradient"_a, "columns_hessian"_a, "portable"_a = false);
  m.def("push", &push, "table"_a, "weights"_a, "steps"_a, "step"_a, "selected"_a, "scales"_a,
        "jacobian"_a, "out"_a);
  m.def("pull", &pull, "table"_a, "weights"_a, "steps"_a, "forces"_a, "selected"_a, "scales"_a,
        "jacobian"_a, "out"_a);
  m.def("push_rows", &push_rows, "intervals"_a, "joints"_a, "rows"_a, "step"_a, "out"_a);
  m.def("pull_rows", &pull_rows, "intervals"_a, "joints"_a, "rows"_a, "forces"_a, "sums"_a);
  m.def("add_squares", &add_squares, "intervals"_a, "joints"_a, "rows"_a, "weights"_a, "sums"_a);
  m.def("interpolate", &interpolate, "table"_a, "steps"_a, "intervals"_a, "q"_a, "v"_a, "z"_a,
        "inner"_a, "out"_a);
  m.def("displacements_at", &displacements_at, "rows"_a, "steps"_a, "intervals"_a, "v"_a, "z"_a,
        "inner"_a, "out"_a);
  m.def("misfit", &misfit, "steps"_a, "q"_a, "v"_a, "z"_a, "inner"_a);
  m.def("move", &move, "step"_a, "steps"_a, "nodal"_a, "v"_a, "z"_a, "inner"_a, "dq"_a, "new_v"_a,
        "new_z"_a, "new_inner"_a);
  m.def("replace_by_prefix_sums", &replace_by_prefix_sums, "increments"_a, "share"_a, "values"_a);
  m.def("weighted_square", &weighted_square, "residuals"_a, "metric"_a, "weights"_a);
  m.def("expand_squares", &expand_squares, "residuals"_a, "metric"_a, "jacobian"_a,
        "force"_a.none(), "values"_a, "gradient"_a);
  m.def("predict", &predict, "residuals"_a, "metric"_a, "jacobian"_a, "change"_a, "out"_a);
}
