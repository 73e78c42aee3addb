// A joint tree as arrays from Python: see src/hovi/dynamics/joint_tree.py.
#pragma once

#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "joint_tree.hpp"
#include "simd/arrays.hpp"

namespace hovi::dynamics {

template <typename Scalar, nanobind::ssize_t... shape>
using JointArray = nanobind::ndarray<const Scalar, nanobind::numpy, nanobind::shape<-1, shape...>,
                                     nanobind::c_contig, nanobind::device::cpu>;

// One row for each joint.
struct JointArrays {
  JointArray<std::int64_t> parents, coordinates;
  JointArray<bool> continuous;
  JointArray<double, 3, 3> rotations;
  JointArray<double, 3> translations;
  JointArray<double> angular, linear, masses;
  JointArray<double, 3> centers;
  JointArray<double, 6> moments;
  JointArray<double> armatures;
};

struct BaseArrays {
  JointArray<std::int64_t> twist_indices;
  std::int64_t coordinate;
  bool planar;
};

// An index as the kernels store it; one that does not fit is out of bounds anyway.
inline int index(std::int64_t i) {
  if (i < -1 || i > std::numeric_limits<int>::max() / 2)
    throw std::invalid_argument("joint tree: an index is out of bounds: " + std::to_string(i));
  return static_cast<int>(i);
}

template <typename Array>
void require_rows(const char* name, const Array& array, std::size_t n) {
  if (array.shape(0) != n)
    throw std::invalid_argument("joint tree: expected " + std::to_string(n) + " rows in " + name +
                                ", got " + std::to_string(array.shape(0)));
}

inline void require_rows(const JointArrays& arrays) {
  const std::size_t n = arrays.parents.shape(0);
  require_rows("coordinates", arrays.coordinates, n);
  require_rows("continuous", arrays.continuous, n);
  require_rows("rotations", arrays.rotations, n);
  require_rows("translations", arrays.translations, n);
  require_rows("angular", arrays.angular, n);
  require_rows("linear", arrays.linear, n);
  require_rows("masses", arrays.masses, n);
  require_rows("centers", arrays.centers, n);
  require_rows("moments", arrays.moments, n);
  require_rows("armatures", arrays.armatures, n);
}

inline TreeJoint joint_at(const JointArrays& arrays, std::size_t k) {
  TreeJoint joint{};
  joint.parent = index(arrays.parents(k));
  joint.q = index(arrays.coordinates(k));
  joint.continuous = arrays.continuous(k);
  joint.angular = arrays.angular(k);
  joint.linear = arrays.linear(k);
  joint.mass = arrays.masses(k);
  joint.armature = arrays.armatures(k);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) joint.rotation[3 * j + i] = arrays.rotations(k, i, j);
    joint.translation[i] = arrays.translations(k, i);
    joint.center[i] = arrays.centers(k, i);
  }
  for (std::size_t i = 0; i < 6; ++i) joint.moment[i] = arrays.moments(k, i);
  return joint;
}

inline TreeBase base_of(const BaseArrays& arrays) {
  TreeBase base{};
  if (arrays.twist_indices.shape(0) > 6)
    throw std::invalid_argument("joint tree: a base has at most six components");
  base.size = static_cast<int>(arrays.twist_indices.shape(0));
  for (int k = 0; k < base.size; ++k) base.twist_indices[k] = index(arrays.twist_indices(k));
  base.q = index(arrays.coordinate);
  base.planar = arrays.planar;
  return base;
}

// Throws std::invalid_argument if the arrays do not form a tree.
inline JointTree joint_tree(const JointArrays& arrays, const BaseArrays& base,
                            const double* gravity, std::int64_t nq) {
  require_rows(arrays);
  std::vector<TreeJoint> joints;
  for (std::size_t k = 0; k < arrays.parents.shape(0); ++k) joints.push_back(joint_at(arrays, k));
  return {std::move(joints), index(nq), base_of(base), gravity};
}

}  // namespace hovi::dynamics
