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
using hovi::intervals::IntervalPath;
using hovi::intervals::Kernels;
using hovi::intervals::Residuals;

namespace {

const Kernels& kernels(bool portable) { return hovi::choose_kernels<Kernels>(portable); }

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

void contract(const Input<3>& table, const Input<1>& weights, const Input<1>& steps,
              const Input<2>& gradient, const Input<3>& hessian, const Output<3>& columns_gradient,
              const Output<5>& columns_hessian, bool portable) {
  table.require_kind("table");
  steps.require_kind("steps");
  columns_gradient.require_kind("columns_gradient");
  const std::size_t Q = table.shape(0), R = table.shape(1), m = table.shape(2);
  const std::size_t B = steps.shape(0), n = columns_gradient.shape(2);
  using hovi::intervals::least_rows, hovi::intervals::most_rows;
  if (R < least_rows || R > most_rows)
    refuse("table must have " + std::to_string(least_rows) + " to " + std::to_string(most_rows) +
           " rows at a point, got " + std::to_string(R) + ".");
  weights.require("weights", {Q});
  gradient.require("gradient", {B * Q, R * n});
  hessian.require("hessian", {B * Q, R * n, R * n});
  columns_gradient.require("columns_gradient", {B, m, n});
  columns_hessian.require("columns_hessian", {B, m, m, n, n});
  if (B == 0 || n == 0) return;
  const hovi::intervals::Contraction shape{B, Q,           R, m, n, table.data(), weights.data(),
                                           steps.data()};
  const nb::gil_scoped_release released;
  const auto work = allocate(kernels(portable).workspace_size(shape));
  kernels(portable).contract(shape, gradient.data(), hessian.data(), work.get(),
                             columns_gradient.data(), columns_hessian.data());
}

void interpolate(const Input<3>& table, const Input<1>& steps, const Index& intervals,
                 const Input<2>& q, const Input<2>& v, const Input<3>& z, const Input<3>& inner,
                 const Output<3>& out) {
  const IntervalPath path = path_of(v, z, inner);
  table.require_kind("table");
  steps.require_kind("steps");
  const std::size_t Q = table.shape(0), columns = table.shape(2), B = steps.shape(0);
  table.require("table", {Q, 3, columns});
  if (columns < 3 || columns > 3 + path.modes)
    refuse("table must have 3 to " + std::to_string(3 + path.modes) + " columns for " +
           std::to_string(path.modes) + " inner modes, got " + std::to_string(columns) + ".");
  intervals.require("intervals", {B});
  q.require("q", {path.intervals + 1, path.dof});
  out.require("out", {3, B * Q, path.dof});
  for (std::size_t b = 0; b < B; ++b) {
    const std::int64_t k = intervals.data()[b];
    if (k < 0 || std::size_t(k) >= path.intervals)
      refuse("there is no interval " + std::to_string(k) + " of " +
             std::to_string(path.intervals) + ".");
  }
  const nb::gil_scoped_release released;
  hovi::intervals::interpolate(path, q.data(), table.data(), Q, columns, steps.data(),
                               intervals.data(), B, out.data());
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
  m.def("interpolate", &interpolate, "table"_a, "steps"_a, "intervals"_a, "q"_a, "v"_a, "z"_a,
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
