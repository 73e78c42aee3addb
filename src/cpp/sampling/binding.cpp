// One call from times to (q, v, a, tau), which checks its arguments against each other.
#include "binding.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include "dynamics/inverse_dynamics_kernel.hpp"
#include "path_curve.hpp"
#include "simd/arrays.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hovi::arrays;

namespace hovi::sampling {

namespace {

using dynamics::InverseDynamicsKernel;
using Numbers = Array<std::int64_t, 1>;

constexpr std::size_t max_order = 20;
constexpr std::size_t max_degrees = 4096;

struct PathArrays {
  Input<2> q, v;
  Input<3> higher, z, inner;
  Input<1> times, steps;
  Input<3> series;
  Index used;
};

PathCurve curve_of(const PathArrays& of) {
  of.q.require_kind("q");
  of.z.require_kind("z");
  of.inner.require_kind("inner");
  of.series.require_kind("series");
  const std::size_t N = of.z.shape(0), k = of.z.shape(1), n = of.q.shape(1);
  const std::size_t r = of.inner.shape(1), degrees = of.series.shape(0);
  if (N < 1 || k < 1 || k > max_order || degrees > max_degrees)
    refuse("a path has one interval or more, an order from 1 to " + std::to_string(max_order) +
           ", and a series of at most " + std::to_string(max_degrees) + " degrees.");
  of.q.require("q", {N + 1, n});
  of.v.require("v", {N + 1, n});
  of.higher.require("higher", {N + 1, k > 2 ? k - 2 : 0, n});
  of.z.require("z", {N, k, n});
  of.inner.require("inner", {N, r, n});
  of.times.require("times", {N + 1});
  of.steps.require("steps", {N});
  of.series.require("series", {degrees, 3, k + r});
  of.used.require("used", {N});
  for (std::size_t i = 0; i < N; ++i)
    if (of.used.data()[i] < 0 || std::size_t(of.used.data()[i]) > r)
      refuse("an interval uses from 0 to " + std::to_string(r) + " inner modes, got " +
             std::to_string(of.used.data()[i]) + ".");
  return {N,
          n,
          k,
          r,
          degrees,
          of.q.data(),
          of.v.data(),
          of.higher.data(),
          of.z.data(),
          of.inner.data(),
          of.times.data(),
          of.steps.data(),
          of.series.data(),
          of.used.data()};
}

// A motion's path with the inverse dynamics of its segments; refers to the arrays it was given.
class PathSampler {
 public:
  // kernels: of the segments, or none. ends: of their intervals, ascending.
  PathSampler(PathArrays arrays, std::vector<nb::object> kernels, const Index& ends)
      : arrays_(std::move(arrays)), path_(curve_of(arrays_)), owners_(std::move(kernels)) {
    ends.require("ends", {owners_.size()});
    std::int64_t last = 0;
    for (std::size_t i = 0; i < owners_.size(); ++i) {
      const std::int64_t end = ends.data()[i];
      if (end <= last) refuse("ends must be ascending numbers of intervals.");
      ends_.push_back(std::size_t(last = end));
      kernels_.push_back(kernel_of(owners_[i]));
    }
    if (!ends_.empty() && ends_.back() != path_.intervals)
      refuse("the segments must have " + std::to_string(path_.intervals) +
             " intervals together, got " + std::to_string(ends_.back()) + ".");
  }

  std::size_t dof() const { return path_.dof; }
  bool has_torques() const { return !kernels_.empty(); }

  // Whether all of these times are within the motion, with the rounding of the sums of steps.
  bool contains(const double* t, std::size_t count) const {
    const double end = path_.times[path_.intervals];
    const double slack = (4.0 + double(path_.intervals)) * 0x1p-52 * end;
    for (std::size_t i = 0; i < count; ++i)
      if (!(t[i] >= -slack && t[i] <= end + slack)) return false;
    return true;
  }

  // Whether these are intervals of the motion and positions in them.
  bool contains(const std::int64_t* intervals, const double* s, std::size_t count) const {
    for (std::size_t i = 0; i < count; ++i) {
      const bool known = intervals[i] >= 0 && std::size_t(intervals[i]) < path_.intervals;
      if (!known || !(s[i] >= 0.0 && s[i] <= 1.0)) return false;
    }
    return true;
  }

  void locate(const double* t, std::size_t count, std::int64_t* intervals, double* s) const {
    for (std::size_t i = 0; i < count; ++i) {
      const Position at = sampling::locate(path_, t[i]);
      intervals[i] = std::int64_t(at.interval), s[i] = at.s;
    }
  }

  void sample(const std::int64_t* intervals, const double* s, std::size_t count, double* q,
              double* v, double* a, double* tau) {
    const std::size_t n = path_.dof;
    std::vector<double> P(path_.degrees);
    for (std::size_t i = 0; i < count; ++i) {
      const Position at{std::size_t(intervals[i]), s[i]};
      legendre(2.0 * at.s - 1.0, path_.degrees, P.data());
      derivative(path_, at, P.data(), 0, q + i * n);
      derivative(path_, at, P.data(), 1, v + i * n);
      derivative(path_, at, P.data(), 2, a + i * n);
    }
    if (tau) torques(count, intervals, q, v, a, tau);
  }

 private:
  InverseDynamicsKernel* kernel_of(const nb::object& given) const {
    InverseDynamicsKernel* kernel = nullptr;
    if (!nb::try_cast(given, kernel) || !kernel || kernel->n() != path_.dof ||
        kernel->nq() != path_.dof)
      refuse("kernels must be of " + std::to_string(path_.dof) +
             " joints with one coordinate each.");
    return kernel;
  }

  // Runs of points of one segment go to its kernel together.
  void torques(std::size_t count, const std::int64_t* intervals, const double* q, const double* v,
               const double* a, double* tau) {
    const std::size_t n = path_.dof;
    for (std::size_t first = 0, last = 0; first < count; first = last) {
      const std::size_t segment = segment_of(intervals[first]);
      while (last < count && segment_of(intervals[last]) == segment) ++last;
      const std::size_t at = first * n;
      kernels_[segment]->expand({last - first, q + at, v + at, a + at}, {}, {tau + at}, 1);
    }
  }

  std::size_t segment_of(std::int64_t interval) const {
    return std::upper_bound(ends_.begin(), ends_.end(), std::size_t(interval)) - ends_.begin();
  }

  PathArrays arrays_;
  PathCurve path_;
  std::vector<nb::object> owners_;  // of the kernels
  std::vector<InverseDynamicsKernel*> kernels_;
  std::vector<std::size_t> ends_;
};

void construct(PathSampler* self, const Input<2>& q, const Input<2>& v, const Input<3>& higher,
               const Input<3>& z, const Input<3>& inner, const Input<1>& times,
               const Input<1>& steps, const Input<3>& series, const Index& used,
               const std::vector<nb::object>& kernels, const Index& ends) {
  new (self) PathSampler({q, v, higher, z, inner, times, steps, series, used}, kernels, ends);
}

void locate_times(const PathSampler& self, const Input<1>& t, const Numbers& intervals,
            const Output<1>& positions) {
  t.require_kind("t");
  const std::size_t count = t.shape(0);
  intervals.require("intervals", {count});
  positions.require("positions", {count});
  if (!self.contains(t.data(), count)) refuse("t must be times within the motion.");
  self.locate(t.data(), count, intervals.data(), positions.data());
}

void sample(PathSampler& self, const Index& intervals, const Input<1>& positions,
            const Output<2>& q, const Output<2>& v, const Output<2>& a,
            const std::optional<Output<2>>& tau) {
  intervals.require_kind("intervals");
  const std::size_t count = intervals.shape(0), n = self.dof();
  positions.require("positions", {count});
  q.require("q", {count, n});
  v.require("v", {count, n});
  a.require("a", {count, n});
  double* const torques = data_or_null("tau", tau, {count, n});
  if (torques && !self.has_torques()) refuse("tau must be None for a path without kernels.");
  if (!self.contains(intervals.data(), positions.data(), count))
    refuse("intervals must be numbers of intervals, and positions from 0 to 1.");
  const nb::gil_scoped_release released;
  self.sample(intervals.data(), positions.data(), count, q.data(), v.data(), a.data(), torques);
}

}  // namespace

void bind(nb::module_& m) {
  nb::class_<PathSampler>(m, "PathSampler")
      .def("__init__", &construct, "q"_a, "v"_a, "higher"_a, "z"_a, "inner"_a, "times"_a,
           "steps"_a, "series"_a, "used"_a, "kernels"_a, "ends"_a)
      .def("locate", &locate_times, "t"_a, "intervals"_a, "positions"_a)
      .def("sample", &sample, "intervals"_a, "positions"_a, "q"_a, "v"_a, "a"_a,
           "tau"_a.none());
}

}  // namespace hovi::sampling
