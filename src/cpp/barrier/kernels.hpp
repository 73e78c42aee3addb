// The functions that are compiled once per instruction set: see simd/dispatch.hpp.
#pragma once

#include <cstddef>

namespace hovi::barrier {

// R slacks s with multipliers zl, zu; infinite bounds are none.
struct Slacks {
  std::size_t count;
  const double *lower, *upper, *s, *zl, *zu;
};

// Newton's direction of slacks and multipliers.
struct Direction {
  double *s, *zl, *zu;
};

// The largest shares of a direction, up to 1, that slacks and multipliers may take, and the largest
// |zu - zl| after it and |y - s| before.
struct Lengths {
  double primal, dual, largest_force, largest_residual;
};

// How far outputs are outside their bounds at most, and sum w |zu - zl| |y - s| plus what bounds
// that no longer hold the solution may give: the negative multipliers, times w and a distance.
struct Misses {
  double outside, work;
};

struct Kernels {
  // sigma = zl/below + zu/above, rho = mu/above - mu/below + sigma (y - s), force = zu - zl.
  void (*condense)(const Slacks& at, const double* y, double mu, double* sigma, double* rho,
                   double* force);

  // rho for products z gap that aim at `lower` and `upper` instead of mu, less rho.
  void (*shift)(const Slacks& at, double mu, const double* lower, const double* upper, double* out);

  // The direction in which the products aim at their targets, and the lengths up to the boundary:
  // slacks that differ from their outputs by more than `matched` do not limit it, but take at most
  // `keep` of their gaps. The largest force is that of the whole direction.
  Lengths (*aim)(const Slacks& at, const double* y, const double* dy, const double* lower,
                 const double* upper, double matched, double keep, const Direction& d);

  // The mean product of multipliers and gaps after shares of a direction.
  double (*mean_product)(const Slacks& at, const Direction& d, double primal, double dual);

  // The largest |z gap - mu|.
  double (*largest_miss)(const Slacks& at, double mu);

  // Targets that make up for the second-order terms of a direction: mu -/+ ds dz.
  void (*correct)(const Slacks& at, const double* y, const Direction& d, double mu, double matched,
                  double* lower, double* upper);

  // Targets that bring those products nearer to mu that longer shares of a direction would spoil.
  void (*center)(const Slacks& at, const double* y, const Direction& d, double primal, double dual,
                 double mu, double matched, double* lower, double* upper);

  // -mu sum w log(gaps) + penalty sum w |y - s| after a share of a direction, of which every slack
  // takes at most `keep` of its gap.
  double (*merit)(const Slacks& at, const double* weights, const double* y, const double* dy,
                  const double* ds, double share, double keep, double mu, double penalty);

  // Slacks and multipliers after shares of a direction. A slack becomes its output y where that is
  // inside of the bounds and lowers the merit, or next to it, and z gap stays within `ratio` of mu.
  void (*move)(const Slacks& at, const double* y, const Direction& d, double primal, double dual,
               double keep, double mu, double penalty, double ratio, const Direction& out);

  // The point of the central path with mu that belongs to slacks and multipliers of another one.
  void (*recenter)(const Slacks& at, double c, double mu, const Direction& out);

  // After a Newton step dy of the outputs y, to y_new, from a point of the central path with mu:
  // the point with the next mu. Multipliers are those that the step predicts, gaps those of y_new,
  // and what both say of a bound is weighed with c, the geometric mean of the ratio of multiplier
  // and gap before and of the least one. With the ratio alone bounds would be released slowly, with
  // the least one found slowly.
  Misses (*follow)(const Slacks& at, const double* weights, const double* y, const double* dy,
                   const double* y_new, double mu, double next_mu, double least,
                   const Direction& out);

  static const Kernels baseline, avx2;
};

}  // namespace hovi::barrier
