// Several configurations in which a frame meets a target.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "chain.hpp"
#include "descent.hpp"
#include "seeds.hpp"
#include "target.hpp"

namespace hovi::kinematics {

constexpr std::size_t seeds_by_pose = 64;

struct Search {
  const double* near;    // (n,): the first seed
  double apart;          // [rad] or [m]: configurations that differ less in every joint are one
  std::size_t seeds;     // at most
  std::size_t patience;  // seeds in a row without a new configuration after which it ends
  std::size_t most;      // configurations
};

struct Found {
  double* configurations;  // (most, n)
  double* best;            // (n,): that which comes nearest to the target
  std::size_t count, seeds;
};

class InverseKinematicsKernel {
 public:
  explicit InverseKinematicsKernel(Chain chain) : chain_(std::move(chain)), table_(chain_) {}

  std::size_t n() const { return chain_.size(); }

  void search(const Target& target, const Search& search, Found& found) const {
    const std::size_t n = chain_.size();
    const auto order = table_.nearest(target, std::min(search.seeds, seeds_by_pose));
    Descent descent(chain_);
    Random random(2);
    std::vector<double> q(n);
    double least = INFINITY;
    std::size_t last = 0;
    std::copy_n(search.near, n, found.best);
    for (found.count = found.seeds = 0; found.seeds < search.seeds; ++found.seeds) {
      if (found.count >= search.most) break;
      if (found.count && found.seeds - last > search.patience) break;
      const std::size_t i = found.seeds;
      if (i == 0)
        std::copy_n(search.near, n, q.data());
      else if (i <= order.size())
        std::copy_n(table_[order[i - 1]], n, q.data());
      else
        draw(chain_, random, q.data());
      keep_inside(q.data());
      const Miss miss = descent.run(target, q.data());
      wrap(search.near, q.data());
      const double error = miss.distance + miss.angle;
      if (error < least) {
        least = error;
        std::copy_n(q.data(), n, found.best);
      }
      if (!Descent::met(miss, accepted) || is_known(q.data(), search.apart, found)) continue;
      std::copy_n(q.data(), n, found.configurations + n * found.count++);
      last = found.seeds;
    }
  }

 private:
  void keep_inside(double* q) const {
    for (std::size_t k = 0; k < chain_.size(); ++k)
      if (!chain_[k].turns_freely())
        q[k] = std::min(std::max(q[k], chain_[k].lower), chain_[k].upper);
  }

  // Turns joints by full turns to within their bounds, as near to `near` as they allow.
  void wrap(const double* near, double* q) const {
    for (std::size_t k = 0; k < chain_.size(); ++k) {
      const ChainJoint& joint = chain_[k];
      if (joint.angular == 0 || joint.linear != 0) continue;
      constexpr double turn = 2 * M_PI, far = 1e4;  // beyond it angles lose digits
      const double to = std::fabs(near[k]) < far ? near[k] : 0;
      double x = q[k] + turn * std::round((to - q[k]) / turn);
      if (x > joint.upper) x -= turn * std::ceil((x - joint.upper) / turn);
      if (x < joint.lower) x += turn * std::ceil((joint.lower - x) / turn);
      if (x >= joint.lower && x <= joint.upper) q[k] = x;
    }
  }

  bool is_known(const double* q, double apart, const Found& found) const {
    const std::size_t n = chain_.size();
    for (std::size_t i = 0; i < found.count; ++i) {
      double most = 0;
      for (std::size_t k = 0; k < n; ++k) {
        double d = q[k] - found.configurations[n * i + k];
        if (chain_[k].angular != 0 && chain_[k].linear == 0) d = std::remainder(d, 2 * M_PI);
        most = std::max(most, std::fabs(d));
      }
      if (most < apart) return true;
    }
    return false;
  }

  Chain chain_;
  SeedTable table_;
};

}  // namespace hovi::kinematics
