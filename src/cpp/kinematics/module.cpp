// The Python binding, which checks its arguments against each other.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "inverse_kinematics_kernel.hpp"
#include "simd/arrays.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hovi::arrays;
using namespace hovi::kinematics;

namespace {

constexpr std::size_t max_joints = 1000;
constexpr std::int64_t max_seeds = 100000;

// Row-major to columns.
void columns_of(const double* rows, double* columns) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) columns[3 * j + i] = rows[3 * i + j];
}

void construct(InverseKinematicsKernel* self, const Input<3>& rotations,
               const Input<2>& translations, const Input<1>& angular, const Input<1>& linear,
               const Input<2>& tip_rotation, const Input<1>& tip_translation,
               const Input<1>& lower, const Input<1>& upper) {
  angular.require_kind("angular");
  const std::size_t n = angular.shape(0);
  if (n == 0 || n > max_joints)
    refuse("a chain has 1 to " + std::to_string(max_joints) + " joints, got " + std::to_string(n) +
           ".");
  rotations.require("rotations", {n, 3, 3});
  translations.require("translations", {n, 3});
  linear.require("linear", {n});
  tip_rotation.require("tip_rotation", {3, 3});
  tip_translation.require("tip_translation", {3});
  lower.require("lower", {n});
  upper.require("upper", {n});
  std::vector<ChainJoint> joints(n);
  for (std::size_t k = 0; k < n; ++k) {
    ChainJoint& joint = joints[k];
    columns_of(rotations.data() + 9 * k, joint.placement.R);
    std::copy_n(translations.data() + 3 * k, 3, joint.placement.p);
    joint.angular = angular.data()[k];
    joint.linear = linear.data()[k];
    joint.lower = lower.data()[k];
    joint.upper = upper.data()[k];
    if (!(joint.lower <= joint.upper))
      refuse("joint " + std::to_string(k) + " must have a lower bound of at most its upper one.");
  }
  Pose tip;
  columns_of(tip_rotation.data(), tip.R);
  std::copy_n(tip_translation.data(), 3, tip.p);
  new (self) InverseKinematicsKernel(Chain(std::move(joints), tip));
}

// Two directions orthogonal to a unit vector and to each other.
void across(const double* z, double* directions) {
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (std::fabs(z[i]) < std::fabs(z[least])) least = i;
  double aside[3] = {0, 0, 0};
  aside[least] = 1;
  cross(z, aside, directions);
  const double length = std::sqrt(dot(directions, directions));
  for (int i = 0; i < 3; ++i) directions[i] /= length;
  cross(z, directions, directions + 3);
}

Target target_of(const std::optional<Input<1>>& position, const std::optional<Input<2>>& rotation,
                 const std::optional<Input<2>>& axis, double weight) {
  Target target{};
  target.weight = weight;
  target.has_position = position.has_value();
  target.has_rotation = rotation.has_value();
  target.has_axis = axis.has_value();
  if (target.has_rotation && target.has_axis) refuse("a target has a rotation or an axis.");
  if (target.rows() == 0) refuse("a target has a position, a rotation or an axis.");
  if (position) {
    position->require("position", {3});
    std::copy_n(position->data(), 3, target.pose.p);
  }
  if (rotation) {
    rotation->require("rotation", {3, 3});
    columns_of(rotation->data(), target.pose.R);
  }
  if (axis) {
    axis->require("axis", {2, 3});
    std::copy_n(axis->data(), 3, target.inner);
    std::copy_n(axis->data() + 3, 3, target.world);
    across(target.world, target.across);
  }
  return target;
}

std::size_t count_of(const char* name, std::int64_t count) {
  if (count < 1 || count > max_seeds)
    refuse(std::string(name) + " must be 1 to " + std::to_string(max_seeds) + ", got " +
           std::to_string(count) + ".");
  return static_cast<std::size_t>(count);
}

std::pair<std::size_t, std::size_t> search(
    const InverseKinematicsKernel& self, const std::optional<Input<1>>& position,
    const std::optional<Input<2>>& rotation, const std::optional<Input<2>>& axis, double weight,
    const Input<1>& near, double apart, std::int64_t seeds, std::int64_t patience,
    const Output<2>& configurations, const Output<1>& best) {
  const Target target = target_of(position, rotation, axis, weight);
  near.require("near", {self.n()});
  best.require("best", {self.n()});
  configurations.require_kind("configurations");
  const std::size_t most = configurations.shape(0);
  configurations.require("configurations", {most, self.n()});
  const Search given{near.data(), apart, count_of("seeds", seeds), count_of("patience", patience),
                     most};
  Found found{configurations.data(), best.data(), 0, 0};
  const nb::gil_scoped_release released;
  self.search(target, given, found);
  std::fill(configurations.data() + self.n() * found.count,
            configurations.data() + self.n() * most, 0.0);
  return {found.count, found.seeds};
}

}  // namespace

NB_MODULE(kinematics, m) {
  nb::set_leak_warnings(false);  // objects that are alive when an interrupted program ends
  nb::class_<InverseKinematicsKernel>(m, "InverseKinematicsKernel")
      .def("__init__", &construct, "rotations"_a, "translations"_a, "angular"_a, "linear"_a,
           "tip_rotation"_a, "tip_translation"_a, "lower"_a, "upper"_a)
      .def_prop_ro("n", &InverseKinematicsKernel::n)
      .def("search", &search, "position"_a.none(), "rotation"_a.none(), "axis"_a.none(),
           "weight"_a, "near"_a, "apart"_a, "seeds"_a, "patience"_a, "configurations"_a, "best"_a);
}
