// The Python binding. Shapes and types are checked by the Python side that calls it.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "dot.hpp"
#include "kernels.hpp"
#include "product.hpp"
#include "simd/arrays.hpp"
#include "simd/dispatch.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hovi::arrays;
using hovi::band::Band;
using hovi::band::Kernels;

namespace {

using Index = Array<const std::int64_t, 1>;

const Kernels& kernels(bool portable) { return hovi::choose_kernels<Kernels>(portable); }

void assemble(const Input<5>& hessian, const Index& starts, const Index& positions,
              const Index& lengths, const std::optional<Input<1>>& scales, const Output<2>& band) {
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
  const Band shape{size, rows.shape(0), band.shape(1), rows.data()};
  const nb::gil_scoped_release released;
  return kernels(portable).factor(shape, band.data(), metric.data(), shift, out.data());
}

void solve(const Input<2>& factor, const Index& rows, const Input<1>& rhs, const Output<1>& out,
           bool portable) {
  const std::size_t size = rhs.shape(0), columns = factor.shape(0);
  const Band shape{size, rows.shape(0), factor.shape(1), rows.data()};
  const nb::gil_scoped_release released;
  const auto x = allocate(columns);
  std::copy_n(rhs.data(), size, x.get());
  std::fill_n(x.get() + size, columns - size, 0.0);
  kernels(portable).solve(shape, factor.data(), x.get());
  std::copy_n(x.get(), size, out.data());
}

void product(const Input<2>& band, const Index& rows, const Input<1>& x, const Output<1>& out) {
  const Band shape{x.shape(0), rows.shape(0), band.shape(1), rows.data()};
  const nb::gil_scoped_release released;
  hovi::band::product(shape, band.data(), x.data(), out.data());
}

// s = -A^-1 g with its slope g.s and its length squared s.D s.
std::pair<double, double> descend(const Input<2>& factor, const Index& rows,
                                  const Input<1>& gradient, const Input<2>& metric,
                                  const Output<1>& out, bool portable) {
  const std::size_t size = gradient.shape(0), columns = factor.shape(0);
  const Band shape{size, rows.shape(0), factor.shape(1), rows.data()};
  const nb::gil_scoped_release released;
  const auto x = allocate(columns), product = allocate(columns);
  for (std::size_t i = 0; i < size; ++i) x.get()[i] = -gradient.data()[i];
  std::fill_n(x.get() + size, columns - size, 0.0);
  kernels(portable).solve(shape, factor.data(), x.get());
  std::copy_n(x.get(), size, out.data());
  hovi::band::product(shape, metric.data(), x.get(), product.get());
  return {hovi::band::dot(gradient.data(), x.get(), size),
          hovi::band::dot(x.get(), product.get(), size)};
}

}  // namespace

NB_MODULE(band, m) {
  m.attr("panel_columns") = hovi::band::panel_columns;
  m.def("assemble", &assemble, "hessian"_a, "starts"_a, "positions"_a, "lengths"_a,
        "scales"_a.none(), "band"_a);
  m.def("factor", &factor, "band"_a, "metric"_a, "shift"_a, "rows"_a, "size"_a, "out"_a,
        "portable"_a = false);
  m.def("solve", &solve, "factor"_a, "rows"_a, "rhs"_a, "out"_a, "portable"_a = false);
  m.def("product", &product, "band"_a, "rows"_a, "x"_a, "out"_a);
  m.def("descend", &descend, "factor"_a, "rows"_a, "gradient"_a, "metric"_a, "out"_a,
        "portable"_a = false);
}
