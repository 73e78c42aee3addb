// The Python binding, which checks its arguments against each other.
#include <nanobind/nanobind.h>
#include <nanobind/stl/tuple.h>

#include <tuple>

#include "kernels.hpp"
#include "simd/arrays.hpp"
#include "simd/dispatch.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hovi::arrays;
using hovi::barrier::Direction;
using hovi::barrier::Kernels;
using hovi::barrier::Slacks;

namespace {

const Kernels& kernels() { return hovi::choose_kernels<Kernels>(); }

using Vector = Input<1>;
using Out = Output<1>;

Slacks slacks_of(const Vector& lower, const Vector& upper, const Vector& s, const Vector& zl,
                 const Vector& zu) {
  s.require_kind("s");
  const std::size_t R = s.shape(0);
  lower.require("lower", {R});
  upper.require("upper", {R});
  zl.require("zl", {R});
  zu.require("zu", {R});
  return {R, lower.data(), upper.data(), s.data(), zl.data(), zu.data()};
}

Direction direction_of(std::size_t R, const Out& ds, const Out& dzl, const Out& dzu) {
  ds.require("ds", {R});
  dzl.require("dzl", {R});
  dzu.require("dzu", {R});
  return {ds.data(), dzl.data(), dzu.data()};
}

const double* vector(const char* name, std::size_t R, const Vector& x) {
  x.require(name, {R});
  return x.data();
}

double* vector(const char* name, std::size_t R, const Out& x) {
  x.require(name, {R});
  return x.data();
}

Direction new_slacks_of(std::size_t R, const Out& s, const Out& zl, const Out& zu) {
  return {vector("new_s", R, s), vector("new_zl", R, zl), vector("new_zu", R, zu)};
}

void require_share(double keep) {
  if (!(keep >= 0.0)) refuse("keep must be a share of the gaps, 0 or more.");
}

void condense(const Vector& lower, const Vector& upper, const Vector& s, const Vector& zl,
              const Vector& zu, const Vector& y, double mu, const Out& sigma, const Out& rho,
              const Out& force) {
  const Slacks at = slacks_of(lower, upper, s, zl, zu);
  const std::size_t R = at.count;
  kernels().condense(at, vector("y", R, y), mu, vector("sigma", R, sigma),
                     vector("rho", R, rho), vector("force", R, force));
}

void shift(const Vector& lower, const Vector& upper, const Vector& s, const Vector& zl,
           const Vector& zu, double mu, const Vector& lower_targets, const Vector& upper_targets,
           const Out& out) {
  const Slacks at = slacks_of(lower, upper, s, zl, zu);
  const std::size_t R = at.count;
  kernels().shift(at, mu, vector("lower_targets", R, lower_targets),
                  vector("upper_targets", R, upper_targets), vector("out", R, out));
}

std::tuple<double, double, double, double> aim(
    const Vector& lower, const Vector& upper, const Vector& s, const Vector& zl, const Vector& zu,
    const Vector& y, const Vector& dy, const Vector& lower_targets, const Vector& upper_targets,
    double matched, double keep, const Out& ds, const Out& dzl, const Out& dzu) {
  require_share(keep);
  const Slacks at = slacks_of(lower, upper, s, zl, zu);
  const std::size_t R = at.count;
  const auto lengths = kernels().aim(
      at, vector("y", R, y), vector("dy", R, dy), vector("lower_targets", R, lower_targets),
      vector("upper_targets", R, upper_targets), matched, keep, direction_of(R, ds, dzl, dzu));
  return {lengths.primal, lengths.dual, lengths.largest_force, lengths.largest_residual};
}

double mean_product(const Vector& lower, const Vector& upper, const Vector& s, const Vector& zl,
                    const Vector& zu, const Out& ds, const Out& dzl, const Out& dzu, double primal,
                    double dual) {
  const Slacks at = slacks_of(lower, upper, s, zl, zu);
  return kernels().mean_product(at, direction_of(at.count, ds, dzl, dzu), primal, dual);
}

double largest_miss(const Vector& lower, const Vector& upper, const Vector& s, const Vector& zl,
                    const Vector& zu, double mu) {
  return kernels().largest_miss(slacks_of(lower, upper, s, zl, zu), mu);
}

void correct(const Vector& lower, const Vector& upper, const Vector& s, const Vector& zl,
             const Vector& zu, const Vector& y, const Out& ds, const Out& dzl, const Out& dzu,
             double mu, double matched, const Out& lower_targets, const Out& upper_targets) {
  const Slacks at = slacks_of(lower, upper, s, zl, zu);
  const std::size_t R = at.count;
  kernels().correct(at, vector("y", R, y), direction_of(R, ds, dzl, dzu), mu, matched,
                    vector("lower_targets", R, lower_targets),
                    vector("upper_targets", R, upper_targets));
}

void center(const Vector& lower, const Vector& upper, const Vector& s, const Vector& zl,
            const Vector& zu, const Vector& y, const Out& ds, const Out& dzl, const Out& dzu,
            double primal, double dual, double mu, double matched, const Out& lower_targets,
            const Out& upper_targets) {
  const Slacks at = slacks_of(lower, upper, s, zl, zu);
  const std::size_t R = at.count;
  kernels().center(at, vector("y", R, y), direction_of(R, ds, dzl, dzu), primal, dual, mu,
                   matched, vector("lower_targets", R, lower_targets),
                   vector("upper_targets", R, upper_targets));
}

double merit(const Vector& lower, const Vector& upper, const Vector& s, const Vector& zl,
             const Vector& zu, const Vector& weights, const Vector& y, const Vector& dy,
             const Vector& ds, double share, double keep, double mu, double penalty) {
  require_share(keep);
  const Slacks at = slacks_of(lower, upper, s, zl, zu);
  const std::size_t R = at.count;
  return kernels().merit(at, vector("weights", R, weights), vector("y", R, y),
                         vector("dy", R, dy), vector("ds", R, ds), share, keep, mu, penalty);
}

void move(const Vector& lower, const Vector& upper, const Vector& s, const Vector& zl,
          const Vector& zu, const Vector& y, const Out& ds, const Out& dzl, const Out& dzu,
          double primal, double dual, double keep, double mu, double penalty, double ratio,
          const Out& new_s, const Out& new_zl, const Out& new_zu) {
  require_share(keep);
  if (!(mu >= 0.0 && ratio >= 1.0)) refuse("mu must be 0 or more, and ratio 1 or more.");
  const Slacks at = slacks_of(lower, upper, s, zl, zu);
  const std::size_t R = at.count;
  const Direction out = new_slacks_of(R, new_s, new_zl, new_zu);
  kernels().move(at, vector("y", R, y), direction_of(R, ds, dzl, dzu), primal, dual, keep, mu,
                 penalty, ratio, out);
}

void require_central(double c, double mu) {
  if (!(c > 0.0 && mu > 0.0)) refuse("c and mu must be positive.");
}

void recenter(const Vector& lower, const Vector& upper, const Vector& s, const Vector& zl,
              const Vector& zu, double c, double mu, const Out& new_s, const Out& new_zl,
              const Out& new_zu) {
  require_central(c, mu);
  const Slacks at = slacks_of(lower, upper, s, zl, zu);
  const std::size_t R = at.count;
  const Direction out = new_slacks_of(R, new_s, new_zl, new_zu);
  kernels().recenter(at, c, mu, out);
}

std::tuple<double, double> follow(const Vector& lower, const Vector& upper, const Vector& s,
                                  const Vector& zl, const Vector& zu, const Vector& weights,
                                  const Vector& y, const Vector& dy, const Vector& y_new,
                                  double mu, double next_mu, double least, const Out& new_s,
                                  const Out& new_zl, const Out& new_zu) {
  require_central(least, next_mu);
  const Slacks at = slacks_of(lower, upper, s, zl, zu);
  const std::size_t R = at.count;
  const Direction out = new_slacks_of(R, new_s, new_zl, new_zu);
  const auto misses = kernels().follow(at, vector("weights", R, weights), vector("y", R, y),
                                       vector("dy", R, dy), vector("y_new", R, y_new), mu,
                                       next_mu, least, out);
  return {misses.outside, misses.work};
}

}  // namespace

NB_MODULE(barrier, m) {
  m.def("condense", &condense, "lower"_a, "upper"_a, "s"_a, "zl"_a, "zu"_a, "y"_a, "mu"_a,
        "sigma"_a, "rho"_a, "force"_a);
  m.def("shift", &shift, "lower"_a, "upper"_a, "s"_a, "zl"_a, "zu"_a, "mu"_a, "lower_targets"_a,
        "upper_targets"_a, "out"_a);
  m.def("aim", &aim, "lower"_a, "upper"_a, "s"_a, "zl"_a, "zu"_a, "y"_a, "dy"_a,
        "lower_targets"_a, "upper_targets"_a, "matched"_a, "keep"_a, "ds"_a, "dzl"_a, "dzu"_a);
  m.def("mean_product", &mean_product, "lower"_a, "upper"_a, "s"_a, "zl"_a, "zu"_a, "ds"_a,
        "dzl"_a, "dzu"_a, "primal"_a, "dual"_a);
  m.def("largest_miss", &largest_miss, "lower"_a, "upper"_a, "s"_a, "zl"_a, "zu"_a, "mu"_a);
  m.def("correct", &correct, "lower"_a, "upper"_a, "s"_a, "zl"_a, "zu"_a, "y"_a, "ds"_a, "dzl"_a,
        "dzu"_a, "mu"_a, "matched"_a, "lower_targets"_a, "upper_targets"_a);
  m.def("center", &center, "lower"_a, "upper"_a, "s"_a, "zl"_a, "zu"_a, "y"_a, "ds"_a, "dzl"_a,
        "dzu"_a, "primal"_a, "dual"_a, "mu"_a, "matched"_a, "lower_targets"_a, "upper_targets"_a);
  m.def("merit", &merit, "lower"_a, "upper"_a, "s"_a, "zl"_a, "zu"_a, "weights"_a, "y"_a, "dy"_a,
        "ds"_a, "share"_a, "keep"_a, "mu"_a, "penalty"_a);
  m.def("move", &move, "lower"_a, "upper"_a, "s"_a, "zl"_a, "zu"_a, "y"_a, "ds"_a, "dzl"_a,
        "dzu"_a, "primal"_a, "dual"_a, "keep"_a, "mu"_a, "penalty"_a, "ratio"_a, "new_s"_a,
        "new_zl"_a, "new_zu"_a);
  m.def("recenter", &recenter, "lower"_a, "upper"_a, "s"_a, "zl"_a, "zu"_a, "c"_a, "mu"_a,
        "new_s"_a, "new_zl"_a, "new_zu"_a);
  m.def("follow", &follow, "lower"_a, "upper"_a, "s"_a, "zl"_a, "zu"_a, "weights"_a, "y"_a, "dy"_a,
        "y_new"_a, "mu"_a, "next_mu"_a, "least"_a, "new_s"_a, "new_zl"_a, "new_zu"_a);
}
