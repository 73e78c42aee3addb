// The Python binding, which checks its arguments against each other.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
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
using hovi::groups::Kind;
using hovi::groups::Part;
using hovi::groups::Space;

namespace {

// Rows (kind, index in q, index in v, size), one for each part.
using Layout = Array<const std::int64_t, 2>;

const Kernels& kernels(bool portable) { return hovi::choose_kernels<Kernels>(portable); }

// Numbers in q and in v of a part; 0 for an unknown kind.
std::pair<std::int64_t, std::int64_t> sizes_of(Kind kind, std::int64_t size) {
  switch (kind) {
    case Kind::plain: return {size, size};
    case Kind::so2: return {2, 1};
    case Kind::se2: return {4, 3};
    case Kind::so3: return {4, 3};
    case Kind::se3: return {7, 6};
  }
  return {0, 0};
}

// The parts of a space. Throws unless each begins where the one before it ends.
class Parts {
 public:
  explicit Parts(const Layout& layout) {
    layout.require_kind("layout");
    layout.require("layout", {layout.shape(0), 4});
    for (std::size_t i = 0; i < layout.shape(0); ++i) add(i, layout.data() + 4 * i);
  }

  std::size_t nq() const { return nq_; }
  std::size_t nv() const { return nv_; }
  Space space() const { return {nq_, nv_, parts_.size(), parts_.data()}; }

 private:
  void add(std::size_t i, const std::int64_t* row) {
    const auto kind = row[0] < 0 || row[0] > 4 ? Kind::plain : static_cast<Kind>(row[0]);
    const auto [nq, nv] = sizes_of(kind, row[3]);
    const bool follows = row[1] == std::int64_t(nq_) && row[2] == std::int64_t(nv_);
    const bool sized = row[3] == nv && 1 <= nv && nv <= max_size - std::int64_t(nv_);
    if (std::int64_t(kind) != row[0] || !follows || !sized)
      refuse("row " + std::to_string(i) + " of layout is no part of a space that begins at " +
             std::to_string(nq_) + " in q and at " + std::to_string(nv_) + " in v.");
    parts_.push_back({kind, row[1], row[2], row[3]});
    nq_ += nq, nv_ += nv;
  }

  static constexpr std::int64_t max_size = std::int64_t(1) << 40;  // of all: sums do not overflow
  std::vector<Part> parts_;
  std::size_t nq_ = 0, nv_ = 0;
};

Charts charts_of(const Parts& parts, const Input<3>& table, const Input<1>& weights,
                 const Input<1>& steps, const Input<3>& x, const Input<3>& ends) {
  table.require_kind("table");
  steps.require_kind("steps");
  const std::size_t m = table.shape(2), B = steps.shape(0), n = parts.nv(), rows = table.shape(0);
  const bool own_tables = B > 1 && rows > 0 && rows == x.shape(1);
  const std::size_t Q = own_tables ? rows / B : rows;
  table.require("table", {rows, 3, std::max<std::size_t>(4, m)});
  weights.require("weights", {rows});
  x.require("x", {3, B * Q, n});
  ends.require("ends", {B, 2, n});
  return {parts.space(), B,           Q,        m,         own_tables, table.data(),
          weights.data(), steps.data(), x.data(), ends.data()};
}

void integrate(const Layout& layout, const Input<2>& q, const Input<2>& x,
               const Output<2>& result) {
  const Parts parts(layout);
  q.require_kind("q");
  const std::size_t points = q.shape(0), nq = parts.nq(), nv = parts.nv();
  q.require("q", {points, nq});
  x.require("x", {points, nv});
  result.require("result", {points, nq});
  const nb::gil_scoped_release released;
  for (std::size_t p = 0; p < points; ++p)
    hovi::groups::integrate(parts.space(), q.data() + p * nq, x.data() + p * nv,
                            result.data() + p * nq);
}

void difference(const Layout& layout, const Input<2>& q0, const Input<2>& q1,
                const std::optional<Input<2>>& expected, const Output<2>& result) {
  const Parts parts(layout);
  q0.require_kind("q0");
  const std::size_t points = q0.shape(0), nq = parts.nq(), nv = parts.nv();
  q0.require("q0", {points, nq});
  q1.require("q1", {points, nq});
  const double* const turned = data_or_null("expected", expected, {points, nv});
  result.require("result", {points, nv});
  const nb::gil_scoped_release released;
  for (std::size_t p = 0; p < points; ++p)
    hovi::groups::difference(parts.space(), q0.data() + p * nq, q1.data() + p * nq,
                             turned ? turned + p * nv : nullptr, result.data() + p * nv);
}

void rates(const Layout& layout, const Input<3>& x, const std::optional<Input<3>>& base_rates,
           const Output<3>& out, bool portable) {
  const Parts parts(layout);
  x.require_kind("x");
  const std::size_t points = x.shape(1), n = parts.nv();
  x.require("x", {3, points, n});
  const double* const moving = data_or_null("base_rates", base_rates, {2, points, n});
  out.require("out", {2, points, n});
  const nb::gil_scoped_release released;
  kernels(portable).rates(parts.space(), points, x.data(), moving, out.data(),
                          out.data() + points * n);
}

void local_rates(const Layout& layout, const Input<2>& x, const Input<2>& v, const Input<2>& a,
                 const Output<3>& out, bool portable) {
  const Parts parts(layout);
  x.require_kind("x");
  const std::size_t points = x.shape(0), n = parts.nv();
  x.require("x", {points, n});
  v.require("v", {points, n});
  a.require("a", {points, n});
  out.require("out", {2, points, n});
  const nb::gil_scoped_release released;
  kernels(portable).local_rates(parts.space(), points, x.data(), v.data(), a.data(), out.data(),
                                out.data() + points * n);
}

void expand(const Layout& layout, const Input<3>& table, const Input<1>& weights,
            const Input<1>& steps, const Input<3>& x, const Input<3>& ends,
            const Input<2>& gradient, const Input<3>& hessian, const Output<3>& columns_gradient,
            const Output<5>& columns_hessian, bool portable) {
  const Parts parts(layout);
  const Charts charts = charts_of(parts, table, weights, steps, x, ends);
  const std::size_t B = charts.intervals, P = B * charts.points, m = charts.columns;
  const std::size_t n = parts.nv();
  gradient.require("gradient", {P, 3 * n});
  hessian.require("hessian", {P, 3 * n, 3 * n});
  columns_gradient.require("columns_gradient", {B, m, n});
  columns_hessian.require("columns_hessian", {B, m, m, n, n});
  if (B == 0) return;
  const nb::gil_scoped_release released;
  const auto work = allocate(kernels(portable).workspace_size(charts));
  kernels(portable).expand(charts, gradient.data(), hessian.data(), work.get(),
                           columns_gradient.data(), columns_hessian.data());
}

void pull_gradient(const Layout& layout, const Input<3>& table, const Input<1>& weights,
                   const Input<1>& steps, const Input<3>& x, const Input<3>& ends,
                   const Input<2>& gradient, bool regular, const Output<3>& columns_gradient,
                   bool portable) {
  const Parts parts(layout);
  const Charts charts = charts_of(parts, table, weights, steps, x, ends);
  const std::size_t B = charts.intervals, n = parts.nv();
  gradient.require("gradient", {B * charts.points, 3 * n});
  columns_gradient.require("columns_gradient", {B, charts.columns, n});
  if (B == 0) return;
  const nb::gil_scoped_release released;
  const auto work = allocate(kernels(portable).workspace_size(charts));
  kernels(portable).pull_gradient(charts, gradient.data(), regular, work.get(),
                                  columns_gradient.data());
}

void pull_moments(const Layout& layout, const Input<3>& table, const Input<1>& weights,
                  const Input<1>& steps, const Input<3>& x, const Input<3>& ends,
                  const Input<2>& tests, const Input<3>& jacobian,
                  const Output<5>& columns_gradients, bool portable) {
  const Parts parts(layout);
  const Charts charts = charts_of(parts, table, weights, steps, x, ends);
  const std::size_t B = charts.intervals, n = parts.nv();
  const std::size_t K = tests.shape(0), outputs = jacobian.shape(1);
  tests.require("tests", {K, charts.points});
  jacobian.require("jacobian", {B * charts.points, outputs, 3 * n});
  columns_gradients.require("columns_gradients", {B, K, outputs, charts.columns, n});
  if (B == 0 || K == 0 || outputs == 0) return;
  const nb::gil_scoped_release released;
  const auto work = allocate(kernels(portable).moments_workspace_size(charts, K));
  kernels(portable).pull_moments(charts, K, tests.data(), outputs, jacobian.data(), work.get(),
                                 columns_gradients.data());
}

void push_steps(const Layout& layout, const Input<3>& table, const Input<1>& weights,
                const Input<1>& steps, const Input<3>& x, const Input<3>& ends,
                const Input<3>& step, const Output<4>& change, bool portable) {
  const Parts parts(layout);
  const Charts charts = charts_of(parts, table, weights, steps, x, ends);
  const std::size_t B = charts.intervals, n = parts.nv();
  step.require("step", {B, charts.columns, n});
  change.require("change", {B, charts.points, 3, n});
  if (B == 0) return;
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
