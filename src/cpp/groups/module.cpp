// The Python binding. Shapes and types are checked by the Python side that calls it.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>

#include <optional>
#include <vector>

#include "configurations.hpp"
#include "kernels.hpp"
#include "simd/arrays.hpp"
#include "simd/dispatch.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hovi::arrays;
using hovi::groups::Charts;
using hovi::groups::Kernels;
using hovi::groups::Part;
using hovi::groups::Space;

namespace {

// Rows (kind, index in q, index in v, size), one for each part.
using Layout = Array<const std::int64_t, 2>;

const Kernels& kernels(bool portable) { return hovi::choose_kernels<Kernels>(portable); }

std::vector<Part> parts_of(const Layout& layout) {
  std::vector<Part> parts;
  for (const std::int64_t* row = layout.data(); parts.size() < layout.shape(0); row += 4)
    parts.push_back({static_cast<hovi::groups::Kind>(row[0]), row[1], row[2], row[3]});
  return parts;
}

Space space_of(const std::vector<Part>& parts, std::size_t nq, std::size_t nv) {
  return {nq, nv, parts.size(), parts.data()};
}

Charts charts_of(const std::vector<Part>& parts, const Input<3>& table, const Input<1>& weights,
                 const Input<1>& steps, const Input<3>& x, const Input<3>& ends) {
  return {space_of(parts, 0, x.shape(2)),
          steps.shape(0),
          table.shape(0),
          table.shape(2),
          table.data(),
          weights.data(),
          steps.data(),
          x.data(),
          ends.data()};
}

void integrate(const Layout& layout, const Input<2>& q, const Input<2>& x,
               const Output<2>& result) {
  const auto parts = parts_of(layout);
  const Space space = space_of(parts, q.shape(1), x.shape(1));
  const std::size_t points = x.shape(0);
  const nb::gil_scoped_release released;
  for (std::size_t p = 0; p < points; ++p)
    hovi::groups::integrate(space, q.data() + p * space.nq, x.data() + p * space.nv,
                            result.data() + p * space.nq);
}

void difference(const Layout& layout, const Input<2>& q0, const Input<2>& q1,
                const std::optional<Input<2>>& expected, const Output<2>& result) {
  const auto parts = parts_of(layout);
  const Space space = space_of(parts, q0.shape(1), result.shape(1));
  const double* const turned = expected ? expected->data() : nullptr;
  const nb::gil_scoped_release released;
  for (std::size_t p = 0; p < result.shape(0); ++p)
    hovi::groups::difference(space, q0.data() + p * space.nq, q1.data() + p * space.nq,
                             turned ? turned + p * space.nv : nullptr,
                             result.data() + p * space.nv);
}

void rates(const Layout& layout, const Input<3>& x, const std::optional<Input<3>>& base_rates,
           const Output<3>& out, bool portable) {
  const std::size_t points = x.shape(1), n = x.shape(2);
  const auto parts = parts_of(layout);
  const Space space = space_of(parts, 0, n);
  const nb::gil_scoped_release released;
  kernels(portable).rates(space, points, x.data(), base_rates ? base_rates->data() : nullptr,
                          out.data(), out.data() + points * n);
}

void local_rates(const Layout& layout, const Input<2>& x, const Input<2>& v, const Input<2>& a,
                 const Output<3>& out, bool portable) {
  const std::size_t points = x.shape(0), n = x.shape(1);
  const auto parts = parts_of(layout);
  const Space space = space_of(parts, 0, n);
  const nb::gil_scoped_release released;
  kernels(portable).local_rates(space, points, x.data(), v.data(), a.data(), out.data(),
                                out.data() + points * n);
}

void expand(const Layout& layout, const Input<3>& table, const Input<1>& weights,
            const Input<1>& steps, const Input<3>& x, const Input<3>& ends,
            const Input<2>& gradient, const Input<3>& hessian, const Output<3>& columns_gradient,
            const Output<5>& columns_hessian, bool portable) {
  const auto parts = parts_of(layout);
  const Charts charts = charts_of(parts, table, weights, steps, x, ends);
  const nb::gil_scoped_release released;
  const auto work = allocate(kernels(portable).workspace_size(charts));
  kernels(portable).expand(charts, gradient.data(), hessian.data(), work.get(),
                           columns_gradient.data(), columns_hessian.data());
}

void pull_gradient(const Layout& layout, const Input<3>& table, const Input<1>& weights,
                   const Input<1>& steps, const Input<3>& x, const Input<3>& ends,
                   const Input<2>& gradient, bool regular, const Output<3>& columns_gradient,
                   bool portable) {
  const auto parts = parts_of(layout);
  const Charts charts = charts_of(parts, table, weights, steps, x, ends);
  const nb::gil_scoped_release released;
  const auto work = allocate(kernels(portable).workspace_size(charts));
  kernels(portable).pull_gradient(charts, gradient.data(), regular, work.get(),
                                  columns_gradient.data());
}

void pull_moments(const Layout& layout, const Input<3>& table, const Input<1>& weights,
                  const Input<1>& steps, const Input<3>& x, const Input<3>& ends,
                  const Input<2>& tests, const Input<3>& jacobian,
                  const Output<5>& columns_gradients, bool portable) {
  const auto parts = parts_of(layout);
  const Charts charts = charts_of(parts, table, weights, steps, x, ends);
  const nb::gil_scoped_release released;
  const auto work = allocate(kernels(portable).moments_workspace_size(charts, tests.shape(0)));
  kernels(portable).pull_moments(charts, tests.shape(0), tests.data(), jacobian.shape(1),
                                 jacobian.data(), work.get(), columns_gradients.data());
}

void push_steps(const Layout& layout, const Input<3>& table, const Input<1>& weights,
                const Input<1>& steps, const Input<3>& x, const Input<3>& ends,
                const Input<3>& step, const Output<4>& change, bool portable) {
  const auto parts = parts_of(layout);
  const Charts charts = charts_of(parts, table, weights, steps, x, ends);
  const nb::gil_scoped_release released;
  const auto work = allocate(kernels(portable).workspace_size(charts));
  kernels(portable).push_steps(charts, step.data(), work.get(), change.data());
}

}  // namespace

NB_MODULE(groups, m) {
  m.def("integrate", &integrate, "layout"_a, "q"_a, "x"_a, "result"_a);
  m.def("difference", &difference, "layout"_a, "q0"_a, "q1"_a, "expected"_a.none(), "result"_a);
  m.def("rates", &rates, "layout"_a, "x"_a, "base_rates"_a.none(), "out"_a, "portable"_a = false);
  m.def("local_rates", &local_rates, "layout"_a, "x"_a, "v"_a, "a"_a, "out"_a,
        "portable"_a = false);
  m.def("expand", &expand, "layout"_a, "table"_a, "weights"_a, "steps"_a, "x"_a, "ends"_a,
        "gradient"_a, "hessian"_a, "columns_gradient"_a, "columns_hessian"_a, "portable"_a = false);
  m.def("pull_gradient", &pull_gradient, "layout"_a, "table"_a, "weights"_a, "steps"_a, "x"_a,
        "ends"_a, "gradient"_a, "regular"_a, "columns_gradient"_a, "portable"_a = false);
  m.def("pull_moments", &pull_moments, "layout"_a, "table"_a, "weights"_a, "steps"_a, "x"_a,
        "ends"_a, "tests"_a, "jacobian"_a, "columns_gradients"_a, "portable"_a = false);
  m.def("push_steps", &push_steps, "layout"_a, "table"_a, "weights"_a, "steps"_a, "x"_a, "ends"_a,
        "step"_a, "change"_a, "portable"_a = false);
}
