// The Python binding. Shapes and types are checked by the Python side that calls it.
#include <algorithm>
#include <optional>
#include <utility>

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include "arrays.hpp"
#include "band_product.hpp"
#include "carried_sums.hpp"
#include "doors.hpp"
#include "dot.hpp"
#include "interval_paths.hpp"
#include "least_squares.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hovi::arrays;
using hovi::Doors;

namespace {

using Index = Array<const std::int64_t, 1>;

const Doors& best_doors() {
#ifdef HOVI_WITH_AVX2
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return hovi::packed_avx2;
#endif
  return hovi::packed_baseline;
}

const Doors& doors(bool portable) {
  static const Doors& best = best_doors();
  return portable ? hovi::packed_baseline : best;
}

void contract(const Input<3>& table, const Input<1>& weights, const Input<1>& steps,
              const Input<2>& gradient, const Input<3>& hessian,
              const Output<3>& columns_gradient, const Output<5>& columns_hessian,
              bool portable) {
  const hovi::Contraction shape{steps.shape(0),  table.shape(0),  table.shape(2),
                                columns_gradient.shape(2), table.data(), weights.data(),
                                steps.data()};
  const nb::gil_scoped_release released;
  const auto work = room(doors(portable).workspace(shape));
  doors(portable).contract(shape, gradient.data(), hessian.data(), work.get(),
                           columns_gradient.data(), columns_hessian.data());
}

void assemble(const Input<5>& hessian, const Index& starts, const Index& positions,
              const Index& lengths, const std::optional<Input<1>>& scales,
              const Output<2>& band) {
  const nb::gil_scoped_release released;
  std::fill_n(band.data(), band.size(), 0.0);
  const std::size_t runs = starts.shape(0);
  const std::int64_t *start = starts.data(), *position = positions.data(), *length = lengths.data();
  const double *const numbers = hessian.data(), *const scale = scales ? scales->data() : nullptr;
  double* const entries = band.data();
  for (std::size_t run = 0; run < runs; ++run) {
    const double factor = scale ? scale[run] : 1.0;
    const double* from = numbers + start[run];
    double* to = entries + position[run];
    for (std::int64_t i = 0; i < length[run]; ++i) to[i] += factor * from[i];
  }
}

bool factor(const Input<2>& band, const Input<2>& metric, double shift, const Index& rows,
            std::size_t size, const Output<2>& out, bool portable) {
  const hovi::Band shape{size, rows.shape(0), band.shape(1), rows.data()};
  const nb::gil_scoped_release released;
  return doors(portable).factor(shape, band.data(), metric.data(), shift, out.data());
}

void solve(const Input<2>& factor, const Index& rows, const Input<1>& rhs, const Output<1>& out,
           bool portable) {
  const std::size_t size = rhs.shape(0), columns = factor.shape(0);
  const hovi::Band shape{size, rows.shape(0), factor.shape(1), rows.data()};
  const nb::gil_scoped_release released;
  const auto x = room(columns);
  std::copy_n(rhs.data(), size, x.get());
  std::fill_n(x.get() + size, columns - size, 0.0);
  doors(portable).solve(shape, factor.data(), x.get());
  std::copy_n(x.get(), size, out.data());
}

void product(const Input<2>& band, const Index& rows, const Input<1>& x, const Output<1>& out) {
  const hovi::Band shape{x.shape(0), rows.shape(0), band.shape(1), rows.data()};
  const nb::gil_scoped_release released;
  hovi::product(shape, band.data(), x.data(), out.data());
}

// s = -A^-1 g with its slope g.s and its length squared s.D s.
std::pair<double, double> descend(const Input<2>& factor, const Index& rows,
                                  const Input<1>& gradient, const Input<2>& metric,
                                  const Output<1>& out, bool portable) {
  const std::size_t size = gradient.shape(0), columns = factor.shape(0);
  const hovi::Band shape{size, rows.shape(0), factor.shape(1), rows.data()};
  const nb::gil_scoped_release released;
  const auto x = room(columns), product = room(columns);
  for (std::size_t i = 0; i < size; ++i) x.get()[i] = -gradient.data()[i];
  std::fill_n(x.get() + size, columns - size, 0.0);
  doors(portable).solve(shape, factor.data(), x.get());
  std::copy_n(x.get(), size, out.data());
  hovi::product(shape, metric.data(), x.get(), product.get());
  return {hovi::dot(gradient.data(), x.get(), size), hovi::dot(x.get(), product.get(), size)};
}

void interpolate(const Input<3>& table, const Input<1>& steps, const Index& intervals,
                 const Input<2>& q, const Input<2>& v, const Input<3>& z, const Input<3>& inner,
                 const Output<3>& out) {
  const hovi::IntervalPath path{z.shape(0), inner.shape(1), v.shape(1), v.data(), z.data(),
                                inner.data()};
  const nb::gil_scoped_release released;
  hovi::interpolate(path, q.data(), table.data(), table.shape(0), table.shape(2), steps.data(),
                    intervals.data(), steps.shape(0), out.data());
}

double misfit(const Input<1>& steps, const Input<2>& q, const Input<2>& v, const Input<3>& z,
              const Input<3>& inner) {
  const hovi::IntervalPath path{z.shape(0), inner.shape(1), v.shape(1), v.data(), z.data(),
                                inner.data()};
  const nb::gil_scoped_release released;
  return hovi::misfit(path, q.data(), steps.data());
}

void move(const Input<3>& step, const Input<1>& steps, bool nodal, const Input<2>& v,
          const Input<3>& z, const Input<3>& inner, const Output<2>& dq, const Output<2>& new_v,
          const Output<3>& new_z, const Output<3>& new_inner) {
  const hovi::IntervalPath path{z.shape(0), inner.shape(1), v.shape(1), v.data(), z.data(),
                                inner.data()};
  const nb::gil_scoped_release released;
  hovi::move(path, step.data(), step.shape(1), steps.data(), nodal, dq.data(), new_v.data(),
             new_z.data(), new_inner.data());
}

void carry(const Input<2>& increments, double share, const Output<3>& values) {
  const nb::gil_scoped_release released;
  hovi::carry(increments.shape(0), increments.shape(1), increments.data(), share,
              values.shape(1) * values.shape(2), values.data());
}

double weighted_square(const Input<2>& residuals, const Input<1>& metric,
                       const Input<1>& weights) {
  const nb::gil_scoped_release released;
  return hovi::weighted_square(
      {residuals.shape(0), residuals.shape(1), residuals.data(), metric.data()}, weights.data());
}

void expand_squares(const Input<2>& residuals, const Input<1>& metric, const Input<3>& jacobian,
                    const std::optional<Input<2>>& force, const Output<1>& values,
                    const Output<2>& gradient) {
  const nb::gil_scoped_release released;
  hovi::expand_squares({residuals.shape(0), residuals.shape(1), residuals.data(), metric.data()},
                       jacobian.data(), jacobian.shape(2), force ? force->data() : nullptr,
                       values.data(), gradient.data());
}

void predict(const Input<2>& residuals, const Input<1>& metric, const Input<3>& jacobian,
             const Input<2>& change, const Output<2>& out) {
  const nb::gil_scoped_release released;
  hovi::predict({residuals.shape(0), residuals.shape(1), residuals.data(), metric.data()},
                jacobian.data(), change.data(), change.shape(1), out.data());
}

}  // namespace

NB_MODULE(_packed, m) {
  m.attr("panel_columns") = hovi::panel_columns;
  m.def("contract", &contract, "table"_a, "weights"_a, "steps"_a, "gradient"_a, "hessian"_a,
        "columns_gradient"_a, "columns_hessian"_a, "portable"_a = false);
  m.def("assemble", &assemble, "hessian"_a, "starts"_a, "positions"_a, "lengths"_a,
        "scales"_a.none(), "band"_a);
  m.def("factor", &factor, "band"_a, "metric"_a, "shift"_a, "rows"_a, "size"_a, "out"_a,
        "portable"_a = false);
  m.def("product", &product, "band"_a, "rows"_a, "x"_a, "out"_a);
  m.def("descend", &descend, "factor"_a, "rows"_a, "gradient"_a, "metric"_a, "out"_a,
        "portable"_a = false);
  m.def("misfit", &misfit, "steps"_a, "q"_a, "v"_a, "z"_a, "inner"_a);
  m.def("interpolate", &interpolate, "table"_a, "steps"_a, "intervals"_a, "q"_a, "v"_a, "z"_a,
        "inner"_a, "out"_a);
  m.def("move", &move, "step"_a, "steps"_a, "nodal"_a, "v"_a, "z"_a, "inner"_a, "dq"_a, "new_v"_a,
        "new_z"_a, "new_inner"_a);
  m.def("carry", &carry, "increments"_a, "share"_a, "values"_a);
  m.def("weighted_square", &weighted_square, "residuals"_a, "metric"_a, "weights"_a);
  m.def("expand_squares", &expand_squares, "residuals"_a, "metric"_a, "jacobian"_a,
        "force"_a.none(), "values"_a, "gradient"_a);
  m.def("predict", &predict, "residuals"_a, "metric"_a, "jacobian"_a, "change"_a, "out"_a);
  m.def("solve", &solve, "factor"_a, "rows"_a, "rhs"_a, "out"_a, "portable"_a = false);
}
