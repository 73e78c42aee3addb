// The Python binding, which checks its arguments against each other.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>

#include <optional>
#include <utility>

#include "inverse_dynamics_kernel.hpp"
#include "joint_arrays.hpp"
#include "sampling/binding.hpp"
#include "simd/arrays.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hovi::arrays;
using hovi::dynamics::Expansion;
using hovi::dynamics::InverseDynamicsKernel;
using hovi::dynamics::Multipliers;
using hovi::dynamics::Points;

namespace {

void construct(InverseDynamicsKernel* self, std::int64_t nq, const Input<1>& gravity,
               const Index& parents, const Index& coordinates,
               const Array<const bool, 1>& continuous, const Input<3>& rotations,
               const Input<2>& translations, const Input<1>& angular, const Input<1>& linear,
               const Input<1>& masses, const Input<2>& centers, const Input<2>& moments,
               const Input<1>& armatures, const Index& base_twist_indices,
               std::int64_t base_coordinate, bool planar_base, bool portable) {
  auto tree = hovi::dynamics::joint_tree({parents, coordinates, continuous, rotations, translations,
                                          angular, linear, masses, centers, moments, armatures},
                                         {base_twist_indices, base_coordinate, planar_base},
                                         gravity, nq);
  new (self) InverseDynamicsKernel(std::move(tree), portable);
}

Points points_of(const InverseDynamicsKernel& self, const Input<2>& q, const Input<2>& v,
                 const Input<2>& a) {
  q.require_kind("q");
  const std::size_t count = q.shape(0), n = self.n();
  q.require("q", {count, self.nq()});
  v.require("v", {count, n});
  a.require("a", {count, n});
  return {count, q.data(), v.data(), a.data()};
}

void torque(InverseDynamicsKernel& self, const Input<2>& q, const Input<2>& v, const Input<2>& a,
            const Output<2>& tau, int threads) {
  const Points points = points_of(self, q, v, a);
  tau.require("tau", {points.count, self.n()});
  const nb::gil_scoped_release released;
  self.expand(points, {}, {tau.data()}, threads);
}

void linearize(InverseDynamicsKernel& self, const Input<2>& q, const Input<2>& v, const Input<2>& a,
               const Output<2>& tau, const Output<3>& jacobian, int threads) {
  const Points points = points_of(self, q, v, a);
  const std::size_t n = self.n();
  tau.require("tau", {points.count, n});
  jacobian.require("jacobian", {points.count, n, 3 * n});
  const nb::gil_scoped_release released;
  self.expand(points, {}, {tau.data(), jacobian.data()}, threads);
}

void expand(InverseDynamicsKernel& self, const Input<2>& q, const Input<2>& v, const Input<2>& a,
            const Input<2>& weight, const std::optional<Input<2>>& curvature, const Output<2>& tau,
            const Output<3>& jacobian, const Output<3>& hessian, int threads) {
  const Points points = points_of(self, q, v, a);
  const std::size_t count = points.count, n = self.n();
  weight.require("weight", {count, n});
  const Multipliers multipliers{weight.data(), data_or_null("curvature", curvature, {count, n})};
  tau.require("tau", {count, n});
  jacobian.require("jacobian", {count, n, 3 * n});
  hessian.require("hessian", {count, 3 * n, 3 * n});
  const nb::gil_scoped_release released;
  self.expand(points, multipliers, {tau.data(), jacobian.data(), hessian.data()}, threads);
}

}  // namespace

NB_MODULE(dynamics, m) {
  // Objects that are alive when an interrupted program ends are not leaks.
  m.def("ignore_leaks", [] { nb::set_leak_warnings(false); });

  nb::class_<InverseDynamicsKernel>(m, "InverseDynamicsKernel")
      .def("__init__", &construct, "nq"_a, "gravity"_a, "parents"_a, "coordinates"_a,
           "continuous"_a, "rotations"_a, "translations"_a, "angular"_a, "linear"_a, "masses"_a,
           "centers"_a, "moments"_a, "armatures"_a, "base_twist_indices"_a, "base_coordinate"_a,
           "planar_base"_a, "portable"_a = false)
      .def_prop_ro("nq", &InverseDynamicsKernel::nq)
      .def_prop_ro("n", &InverseDynamicsKernel::n)
      .def("torque", &torque, "q"_a, "v"_a, "a"_a, "tau"_a, "threads"_a)
      .def("linearize", &linearize, "q"_a, "v"_a, "a"_a, "tau"_a, "jacobian"_a, "threads"_a)
      .def("expand", &expand, "q"_a, "v"_a, "a"_a, "weight"_a, "curvature"_a.none(), "tau"_a,
           "jacobian"_a, "hessian"_a, "threads"_a);

  hovi::sampling::bind(m);
}
