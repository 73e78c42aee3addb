// The Python binding, which checks its arguments against each other.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include <algorithm>
#include <optional>
#include <string>
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

const Kernels& kernels(bool portable) { return hovi::choose_kernels<Kernels>(portable); }

// A band of `size` columns. Throws unless rows and band fit it and each other: see Band.
Band shape_of(const char* name, const Input<2>& band, const Index& rows, std::size_t size) {
  constexpr std::size_t width = hovi::band::panel_columns;
  band.require_kind(name);
  rows.require_kind("rows");
  const std::size_t panels = rows.shape(0), stride = band.shape(1);
  band.require(name, {width * panels, stride});
  if (size > width * panels || panels != (size + width - 1) / width)
    refuse(std::to_string(panels) + " panels are not those of " + std::to_string(size) +
           " unknowns.");
  std::size_t last = 0;
  for (std::size_t panel = 0; panel < panels; ++panel) {
    const std::int64_t count = rows.data()[panel];
    const bool whole = count > 0 && count % width == 0 && std::size_t(count) <= stride;
    const std::size_t end = whole ? width * panel + count : 0;
    if (!whole || end < last || end > width * panels)
      refuse("rows: panel " + std::to_string(panel) + " of the band cannot have " +
             std::to_string(count) + " rows.");
    last = end;
  }
  return {size, panels, stride, rows.data()};
}

// Whether `length` numbers from `first` on do not lie within an array of `size`.
bool is_outside(std::int64_t first, std::int64_t length, std::size_t size) {
  const auto begin = std::uint64_t(first), count = std::uint64_t(length);  // negative: very large
  return (count > size) | (begin > size - count);
}

// Throws unless all runs lie within an array of `size`.
void require_runs(const char* name, std::size_t runs, const std::int64_t* first,
                  const std::int64_t* length, std::size_t size) {
  std::uint64_t outside = 0;  // no branches: this is checked at each step of an optimiser
  for (std::size_t run = 0; run < runs; ++run) outside |= is_outside(first[run], length[run], size);
  for (std::size_t run = 0; outside && run < runs; ++run)
    if (is_outside(first[run], length[run], size))
      refuse("run " + std::to_string(run) + " of " + std::to_string(length[run]) +
             " numbers from " + std::to_string(first[run]) + " on does not lie within the " +
             std::to_string(size) + " of " + name + ".");
}

void assemble(const Input<5>& hessian, const Index& starts, const Index& positions,
              const Index& lengths, const std::optional<Input<1>>& scales, const Output<2>& band) {
  hessian.require_kind("hessian");
  band.require_kind("band");
  starts.require_kind("starts");
  const std::size_t runs = starts.shape(0);
  positions.require("positions", {runs});
  lengths.require("lengths", {runs});
  const double *const numbers = hessian.data(), *const scale = data_or_null("scales", scales, {runs});
  const std::int64_t *start = starts.data(), *position = positions.data(), *length = lengths.data();
  require_runs("hessian", runs, start, length, hessian.size());
  require_runs("band", runs, position, length, band.size());
  double* const entries = band.data();
  const nb::gil_scoped_release released;
  std::fill_n(entries, band.size(), 0.0);
  for (std::size_t run = 0; run < runs; ++run) {
    const double factor = scale ? scale[run] : 1.0;
    const double* from = numbers + start[run];
    double* to = entries + position[run];
    for (std::int64_t i = 0; i < length[run]; ++i) to[i] += factor * from[i];
  }
}

bool factor(const Input<2>& band, const Input<2>& metric, double shift, const Index& rows,
            std::size_t size, const Output<2>& out, bool portable) {
  const Band shape = shape_of("band", band, rows, size);
  metric.require("metric", {band.shape(0), band.shape(1)});
  out.require("out", {band.shape(0), band.shape(1)});
  const nb::gil_scoped_release released;
  return kernels(portable).factor(shape, band.data(), metric.data(), shift, out.data());
}

// The number of negative pivots; -1 where there is no factor.
int factor_signed(const Input<2>& band, const Input<2>& metric, double shift, const Index& rows,
                  std::size_t size, const Output<1>& signs, const Output<2>& out, bool portable) {
  const Band shape = shape_of("band", band, rows, size);
  metric.require("metric", {band.shape(0), band.shape(1)});
  signs.require("signs", {band.shape(0)});
  out.require("out", {band.shape(0), band.shape(1)});
  double* const sign = signs.data();
  const nb::gil_scoped_release released;
  std::fill_n(sign, band.shape(0), 1.0);
  if (!kernels(portable).factor_signed(shape, band.data(), metric.data(), shift, out.data(), sign))
    return -1;
  return int(std::count(sign, sign + size, -1.0));
}

void solve(const Input<2>& factor, const Index& rows, const Input<1>& rhs, const Output<1>& out,
           bool portable, const std::optional<Input<1>>& signs) {
  rhs.require_kind("rhs");
  const std::size_t size = rhs.shape(0), columns = factor.shape(0);
  const Band shape = shape_of("factor", factor, rows, size);
  out.require("out", {size});
  const double* const sign = data_or_null("signs", signs, {columns});
  const nb::gil_scoped_release released;
  const auto x = allocate(columns);
  std::copy_n(rhs.data(), size, x.get());
  std::fill_n(x.get() + size, columns - size, 0.0);
  kernels(portable).solve(shape, factor.data(), sign, x.get());
  std::copy_n(x.get(), size, out.data());
}

void product(const Input<2>& band, const Index& rows, const Input<1>& x, const Output<1>& out) {
  x.require_kind("x");
  const Band shape = shape_of("band", band, rows, x.shape(0));
  out.require("out", {shape.size});
  const nb::gil_scoped_release released;
  hovi::band::product(shape, band.data(), x.data(), out.data());
}

// s = -A^-1 g with its slope g.s and its length squared s.D s.
std::pair<double, double> descend(const Input<2>& factor, const Index& rows,
                                  const Input<1>& gradient, const Input<2>& metric,
                                  const Output<1>& out, bool portable) {
  gradient.require_kind("gradient");
  const std::size_t size = gradient.shape(0), columns = factor.shape(0);
  const Band shape = shape_of("factor", factor, rows, size);
  metric.require("metric", {columns, shape.stride});
  out.require("out", {size});
  const nb::gil_scoped_release released;
  const auto x = allocate(columns), product = allocate(columns);
  for (std::size_t i = 0; i < size; ++i) x.get()[i] = -gradient.data()[i];
  std::fill_n(x.get() + size, columns - size, 0.0);
  kernels(portable).solve(shape, factor.data(), nullptr, x.get());
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
  m.def("factor_signed", &factor_signed, "band"_a, "metric"_a, "shift"_a, "rows"_a, "size"_a,
        "signs"_a, "out"_a, "portable"_a = false);
  m.def("solve", &solve, "factor"_a, "rows"_a, "rhs"_a, "out"_a, "portable"_a = false,
        "signs"_a.none() = nb::none());
  m.def("product", &product, "band"_a, "rows"_a, "x"_a, "out"_a);
  m.def("descend", &descend, "factor"_a, "rows"_a, "gradient"_a, "metric"_a, "out"_a,
        "portable"_a = false);
}
