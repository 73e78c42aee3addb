// The Python binding.
#include <casadi/config.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <pinocchio/config.hpp>

#include "model.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using hovi::symbolic::SymbolicModel;

NB_MODULE(symbolic, m) {
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
}
