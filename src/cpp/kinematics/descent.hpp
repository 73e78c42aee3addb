// Levenberg and Marquardt's method within bounds, from one seed.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "chain.hpp"
#include "target.hpp"

namespace hovi::kinematics {

constexpr int max_iterations = 60;
constexpr double tolerance = 1e-12;   // [m] and [rad]: where the iteration ends
constexpr double accepted = 5e-10;    // where it stalls, this is met, too
constexpr double max_step = 1.0;      // [rad] or [m], of a joint
constexpr double stall_ratio = 0.9;   // of successive squares above which a step counts as stalled
constexpr int max_stalled = 6;        // consecutive ones after which a seed is given up
constexpr int max_passes = 4;         // in which joints are stopped at their bounds

class Descent {
 public:
  explicit Descent(const Chain& chain)
      : chain_(chain), axes_(chain.size()), columns_(max_rows * chain.size()),
        step_(chain.size()), trial_(chain.size()), stopped_(chain.size()) {}

  // Moves q (n,), and returns how far it ends from the target.
  Miss run(const Target& target, double* q) {
    Pose pose = chain_.place(q, axes_.data());
    Miss miss = miss_of(target, pose);
    double damping = 0.1;
    int stalled = 0;
    bool moved = true;
    for (int i = 0; i < max_iterations && !met(miss, tolerance); ++i) {
      if (moved) slopes(target, chain_, pose, axes_.data(), columns_.data());
      propose(miss, target.rows(), damping * miss.square + 1e-14, q);
      const Pose next = chain_.place(trial_.data(), axes_.data());
      const Miss left = miss_of(target, next);
      moved = left.square < miss.square;
      stalled = left.square > stall_ratio * miss.square ? stalled + 1 : 0;
      damping = moved ? 0.25 * damping : 16 * damping;
      if (moved) {
        std::copy(trial_.begin(), trial_.end(), q);
        pose = next;
        miss = left;
      }
      if (stalled >= max_stalled || !(left.square < 1e300)) break;
    }
    return miss;
  }

  static bool met(const Miss& miss, double within) {
    return miss.distance <= within && miss.angle <= within;
  }

 private:
  // The step J^T (J J^T + damping)^-1 rows from q, with joints stopped at their bounds.
  void propose(const Miss& miss, int m, double damping, const double* q) {
    const std::size_t n = chain_.size();
    double rows[max_rows];
    std::copy_n(miss.rows, max_rows, rows);
    for (std::size_t k = 0; k < n; ++k) stopped_[k] = pushes_outwards(k, q[k], rows, m);
    for (std::size_t k = 0; k < n; ++k) step_[k] = 0;
    for (int pass = 0; pass < max_passes; ++pass) {
      solve(rows, m, damping);
      if (!stop_at_bounds(rows, m, q)) break;
    }
    double size = 0;
    for (std::size_t k = 0; k < n; ++k) size = std::max(size, std::fabs(step_[k]));
    const double share = size > max_step ? max_step / size : 1.0;
    for (std::size_t k = 0; k < n; ++k) {
      trial_[k] = q[k] + share * step_[k];
      if (!chain_[k].turns_freely())
        trial_[k] = std::min(std::max(trial_[k], chain_[k].lower), chain_[k].upper);
    }
  }

  bool pushes_outwards(std::size_t k, double q, const double* rows, int m) const {
    const ChainJoint& joint = chain_[k];
    if (joint.turns_freely() || (q > joint.lower && q < joint.upper)) return false;
    double slope = 0;
    for (int i = 0; i < m; ++i) slope += columns_[max_rows * k + i] * rows[i];
    return q <= joint.lower ? slope <= 0 : slope >= 0;
  }

  // The step of the joints that are not stopped.
  void solve(const double* rows, int m, double damping) {
    double A[max_rows][max_rows] = {}, y[max_rows];
    for (int i = 0; i < m; ++i) A[i][i] = damping;
    for (std::size_t k = 0; k < chain_.size(); ++k) {
      if (stopped_[k]) continue;
      const double* column = columns_.data() + max_rows * k;
      for (int i = 0; i < m; ++i)
        for (int j = 0; j <= i; ++j) A[i][j] += column[i] * column[j];
    }
    for (int i = 0; i < m; ++i) {  // Cholesky
      for (int j = 0; j <= i; ++j) {
        double sum = A[i][j];
        for (int k = 0; k < j; ++k) sum -= A[i][k] * A[j][k];
        A[i][j] = i == j ? std::sqrt(std::max(sum, 1e-300)) : sum / A[j][j];
      }
      double sum = rows[i];
      for (int k = 0; k < i; ++k) sum -= A[i][k] * y[k];
      y[i] = sum / A[i][i];
    }
    for (int i = m; i-- > 0;) {
      for (int k = i + 1; k < m; ++k) y[i] -= A[k][i] * y[k];
      y[i] /= A[i][i];
    }
    for (std::size_t k = 0; k < chain_.size(); ++k) {
      if (stopped_[k]) continue;
      step_[k] = 0;
      for (int i = 0; i < m; ++i) step_[k] += columns_[max_rows * k + i] * y[i];
    }
  }

  // Stops joints whose step crosses a bound, takes what that moves from the rows; whether any did.
  bool stop_at_bounds(double* rows, int m, const double* q) {
    bool any = false;
    for (std::size_t k = 0; k < chain_.size(); ++k) {
      const ChainJoint& joint = chain_[k];
      if (stopped_[k] || joint.turns_freely()) continue;
      const double to = std::min(std::max(q[k] + step_[k], joint.lower), joint.upper);
      if (to == q[k] + step_[k]) continue;
      stopped_[k] = any = true;
      step_[k] = to - q[k];
      for (int i = 0; i < m; ++i) rows[i] -= columns_[max_rows * k + i] * step_[k];
    }
    return any;
  }

  const Chain& chain_;
  std::vector<Axis> axes_;
  std::vector<double> columns_, step_, trial_;
  std::vector<char> stopped_;
};

}  // namespace hovi::kinematics
