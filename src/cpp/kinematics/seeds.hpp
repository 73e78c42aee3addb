// Where searches begin: configurations all over the ranges of the joints, with their poses.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "chain.hpp"
#include "target.hpp"

namespace hovi::kinematics {

constexpr std::size_t table_size = 2048;
constexpr double free_length = 1.0;  // [m] or [rad]: how far a joint without bounds is tried

// Uniform numbers in [0, 1), the same on every machine: splitmix64.
class Random {
 public:
  explicit Random(std::uint64_t state) : state_(state) {}

  double operator()() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

inline void draw(const Chain& chain, Random& random, double* q) {
  for (std::size_t k = 0; k < chain.size(); ++k) {
    const ChainJoint& joint = chain[k];
    double low = joint.lower, high = joint.upper;
    if (joint.turns_freely()) {
      low = -M_PI;
      high = M_PI;
    } else if (!(high - low < 1e15)) {
      low = std::max(low, high < 1e15 ? high - 2 * free_length : -free_length);
      high = std::min(high, low + 2 * free_length);
    }
    q[k] = low + (high - low) * random();
  }
}

class SeedTable {
 public:
  explicit SeedTable(const Chain& chain)
      : n_(chain.size()), q_(table_size * n_), poses_(12 * table_size) {
    Random random(1);
    std::vector<Axis> axes(n_);
    for (std::size_t i = 0; i < table_size; ++i) {
      draw(chain, random, q_.data() + n_ * i);
      const Pose pose = chain.place(q_.data() + n_ * i, axes.data());
      for (int j = 0; j < 9; ++j) poses_[table_size * j + i] = float(pose.R[j]);
      for (int j = 0; j < 3; ++j) poses_[table_size * (9 + j) + i] = float(pose.p[j]);
    }
  }

  const double* operator[](std::size_t i) const { return q_.data() + n_ * i; }

  // The `count` entries that are nearest to the target, nearest first.
  std::vector<std::uint32_t> nearest(const Target& target, std::size_t count) const {
    std::vector<float> distance(table_size, 0.0f);
    if (target.has_position)
      for (int i = 0; i < 3; ++i) add(distance, 9 + i, target.pose.p[i], target.weight);
    if (target.has_rotation)
      for (int j = 0; j < 9; ++j) add(distance, j, target.pose.R[j], std::sqrt(0.5));
    if (target.has_axis) add_axis(distance, target);
    std::vector<std::uint32_t> order(table_size);
    std::iota(order.begin(), order.end(), 0u);
    for (float& d : distance)
      if (!(d < 1e30f)) d = 1e30f;
    count = std::min(count, table_size);
    const auto nearer = [&](std::uint32_t a, std::uint32_t b) {
      return distance[a] < distance[b] || (distance[a] == distance[b] && a < b);
    };
    std::nth_element(order.begin(), order.begin() + (count ? count - 1 : 0), order.end(), nearer);
    order.resize(count);
    std::sort(order.begin(), order.end(), nearer);
    return order;
  }

 private:
  void add(std::vector<float>& distance, int entry, double value, double weight) const {
    const float* column = poses_.data() + table_size * entry;
    const float to = float(value), share = float(weight * weight);
    for (std::size_t i = 0; i < table_size; ++i)
      distance[i] += share * (column[i] - to) * (column[i] - to);
  }

  void add_axis(std::vector<float>& distance, const Target& target) const {
    for (std::size_t i = 0; i < table_size; ++i)
      for (int row = 0; row < 3; ++row) {
        float x = -float(target.world[row]);
        for (int j = 0; j < 3; ++j)
          x += float(target.inner[j]) * poses_[table_size * (3 * j + row) + i];
        distance[i] += x * x;
      }
  }

  std::size_t n_;
  std::vector<double> q_;
  std::vector<float> poses_;  // 12 columns: rotation by columns, translation
};

}  // namespace hovi::kinematics
