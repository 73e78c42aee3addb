// Pairs of a robot's shapes and obstacles, checked, and their distances.
#pragma once

#include <cstddef>
#include <vector>

#include "kernels.hpp"

namespace hovi::distances {

struct Hull {
  std::vector<double> points;
  std::vector<std::vector<std::size_t>> neighbors;
};

class PairDistances {
 public:
  // points: of each shape, three numbers each, and the neighbors of each point, or none; `first`,
  // `count` and `linked` of the shapes and the columns of the pairs are set here. Throws std::invalid_argument for numbers that are out of range.
  // portable: see choose_kernels.
  PairDistances(std::size_t nq, std::size_t nv, std::vector<Joint> joints,
                std::vector<Shape> shapes, const std::vector<Hull>& hulls,
                std::vector<Pair> pairs, bool portable);

  std::size_t nq() const { return nq_; }
  std::size_t nv() const { return nv_; }
  std::size_t size() const { return pairs_.size(); }

  void measure(const Request& request, const Answer& answer) const;

 private:
  void check() const;
  void pack(const std::vector<Hull>& hulls);
  void relate(Pair& pair);
  Model model() const;

  std::size_t nq_, nv_, most_columns_ = 0;
  std::vector<Joint> joints_;
  std::vector<Shape> shapes_;
  std::vector<Pair> pairs_;
  std::vector<PairColumn> columns_;
  std::vector<double> x_, y_, z_;
  std::vector<std::size_t> first_neighbor_, neighbors_;
  const Kernels& kernels_;
};

}  // namespace hovi::distances
