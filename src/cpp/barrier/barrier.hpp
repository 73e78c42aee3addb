// The logarithmic barrier of slacks between bounds: its Newton steps and their lengths.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace hovi::barrier {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double least_gap = 1e-16;  // the rounding unit at a bound of one
constexpr double rounding = 1e-10;   // of a slack, as a share of its gap
constexpr double released = 1e-2;    // how far an output may move from a bound that lets it go

// R slacks s with multipliers zl, zu; infinite bounds are none.
struct Slacks {
  std::size_t count;
  const double *lower, *upper, *s, *zl, *zu;

  double below(std::size_t i) const { return std::max(s[i] - lower[i], least_gap); }
  double above(std::size_t i) const { return std::max(upper[i] - s[i], least_gap); }
  bool has_lower(std::size_t i) const { return lower[i] > -infinity; }
  bool has_upper(std::size_t i) const { return upper[i] < infinity; }
};

// Newton's direction of slacks and multipliers.
struct Direction {
  double *s, *zl, *zu;
};

// sigma = zl/below + zu/above, rho = mu/above - mu/below + sigma (y - s), force = zu - zl.
inline void condense(const Slacks& at, const double* y, double mu, double* sigma, double* rho,
                     double* force) {
  for (std::size_t i = 0; i < at.count; ++i) {
    const double below = 1.0 / at.below(i), above = 1.0 / at.above(i);
    sigma[i] = at.zl[i] * below + at.zu[i] * above;
    rho[i] = mu * above - mu * below + sigma[i] * (y[i] - at.s[i]);
    force[i] = at.zu[i] - at.zl[i];
  }
}

// rho for products z gap that aim at `lower` and `upper` instead of mu, less rho.
inline void shift(const Slacks& at, double mu, const double* lower, const double* upper,
                  double* out) {
  for (std::size_t i = 0; i < at.count; ++i)
    out[i] = (upper[i] - mu) / at.above(i) - (lower[i] - mu) / at.below(i);
}

// The largest share of a change that keeps a gap nonnegative.
inline void limit(double gap, double change, double& share) {
  if (change < 0.0) share = std::min(share, -gap / change);
}

struct Lengths {
  double primal = 1.0, dual = 1.0, largest_force = 0.0, largest_residual = 0.0;
};

// The direction in which the products aim at their targets, and the lengths up to the boundary:
// slacks that differ from their outputs by more than `matched` do not limit it, but take at most
// `keep` of their gaps. The largest force is that of the whole direction.
inline Lengths aim(const Slacks& at, const double* y, const double* dy, const double* lower,
                   const double* upper, double matched, double keep, const Direction& d) {
  Lengths lengths;
  for (std::size_t i = 0; i < at.count; ++i) {
    const double below = at.below(i), above = at.above(i), residual = y[i] - at.s[i];
    const bool equal = std::abs(residual) <= matched;
    const auto dzl = [&](double ds) {
      return at.has_lower(i) ? (lower[i] - at.zl[i] * ds) / below - at.zl[i] : 0.0;
    };
    const auto dzu = [&](double ds) {
      return at.has_upper(i) ? (upper[i] + at.zu[i] * ds) / above - at.zu[i] : 0.0;
    };
    const double whole = dy[i] + residual;
    const double ds = equal ? whole : std::clamp(whole, -keep * below, keep * above);
    d.s[i] = ds, d.zl[i] = dzl(ds), d.zu[i] = dzu(ds);
    if (equal) {
      limit(below, ds, lengths.primal);
      limit(above, -ds, lengths.primal);
    }
    limit(at.zl[i], d.zl[i], lengths.dual);
    limit(at.zu[i], d.zu[i], lengths.dual);
    const double force = std::abs(at.zu[i] + dzu(whole) - at.zl[i] - dzl(whole));
    lengths.largest_force = std::max(lengths.largest_force, force);
    lengths.largest_residual = std::max(lengths.largest_residual, std::abs(residual));
  }
  return lengths;
}

// The mean product of multipliers and gaps after shares of a direction.
inline double mean_product(const Slacks& at, const Direction& d, double primal, double dual) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < at.count; ++i) {
    const double below = at.below(i), above = at.above(i);
    const double ds = std::clamp(primal * d.s[i], -0.99 * below, 0.99 * above);
    if (at.has_lower(i)) sum += (at.zl[i] + dual * d.zl[i]) * (below + ds), ++count;
    if (at.has_upper(i)) sum += (at.zu[i] + dual * d.zu[i]) * (above - ds), ++count;
  }
  return count ? sum / double(count) : 0.0;
}

// The largest |z gap - mu|.
inline double largest_miss(const Slacks& at, double mu) {
  double largest = 0.0;
  for (std::size_t i = 0; i < at.count; ++i) {
    if (at.has_lower(i)) largest = std::max(largest, std::abs(at.zl[i] * at.below(i) - mu));
    if (at.has_upper(i)) largest = std::max(largest, std::abs(at.zu[i] * at.above(i) - mu));
  }
  return largest;
}

// Targets that make up for the second-order terms of a direction: mu -/+ ds dz.
inline void correct(const Slacks& at, const double* y, const Direction& d, double mu,
                    double matched, double* lower, double* upper) {
  for (std::size_t i = 0; i < at.count; ++i) {
    const bool equal = std::abs(y[i] - at.s[i]) <= matched;
    lower[i] = mu - (equal ? d.s[i] * d.zl[i] : 0.0);
    upper[i] = mu + (equal ? d.s[i] * d.zu[i] : 0.0);
  }
}

// How far a product is outside of [mu/10, 10 mu]; at most 10 mu are taken off.
inline double outside(double product, double mu) {
  if (product < 0.1 * mu) return 0.1 * mu - product;
  return product > 10.0 * mu ? std::max(10.0 * mu - product, -10.0 * mu) : 0.0;
}

// Targets that bring those products nearer to mu that longer shares of a direction would spoil.
inline void center(const Slacks& at, const double* y, const Direction& d, double primal,
                   double dual, double mu, double matched, double* lower, double* upper) {
  for (std::size_t i = 0; i < at.count; ++i) {
    if (std::abs(y[i] - at.s[i]) > matched) continue;
    const double ds = primal * d.s[i];
    if (at.has_lower(i))
      lower[i] += outside((at.zl[i] + dual * d.zl[i]) * (at.below(i) + ds), mu);
    if (at.has_upper(i))
      upper[i] += outside((at.zu[i] + dual * d.zu[i]) * (at.above(i) - ds), mu);
  }
}

// sum w log(gap), with one logarithm for several gaps of the same weight.
class LogSum {
 public:
  void add(double weight, double gap) {
    if (weight != weight_ || product_ < 1e-200 || product_ > 1e200) flush(weight);
    product_ *= gap;
  }
  double total() {
    flush(0.0);
    return total_;
  }

 private:
  void flush(double weight) {
    if (product_ != 1.0) total_ += weight_ * std::log(product_);
    weight_ = weight, product_ = 1.0;
  }
  double weight_ = 0.0, product_ = 1.0, total_ = 0.0;
};

// -mu sum w log(gaps) + penalty sum w |y - s| after a share of a direction, of which every slack
// takes at most `keep` of its gap.
inline double merit(const Slacks& at, const double* weights, const double* y, const double* dy,
                    const double* ds, double share, double keep, double mu, double penalty) {
  LogSum logs;
  double misfit = 0.0;
  for (std::size_t i = 0; i < at.count; ++i) {
    const double below = at.below(i), above = at.above(i);
    const double step = std::clamp(share * ds[i], -keep * below, keep * above);
    if (at.has_lower(i)) logs.add(weights[i], below + step);
    if (at.has_upper(i)) logs.add(weights[i], above - step);
    misfit += weights[i] * std::abs(y[i] + share * dy[i] - at.s[i] - step);
  }
  return penalty * misfit - mu * logs.total();
}

// Slacks and multipliers after shares of a direction. A slack becomes its output y where that is
// inside of the bounds and lowers the merit, or next to it, and z gap stays within `ratio` of mu.
inline void move(const Slacks& at, const double* y, const Direction& d, double primal, double dual,
                 double keep, double mu, double penalty, double ratio, const Direction& out) {
  for (std::size_t i = 0; i < at.count; ++i) {
    const double below = at.below(i), above = at.above(i);
    double s = at.s[i] + std::clamp(primal * d.s[i], -keep * below, keep * above);
    const double low = y[i] - at.lower[i], high = at.upper[i] - y[i];
    if (y[i] != s && low > least_gap && high > least_gap) {
      const double off = std::abs(y[i] - s);
      const double ratios = (at.has_lower(i) ? low / std::max(s - at.lower[i], least_gap) : 1.0) *
                            (at.has_upper(i) ? high / std::max(at.upper[i] - s, least_gap) : 1.0);
      if (off <= rounding * std::min(low, high) || -mu * std::log(ratios) < penalty * off) s = y[i];
    }
    out.s[i] = s;
    const double center_low = mu / std::max(s - at.lower[i], least_gap);
    const double center_high = mu / std::max(at.upper[i] - s, least_gap);
    const double zl = at.zl[i] + dual * d.zl[i], zu = at.zu[i] + dual * d.zu[i];
    out.zl[i] = at.has_lower(i) ? std::clamp(zl, center_low / ratio, center_low * ratio) : 0.0;
    out.zu[i] = at.has_upper(i) ? std::clamp(zu, center_high / ratio, center_high * ratio) : 0.0;
  }
}

// The gap of a bound at which gap z = mu and z - c gap = w: near 0 with z = w > 0, else -w/c.
inline double central_gap(double w, double c, double mu) {
  const double root = std::sqrt(w * w + 4.0 * c * mu);
  return w > 0.0 ? 2.0 * mu / (root + w) : (root - w) / (2.0 * c);
}

// The slack between two bounds at the gap of the one that matters more, by given differences w of
// the multipliers and c gaps, and not beyond the middle; y without any bound.
inline double central_slack(const Slacks& at, std::size_t i, double y, double low, double high,
                            double c, double mu) {
  const double half = 0.5 * (at.upper[i] - at.lower[i]);  // infinite with one bound
  if (at.has_lower(i) && (!at.has_upper(i) || low >= high))
    return at.lower[i] + std::min(central_gap(low, c, mu), half);
  return at.has_upper(i) ? at.upper[i] - std::min(central_gap(high, c, mu), half) : y;
}

// A slack, and the multipliers with which its products z gap are mu.
inline void set_central(const Slacks& at, std::size_t i, double s, double mu,
                        const Direction& out) {
  out.s[i] = s;
  out.zl[i] = at.has_lower(i) ? mu / std::max(s - at.lower[i], least_gap) : 0.0;
  out.zu[i] = at.has_upper(i) ? mu / std::max(at.upper[i] - s, least_gap) : 0.0;
}

// The point of the central path with mu that belongs to slacks and multipliers of another one.
inline void recenter(const Slacks& at, double c, double mu, const Direction& out) {
  for (std::size_t i = 0; i < at.count; ++i) {
    const double low = at.zl[i] - c * (at.s[i] - at.lower[i]);
    const double high = at.zu[i] - c * (at.upper[i] - at.s[i]);
    set_central(at, i, central_slack(at, i, at.s[i], low, high, c, mu), mu, out);
  }
}

// How far outputs are outside their bounds at most, and sum w |zu - zl| |y - s| plus what bounds
// that no longer hold the solution may give: the negative multipliers, times w and a distance.
struct Misses {
  double outside = -infinity, work = 0.0;
};

// After a Newton step dy of the outputs y, to y_new, from a point of the central path with mu: the
// point with the next mu. Multipliers are those that the step predicts, gaps those of y_new, and
// what both say of a bound is weighed with c, the geometric mean of the ratio of multiplier and gap
// before and of the least one. With the ratio alone bounds would be released slowly, with the least
// one found slowly.
inline Misses follow(const Slacks& at, const double* weights, const double* y, const double* dy,
                     const double* y_new, double mu, double next_mu, double least,
                     const Direction& out) {
  Misses misses;
  for (std::size_t i = 0; i < at.count; ++i) {
    const double below = at.below(i), above = at.above(i), ds = dy[i] + y[i] - at.s[i];
    const double ratio = at.zl[i] / below + at.zu[i] / above;
    const double c = std::sqrt(std::max(ratio, least) * least);
    const double zl = (mu - at.zl[i] * ds) / below, zu = (mu + at.zu[i] * ds) / above;
    const double low = zl - c * (y_new[i] - at.lower[i]), high = zu - c * (at.upper[i] - y_new[i]);
    const double s = central_slack(at, i, y_new[i], low, high, c, next_mu);
    set_central(at, i, s, next_mu, out);
    const double miss = std::abs(out.zu[i] - out.zl[i]) * std::abs(y_new[i] - s);
    misses.work += weights[i] * (miss + released * (std::max(-zl, 0.0) + std::max(-zu, 0.0)));
    misses.outside =
        std::max({misses.outside, at.lower[i] - y_new[i], y_new[i] - at.upper[i]});
  }
  return misses;
}

}  // namespace hovi::barrier
