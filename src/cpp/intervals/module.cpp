// The Python binding. Shapes and types are checked by the Python side that calls it.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>

#include <optional>

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

using Index = Array<const std::int64_t, 1>;

const Kernels& kernels(bool portable) { return hovi::choose_kernels<Kernels>(portable); }

IntervalPath path_of(const Input<2>& v, const Input<3>& z, const Input<3>& inner) {
  return {z.shape(0), inner.shape(1), v.shape(1), v.data(), z.data(), inner.data()};
}

Residuals residuals_of(const Input<2>& values, const Input<1>& metric) {
  return {values.shape(0), values.shape(1), values.data(), metric.data()};
}

void contract(const Input<3>& table, const Input<1>& weights, const Input<1>& steps,
              const Input<2>& gradient, const Input<3>& hessian, const Output<3>& columns_gradient,
              const Output<5>& columns_hessian, bool portable) {
  const hovi::intervals::Contraction shape{
      steps.shape(0), table.shape(0), table.shape(2), columns_gradient.shape(2),
      table.data(),   weights.data(), steps.data()};
  const nb::gil_scoped_release released;
  const auto work = allocate(kernels(portable).workspace_size(shape));
  kernels(portable).contract(shape, gradient.data(), hessian.data(), work.get(),
                             columns_gradient.data(), columns_hessian.data());
}

void interpolate(const Input<3>& table, const Input<1>& steps, const Index& intervals,
                 const Input<2>& q, const Input<2>& v, const Input<3>& z, const Input<3>& inner,
                 const Output<3>& out) {
  const IntervalPath path = path_of(v, z, inner);
  const nb::gil_scoped_release released;
  hovi::intervals::interpolate(path, q.data(), table.data(), table.shape(0), table.shape(2),
                               steps.data(), intervals.data(), steps.shape(0), out.data());
}

double misfit(const Input<1>& steps, const Input<2>& q, const Input<2>& v, const Input<3>& z,
              const Input<3>& inner) {
  const IntervalPath path = path_of(v, z, inner);
  const nb::gil_scoped_release released;
  return hovi::intervals::misfit(path, q.data(), steps.data());
}

void move(const Input<3>& step, const Input<1>& steps, bool nodal, const Input<2>& v,
          const Input<3>& z, const Input<3>& inner, const Output<2>& dq, const Output<2>& new_v,
          const Output<3>& new_z, const Output<3>& new_inner) {
  const IntervalPath path = path_of(v, z, inner);
  const nb::gil_scoped_release released;
  hovi::intervals::move(path, step.data(), step.shape(1), steps.data(), nodal, dq.data(),
                        new_v.data(), new_z.data(), new_inner.data());
}

void replace_by_prefix_sums(const Input<2>& increments, double share, const Output<3>& values) {
  const nb::gil_scoped_release released;
  hovi::intervals::replace_by_prefix_sums(increments.shape(0), increments.shape(1),
                                          increments.data(), share,
                                          values.shape(1) * values.shape(2), values.data());
}

double weighted_square(const Input<2>& residuals, const Input<1>& metric, const Input<1>& weights) {
  const nb::gil_scoped_release released;
  return hovi::intervals::weighted_square(residuals_of(residuals, metric), weights.data());
}

void expand_squares(const Input<2>& residuals, const Input<1>& metric, const Input<3>& jacobian,
                    const std::optional<Input<2>>& force, const Output<1>& values,
                    const Output<2>& gradient) {
  const nb::gil_scoped_release released;
  hovi::intervals::expand_squares(residuals_of(residuals, metric), jacobian.data(),
                                  jacobian.shape(2), force ? force->data() : nullptr, values.data(),
                                  gradient.data());
}

void predict(const Input<2>& residuals, const Input<1>& metric, const Input<3>& jacobian,
             const Input<2>& change, const Output<2>& out) {
  const nb::gil_scoped_release released;
  hovi::intervals::predict(residuals_of(residuals, metric), jacobian.data(), change.data(),
                           change.shape(1), out.data());
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
