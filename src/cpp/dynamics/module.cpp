// The Python binding. Shapes and types are checked by the Python side that calls it.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <optional>

#include <casadi/config.h>
#include <nanobind/stl/optional.h>
#include <pinocchio/config.hpp>

#include "kernel.hpp"
#include "symbolic_model.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using hovi::Expansion;
using hovi::InverseDynamicsKernel;
using hovi::Points;
using hovi::SymbolicModel;

namespace {

template <typename Scalar, int dimensions>
using Array = nb::ndarray<Scalar, nb::numpy, nb::ndim<dimensions>, nb::c_contig, nb::device::cpu>;
using Input = Array<const double, 2>;

Points points_of(const Input& q, const Input& v, const Input& a) {
  return {q.shape(0), q.data(), v.data(), a.data()};
}

void torque(InverseDynamicsKernel& self, const Input& q, const Input& v, const Input& a,
            const Array<double, 2>& tau, int threads) {
  const Points points = points_of(q, v, a);
  const Expansion out{tau.data()};
  const nb::gil_scoped_release released;
  self.expand(points, {}, out, threads);
}

void linearize(InverseDynamicsKernel& self, const Input& q, const Input& v, const Input& a,
               const Array<double, 2>& tau, const Array<double, 3>& jacobian, int threads) {
  const Points points = points_of(q, v, a);
  const Expansion out{tau.data(), jacobian.data()};
  const nb::gil_scoped_release released;
  self.expand(points, {}, out, threads);
}

void expand(InverseDynamicsKernel& self, const Input& q, const Input& v, const Input& a,
            const Input& weight, const std::optional<Input>& curvature,
            const Array<double, 2>& tau, const Array<double, 3>& jacobian,
            const Array<double, 3>& hessian, int threads) {
  const Points points = points_of(q, v, a);
  const hovi::Multipliers multipliers{weight.data(), curvature ? curvature->data() : nullptr};
  const Expansion out{tau.data(), jacobian.data(), hessian.data()};
  const nb::gil_scoped_release released;
  self.expand(points, multipliers, out, threads);
}

double time_pinocchio_calls(const std::string& archive, const Input& q, const Input& v,
                            const Input& a, int repeats) {
  return hovi::time_pinocchio_calls(archive, points_of(q, v, a), repeats);
}

}  // namespace

NB_MODULE(_core, m) {
  // What is alive as an interrupted program ends is no leak.
  m.def("ignore_leaks", [] { nb::set_leak_warnings(false); });

  m.attr("pinocchio_version") = PINOCCHIO_VERSION;
  m.attr("casadi_version") = CASADI_VERSION_STRING;

  nb::class_<SymbolicModel>(m, "SymbolicModel")
      .def(nb::init<const std::string&>(), "archive"_a)
      .def("inverse_dynamics", &SymbolicModel::inverse_dynamics)
      .def("mass_matrix", &SymbolicModel::mass_matrix)
      .def("generalized_gravity", &SymbolicModel::generalized_gravity)
      .def("kinetic_energy", &SymbolicModel::kinetic_energy)
      .def("potential_energy", &SymbolicModel::potential_energy)
      .def("frame_placement", &SymbolicModel::frame_placement, "frame"_a);

  nb::class_<InverseDynamicsKernel>(m, "InverseDynamicsKernel")
      .def(nb::init<const std::string&, bool>(), "archive"_a, "portable"_a = false)
      .def_prop_ro("nq", &InverseDynamicsKernel::nq)
      .def_prop_ro("n", &InverseDynamicsKernel::n)
      .def("torque", &torque, "q"_a, "v"_a, "a"_a, "tau"_a, "threads"_a)
      .def("linearize", &linearize, "q"_a, "v"_a, "a"_a, "tau"_a, "jacobian"_a, "threads"_a)
      .def("expand", &expand, "q"_a, "v"_a, "a"_a, "weight"_a, "curvature"_a.none(), "tau"_a,
           "jacobian"_a, "hessian"_a, "threads"_a);

  m.def("time_pinocchio_calls", &time_pinocchio_calls, "archive"_a, "q"_a, "v"_a, "a"_a,
        "repeats"_a);
}
