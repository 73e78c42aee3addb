// Ordinary differential equations y' = f(t, y) by Boost's odeint, with f in Python.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "simd/arrays.hpp"

namespace nb = nanobind;
namespace odeint = boost::numeric::odeint;
using namespace nb::literals;
using namespace hovi::arrays;

namespace {

using State = std::vector<double>;
using Returned = nb::ndarray<const double, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// A Python function as odeint's system.
class Rates {
 public:
  explicit Rates(nb::object function) : function_(std::move(function)) {}

  void operator()(const State& y, State& rates, double t) const {
    auto* const copy = new State(y);  // f may keep the array that it is given
    const nb::capsule owner(copy, [](void* state) noexcept { delete static_cast<State*>(state); });
    const nb::ndarray<double, nb::numpy> given(copy->data(), {copy->size()}, owner);
    Returned found;
    if (!nb::try_cast(function_(t, given), found, false) || found.shape(0) != y.size())
      refuse("rates must return a contiguous array of float64 of shape " +
             in_words(std::array<std::size_t, 1>{y.size()}) + ".");
    std::copy_n(found.data(), y.size(), rates.begin());
  }

 private:
  nb::object function_;
};

using Stepper = odeint::runge_kutta_fehlberg78<State>;
using Checker =
    odeint::default_error_checker<double, Stepper::algebra_type, Stepper::operations_type>;

// The error of a step over the tolerances, huge where it is not finite: odeint drops NaN.
class FiniteChecker : public Checker {
 public:
  using Checker::Checker;

  template <typename Algebra, typename Time>
  double error(Algebra& algebra, const State& y, const State& rates, State& error, Time h) const {
    const double value = Checker::error(algebra, y, rates, error, h);
    for (const double entry : error)
      if (!std::isfinite(entry)) return std::numeric_limits<double>::max();
    return value;
  }
};

void integrate(nb::object rates, Output<1> y, double begin, double end, double relative,
               double absolute) {
  y.require_kind("y");
  if (!(begin < end)) refuse("begin must be less than end.");
  if (!(relative > 0.0 && absolute > 0.0)) refuse("tolerances must be positive.");
  State state(y.data(), y.data() + y.size());
  const odeint::controlled_runge_kutta<Stepper, FiniteChecker> stepper(
      FiniteChecker(absolute, relative));
  constexpr double first_share = 0.1;  // of the whole, which the step control corrects
  odeint::integrate_adaptive(stepper, Rates(std::move(rates)), state, begin, end,
                             first_share * (end - begin));
  for (const double entry : state)
    if (!std::isfinite(entry)) throw std::runtime_error("y is not finite at the end");
  std::copy_n(state.begin(), y.size(), y.data());
}

}  // namespace

NB_MODULE(integration, module) {
  module.def("integrate", &integrate, "rates"_a, "y"_a, "begin"_a, "end"_a, "relative"_a,
             "absolute"_a,
             "Replace y at `begin` by that at `end`, where y' = rates(t, y), by Runge, Kutta and "
             "Fehlberg's method of order 8 (7): |error| of a step <= absolute + relative (|y| + "
             "|h y'|), entry by entry. Raises RuntimeError where steps become too short or y is "
             "not finite.");
}
