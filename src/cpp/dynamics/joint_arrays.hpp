// A joint tree as arrays from Python: see src/hovi/dynamics/joint_tree.py.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "joint_tree.hpp"
#include "simd/arrays.hpp"

namespace hovi::dynamics {

// One row for each joint.
struct JointArrays {
  arrays::Index parents, coordinates;
  arrays::Array<const bool, 1> continuous;
  arrays::Input<3> rotations;
  arrays::Input<2> translations;
  arrays::Input<1> angular, linear, masses;
  arrays::Input<2> centers, moments;
  arrays::Input<1> armatures;
};

struct BaseArrays {
  arrays::Index twist_indices;
  std::int64_t coordinate;
  bool planar;
};

// An index as the kernels store it; one that does not fit is out of bounds anyway.
inline int index(std::int64_t i) {
  if (i < -1 || i > std::numeric_limits<int>::max() / 2)
    arrays::refuse("joint tree: an index is out of bounds: " + std::to_string(i) + ".");
  return static_cast<int>(i);
}

inline void require_rows(const JointArrays& arrays) {
  arrays.parents.require_kind("parents");
  const std::size_t n = arrays.parents.shape(0);
  arrays.coordinates.require("coordinates", {n});
  arrays.continuous.require("continuous", {n});
  arrays.rotations.require("rotations", {n, 3, 3});
  arrays.translations.require("translations", {n, 3});
  arrays.angular.require("angular", {n});
  arrays.linear.require("linear", {n});
  arrays.masses.require("masses", {n});
  arrays.centers.require("centers", {n, 3});
  arrays.moments.require("moments", {n, 6});
  arrays.armatures.require("armatures", {n});
}

inline TreeJoint joint_at(const JointArrays& arrays, std::size_t k) {
  TreeJoint joint{};
  joint.parent = index(arrays.parents.data()[k]);
  joint.q = index(arrays.coordinates.data()[k]);
  joint.continuous = arrays.continuous.data()[k];
  joint.angular = arrays.angular.data()[k];
  joint.linear = arrays.linear.data()[k];
  joint.mass = arrays.masses.data()[k];
  joint.armature = arrays.armatures.data()[k];
  const double* const rotation = arrays.rotations.data() + 9 * k;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) joint.rotation[3 * j + i] = rotation[3 * i + j];
    joint.translation[i] = arrays.translations.data()[3 * k + i];
    joint.center[i] = arrays.centers.data()[3 * k + i];
  }
  for (std::size_t i = 0; i < 6; ++i) joint.moment[i] = arrays.moments.data()[6 * k + i];
  return joint;
}

inline TreeBase base_of(const BaseArrays& arrays) {
  TreeBase base{};
  arrays.twist_indices.require_kind("base_twist_indices");
  if (arrays.twist_indices.shape(0) > 6)
    arrays::refuse("joint tree: a base has at most six components.");
  base.size = static_cast<int>(arrays.twist_indices.shape(0));
  for (int k = 0; k < base.size; ++k) base.twist_indices[k] = index(arrays.twist_indices.data()[k]);
  base.q = index(arrays.coordinate);
  base.planar = arrays.planar;
  return base;
}

// Throws ValueError if the arrays do not form a tree, TypeError for arrays of other kinds.
inline JointTree joint_tree(const JointArrays& arrays, const BaseArrays& base,
                            const arrays::Input<1>& gravity, std::int64_t nq) {
  gravity.require("gravity", {6});
  require_rows(arrays);
  std::vector<TreeJoint> joints;
  for (std::size_t k = 0; k < arrays.parents.shape(0); ++k) joints.push_back(joint_at(arrays, k));
  return {std::move(joints), index(nq), base_of(base), gravity.data()};
}

}  // namespace hovi::dynamics
