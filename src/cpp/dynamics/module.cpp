// The Python binding.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "inverse_dynamics_kernel.hpp"
#include "joint_arrays.hpp"
#include "simd/arrays.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hovi::arrays;
using hovi::dynamics::Expansion;
using hovi::dynamics::InverseDynamicsKernel;
using hovi::dynamics::Multipliers;
using hovi::dynamics::Points;

namespace {

template <typename Scalar, nb::ssize_t... shape>
using Rows = hovi::dynamics::JointArray<Scalar, shape...>;
using Twist = nb::ndarray<const double, nb::numpy, nb::shape<6>, nb::c_contig, nb::device::cpu>;

void construct(InverseDynamicsKernel* self, std::int64_t nq, const Twist& gravity,
               const Rows<std::int64_t>& parents, const Rows<std::int64_t>& coordinates,
               const Rows<bool>& continuous, const Rows<double, 3, 3>& rotations,
               const Rows<double, 3>& translations, const Rows<double>& angular,
               const Rows<double>& linear, const Rows<double>& masses,
               const Rows<double, 3>& centers, const Rows<double, 6>& moments,
               const Rows<double>& armatures, const Rows<std::int64_t>& base_twist_indices,
               std::int64_t base_coordinate, bool planar_base, bool portable) {
  auto tree = hovi::dynamics::joint_tree({parents, coordinates, continuous, rotations, translations,
                                          angular, linear, masses, centers, moments, armatures},
                                         {base_twist_indices, base_coordinate, planar_base},
                                         gravity.data(), nq);
  new (self) InverseDynamicsKernel(std::move(tree), portable);
}

void require_shape(const char* name, bool holds) {
  if (!holds) throw std::invalid_argument(std::string(name) + " has the wrong shape");
}

// (P, columns).
template <typename Scalar>
Scalar* rows_of(const char* name, const Array<Scalar, 2>& rows, std::size_t points,
                std::size_t columns) {
  require_shape(name, rows.shape(0) == points && rows.shape(1) == columns);
  return rows.data();
}

// (P, rows, 3n).
double* blocks_of(const char* name, const Output<3>& blocks, std::size_t points, std::size_t rows,
                  std::size_t n) {
  require_shape(name,
                blocks.shape(0) == points && blocks.shape(1) == rows && blocks.shape(2) == 3 * n);
  return blocks.data();
}

Points points_of(const InverseDynamicsKernel& self, const Input<2>& q, const Input<2>& v,
                 const Input<2>& a) {
  const std::size_t count = q.shape(0), n = self.n();
  return {count, rows_of("q", q, count, self.nq()), rows_of("v", v, count, n),
          rows_of("a", a, count, n)};
}

void torque(InverseDynamicsKernel& self, const Input<2>& q, const Input<2>& v, const Input<2>& a,
            const Output<2>& tau, int threads) {
  const Points points = points_of(self, q, v, a);
  const Expansion out{rows_of("tau", tau, points.count, self.n())};
  const nb::gil_scoped_release released;
  self.expand(points, {}, out, threads);
}

void linearize(InverseDynamicsKernel& self, const Input<2>& q, const Input<2>& v, const Input<2>& a,
               const Output<2>& tau, const Output<3>& jacobian, int threads) {
  const Points points = points_of(self, q, v, a);
  const std::size_t n = self.n();
  const Expansion out{rows_of("tau", tau, points.count, n),
                      blocks_of("jacobian", jacobian, points.count, n, n)};
  const nb::gil_scoped_release released;
  self.expand(points, {}, out, threads);
}

void expand(InverseDynamicsKernel& self, const Input<2>& q, const Input<2>& v, const Input<2>& a,
            const Input<2>& weight, const std::optional<Input<2>>& curvature, const Output<2>& tau,
            const Output<3>& jacobian, const Output<3>& hessian, int threads) {
  const Points points = points_of(self, q, v, a);
  const std::size_t count = points.count, n = self.n();
  const Multipliers multipliers{rows_of("weight", weight, count, n),
                                curvature ? rows_of("curvature", *curvature, count, n) : nullptr};
  const Expansion out{rows_of("tau", tau, count, n), blocks_of("jacobian", jacobian, count, n, n),
                      blocks_of("hessian", hessian, count, 3 * n, n)};
  const nb::gil_scoped_release released;
  self.expand(points, multipliers, out, threads);
}

}  // namespace

NB_MODULE(dynamics, m) {
  // Objects that are alive when an interrupted program ends are not leaks.
  m.def("ignore_leaks", [] { nb::set_leak_warnings(false); });

  const auto exact = [](const char* name) { return nb::arg(name).noconvert(); };
  nb::class_<InverseDynamicsKernel>(m, "InverseDynamicsKernel")
      .def("__init__", &construct, "nq"_a, exact("gravity"), exact("parents"),
           exact("coordinates"), exact("continuous"), exact("rotations"), exact("translations"),
           exact("angular"), exact("linear"), exact("masses"), exact("centers"), exact("moments"),
           exact("armatures"), exact("base_twist_indices"), "base_coordinate"_a, "planar_base"_a,
           "portable"_a = false)
      .def_prop_ro("nq", &InverseDynamicsKernel::nq)
      .def_prop_ro("n", &InverseDynamicsKernel::n)
      .def("torque", &torque, "q"_a, "v"_a, "a"_a, "tau"_a, "threads"_a)
      .def("linearize", &linearize, "q"_a, "v"_a, "a"_a, "tau"_a, "jacobian"_a, "threads"_a)
      .def("expand", &expand, "q"_a, "v"_a, "a"_a, "weight"_a, "curvature"_a.none(), "tau"_a,
           "jacobian"_a, "hessian"_a, "threads"_a);
}
