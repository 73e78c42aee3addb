// The logarithmic barrier of slacks between bounds: its Newton steps and their lengths.
//
// Slacks are processed several at a time, in the lanes of a pack, and the last ones one by one: a
// template with a type V is for packs and for numbers. Everything is in an unnamed namespace: see
// simd/dispatch.hpp.
#pragma once

#include <cstddef>

#include "kernels.hpp"
#include "simd/pack.hpp"

namespace hovi::barrier {
namespace {

constexpr double infinity = __builtin_inf();
constexpr double least_gap = 1e-16;  // the rounding unit at a bound of one
constexpr double rounding = 1e-10;   // of a slack, as a share of its gap
constexpr double released = 1e-2;    // how far an output may move from a bound that lets it go

inline Pack read(const double* x, const Pack&) { return load(x); }
inline double read(const double* x, double) { return *x; }
inline void write(double* x, const Pack& value) { store(x, value); }
inline void write(double* x, double value) { *x = value; }
inline Pack all_lanes(double x, const Pack&) { return broadcast(x); }
inline double all_lanes(double x, double) { return x; }
inline double root(double x) { return __builtin_sqrt(x); }
inline Pack root(Pack x) {
  for (std::size_t lane = 0; lane < lanes; ++lane) x[lane] = __builtin_sqrt(x[lane]);
  return x;
}

// As std::max and std::min, which return the first argument where one is NaN.
template <typename V>
inline V larger(const V& a, const V& b) {
  return a < b ? b : a;
}
template <typename V>
inline V smaller(const V& a, const V& b) {
  return b < a ? b : a;
}
template <typename V>
inline V magnitude(const V& x) {
  return x < 0.0 ? -x : x;
}
template <typename V>
inline V between(const V& x, const V& low, const V& high) {
  return smaller(larger(x, low), high);
}

// Calls work(i, V) for i from 0 to count: with a pack for as many as fill its lanes at a time, then
// with a number for each of the others.
template <typename Work>
inline void over(std::size_t count, const Work& work) {
  const std::size_t whole = count - count % lanes;
  for (std::size_t i = 0; i < whole; i += lanes) work(i, Pack{});
  for (std::size_t i = whole; i < count; ++i) work(i, 0.0);
}

// A sum or an extreme of all slacks: of those in every lane, and of the last ones.
struct Reduced {
  explicit Reduced(double x) : packs(broadcast(x)), rest(x) {}
  Pack& of(const Pack&) { return packs; }
  double& of(double) { return rest; }
  double total() const { return sum(packs) + rest; }
  double largest() const {
    double most = rest;
    for (std::size_t lane = 0; lane < lanes; ++lane) most = larger<double>(most, packs[lane]);
    return most;
  }
  double smallest() const {
    double least = rest;
    for (std::size_t lane = 0; lane < lanes; ++lane) least = smaller<double>(least, packs[lane]);
    return least;
  }
  Pack packs;
  double rest;
};

// The slacks in a pack from number i on, or slack number i.
template <typename V>
struct Some {
  Some(const Slacks& at, std::size_t i, const V& kind)
      : lower(read(at.lower + i, kind)),
        upper(read(at.upper + i, kind)),
        s(read(at.s + i, kind)),
        zl(read(at.zl + i, kind)),
        zu(read(at.zu + i, kind)),
        gap(all_lanes(least_gap, kind)),
        zero(all_lanes(0.0, kind)),
        below(larger<V>(s - lower, gap)),
        above(larger<V>(upper - s, gap)) {}

  // a where there is a lower, or an upper, bound; b where there is none.
  V where_lower(const V& a, const V& b) const { return lower > -infinity ? a : b; }
  V where_upper(const V& a, const V& b) const { return upper < infinity ? a : b; }

  V lower, upper, s, zl, zu, gap, zero, below, above;
};

void condense(const Slacks& at, const double* y, double mu, double* sigma, double* rho,
              double* force) {
  over(at.count, [&](std::size_t i, const auto& kind) {
    const Some x(at, i, kind);
    const auto below = 1.0 / x.below, above = 1.0 / x.above;
    const auto curve = x.zl * below + x.zu * above;
    write(sigma + i, curve);
    write(rho + i, mu * above - mu * below + curve * (read(y + i, kind) - x.s));
    write(force + i, x.zu - x.zl);
  });
}

void shift(const Slacks& at, double mu, const double* lower, const double* upper, double* out) {
  over(at.count, [&](std::size_t i, const auto& kind) {
    const Some x(at, i, kind);
    write(out + i, (read(upper + i, kind) - mu) / x.above - (read(lower + i, kind) - mu) / x.below);
  });
}

// The largest share of a change, up to one, that keeps a gap nonnegative.
template <typename V>
inline V share_of(const V& gap, const V& change, const V& whole) {
  return change < 0.0 ? smaller<V>(whole, -gap / change) : whole;
}

Lengths aim(const Slacks& at, const double* y, const double* dy, const double* lower,
            const double* upper, double matched, double keep, const Direction& d) {
  Reduced primal(1.0), dual(1.0), largest_force(0.0), largest_residual(0.0);
  over(at.count, [&](std::size_t i, const auto& kind) {
    const Some x(at, i, kind);
    const auto one = all_lanes(1.0, kind), residual = read(y + i, kind) - x.s;
    const auto aim_low = read(lower + i, kind), aim_high = read(upper + i, kind);
    const auto below = 1.0 / x.below, above = 1.0 / x.above;
    const auto whole = read(dy + i, kind) + residual, off = magnitude(residual);
    const auto ds = off <= matched ? whole : between(whole, -keep * x.below, keep * x.above);
    const auto dzl = x.where_lower((aim_low - x.zl * ds) * below - x.zl, x.zero);
    const auto dzu = x.where_upper((aim_high + x.zu * ds) * above - x.zu, x.zero);
    write(d.s + i, ds);
    write(d.zl + i, dzl);
    write(d.zu + i, dzu);
    const auto inside = smaller(share_of(x.below, ds, one), share_of(x.above, -ds, one));
    const auto share = off <= matched ? inside : one;
    primal.of(kind) = smaller(primal.of(kind), share);
    const auto positive = smaller(share_of(x.zl, dzl, one), share_of(x.zu, dzu, one));
    dual.of(kind) = smaller(dual.of(kind), positive);
    const auto low = x.where_lower((aim_low - x.zl * whole) * below, x.zl);
    const auto high = x.where_upper((aim_high + x.zu * whole) * above, x.zu);
    largest_force.of(kind) = larger(largest_force.of(kind), magnitude(high - low));
    largest_residual.of(kind) = larger(largest_residual.of(kind), off);
  });
  return {primal.smallest(), dual.smallest(), largest_force.largest(), largest_residual.largest()};
}

double mean_product(const Slacks& at, const Direction& d, double primal, double dual) {
  Reduced products(0.0), count(0.0);
  over(at.count, [&](std::size_t i, const auto& kind) {
    const Some x(at, i, kind);
    const auto one = all_lanes(1.0, kind);
    const auto ds = between(primal * read(d.s + i, kind), -0.99 * x.below, 0.99 * x.above);
    const auto low = (x.zl + dual * read(d.zl + i, kind)) * (x.below + ds);
    const auto high = (x.zu + dual * read(d.zu + i, kind)) * (x.above - ds);
    products.of(kind) += x.where_lower(low, x.zero) + x.where_upper(high, x.zero);
    count.of(kind) += x.where_lower(one, x.zero) + x.where_upper(one, x.zero);
  });
  return count.total() > 0.0 ? products.total() / count.total() : 0.0;
}

double largest_miss(const Slacks& at, double mu) {
  Reduced largest(0.0);
  over(at.count, [&](std::size_t i, const auto& kind) {
    const Some x(at, i, kind);
    const auto low = x.where_lower(magnitude(x.zl * x.below - mu), x.zero);
    const auto high = x.where_upper(magnitude(x.zu * x.above - mu), x.zero);
    largest.of(kind) = larger(larger(largest.of(kind), low), high);
  });
  return largest.largest();
}

void correct(const Slacks& at, const double* y, const Direction& d, double mu, double matched,
             double* lower, double* upper) {
  over(at.count, [&](std::size_t i, const auto& kind) {
    const auto off = magnitude(read(y + i, kind) - read(at.s + i, kind));
    const auto ds = off <= matched ? read(d.s + i, kind) : all_lanes(0.0, kind);
    const auto zero = all_lanes(0.0, kind);
    const auto low = ds * read(d.zl + i, kind), high = ds * read(d.zu + i, kind);
    write(lower + i, mu - (off <= matched ? low : zero));
    write(upper + i, mu + (off <= matched ? high : zero));
  });
}

// How far a product is outside of [mu/10, 10 mu]; at most 10 mu are taken off.
template <typename V>
inline V outside(const V& product, double mu, const V& zero) {
  const V more = 0.1 * mu - product, less = larger<V>(10.0 * mu - product, zero - 10.0 * mu);
  return product < 0.1 * mu ? more : product > 10.0 * mu ? less : zero;
}

void center(const Slacks& at, const double* y, const Direction& d, double primal, double dual,
            double mu, double matched, double* lower, double* upper) {
  over(at.count, [&](std::size_t i, const auto& kind) {
    const Some x(at, i, kind);
    const auto off = magnitude(read(y + i, kind) - x.s);
    const auto ds = primal * read(d.s + i, kind);
    const auto low = (x.zl + dual * read(d.zl + i, kind)) * (x.below + ds);
    const auto high = (x.zu + dual * read(d.zu + i, kind)) * (x.above - ds);
    const auto more_low = x.where_lower(outside(low, mu, x.zero), x.zero);
    const auto more_high = x.where_upper(outside(high, mu, x.zero), x.zero);
    write(lower + i, read(lower + i, kind) + (off <= matched ? more_low : x.zero));
    write(upper + i, read(upper + i, kind) + (off <= matched ? more_high : x.zero));
  });
}

// sum log(gap) by lanes, with one logarithm for several gaps.
class LogSum {
 public:
  template <typename V>
  void add(const V& gaps) {
    product_.of(gaps) *= gaps;
    if (++factors_ == most_factors) flush();
  }
  double total() {
    flush();
    return total_;
  }

 private:
  // The product of so many gaps between 1e-16 and 1e16 neither underflows nor overflows.
  static constexpr int most_factors = 16;

  void flush() {
    if (factors_ == 0) return;
    for (std::size_t lane = 0; lane < lanes; ++lane) take(product_.packs[lane]);
    take(product_.rest);
    product_ = Reduced(1.0), factors_ = 0;
  }
  void take(double product) {
    if (product != 1.0) total_ += __builtin_log(product);
  }
  Reduced product_{1.0};
  double total_ = 0.0;
  int factors_ = 0;
};

// The end of the run of equal weights that begins at `first`.
inline std::size_t end_of_weight(const double* weights, std::size_t first, std::size_t count) {
  std::size_t last = first + 1;
  while (last < count && weights[last] == weights[first]) ++last;
  return last;
}

double merit(const Slacks& at, const double* weights, const double* y, const double* dy,
             const double* ds, double share, double keep, double mu, double penalty) {
  double barrier = 0.0, misfits = 0.0;
  for (std::size_t first = 0, last; first < at.count; first = last) {
    last = end_of_weight(weights, first, at.count);
    LogSum logs;
    Reduced misfit(0.0);
    over(last - first, [&](std::size_t k, const auto& kind) {
      const std::size_t i = first + k;
      const Some x(at, i, kind);
      const auto one = all_lanes(1.0, kind);
      const auto step = between(share * read(ds + i, kind), -keep * x.below, keep * x.above);
      logs.add(x.where_lower(x.below + step, one));
      logs.add(x.where_upper(x.above - step, one));
      misfit.of(kind) +=
          magnitude(read(y + i, kind) + share * read(dy + i, kind) - x.s - step);
    });
    barrier += weights[first] * logs.total();
    misfits += weights[first] * misfit.total();
  }
  return penalty * misfits - mu * barrier;
}

// Whether log(ratio) > least; the bounds 1 - 1/x <= log x <= x - 1 mostly save the logarithm.
inline bool exceeds(double ratio, double least) {
  if (1.0 - 1.0 / ratio > least) return true;
  return ratio - 1.0 > least && __builtin_log(ratio) > least;
}

// Slack number i after a step to s, or its output.
inline double moved_slack(const Slacks& at, std::size_t i, double y, double s, double mu,
                          double penalty) {
  const double lower = at.lower[i], upper = at.upper[i], low = y - lower, high = upper - y;
  if (y == s || !(low > least_gap && high > least_gap)) return s;
  const double off = magnitude(y - s);
  if (off <= rounding * smaller(low, high)) return y;
  const double ratios =
      (lower > -infinity ? low / larger(s - lower, least_gap) : 1.0) *
      (upper < infinity ? high / larger(upper - s, least_gap) : 1.0);
  const bool lowers = mu > 0.0 ? exceeds(ratios, -penalty * off / mu) : 0.0 < penalty * off;
  return lowers ? y : s;
}

void move(const Slacks& at, const double* y, const Direction& d, double primal, double dual,
          double keep, double mu, double penalty, double ratio, const Direction& out) {
  over(at.count, [&](std::size_t i, const auto& kind) {
    const Some x(at, i, kind);
    const auto step = between(primal * read(d.s + i, kind), -keep * x.below, keep * x.above);
    write(out.s + i, x.s + step);
  });
  for (std::size_t i = 0; i < at.count; ++i)
    out.s[i] = moved_slack(at, i, y[i], out.s[i], mu, penalty);
  over(at.count, [&](std::size_t i, const auto& kind) {
    const Some x(at, i, kind);
    const auto s = read(out.s + i, kind);
    const auto low = mu / larger(s - x.lower, x.gap), high = mu / larger(x.upper - s, x.gap);
    const auto zl = x.zl + dual * read(d.zl + i, kind), zu = x.zu + dual * read(d.zu + i, kind);
    write(out.zl + i, x.where_lower(between(zl, low / ratio, low * ratio), x.zero));
    write(out.zu + i, x.where_upper(between(zu, high / ratio, high * ratio), x.zero));
  });
}

// The gap of a bound at which gap z = mu and z - c gap = w: near 0 with z = w > 0, else -w/c.
template <typename V>
inline V central_gap(const V& w, const V& c, double mu) {
  const V size = root(w * w + 4.0 * c * mu);
  return w > 0.0 ? 2.0 * mu / (size + w) : (size - w) / (2.0 * c);
}

// Writes the slacks at the central gap of the bound that matters more, and not beyond the middle,
// or at y without bounds; and the multipliers whose products z gap are mu.
// low, high: z - c gap of the two bounds. force: becomes zu - zl. Returns the slacks.
template <typename V>
inline V set_central(const Some<V>& x, std::size_t i, const V& y, const V& low, const V& high,
                     const V& c, double mu, const Direction& out, V& force) {
  const V half = 0.5 * (x.upper - x.lower);  // infinite with one bound
  const V from_lower = x.lower + smaller<V>(central_gap(low, c, mu), half);
  const V from_upper = x.upper - smaller<V>(central_gap(high, c, mu), half);
  const V both = low >= high ? from_lower : from_upper;
  const V s = x.where_lower(x.where_upper(both, from_lower), x.where_upper(from_upper, y));
  const V zl = x.where_lower(mu / larger<V>(s - x.lower, x.gap), x.zero);
  const V zu = x.where_upper(mu / larger<V>(x.upper - s, x.gap), x.zero);
  write(out.s + i, s);
  write(out.zl + i, zl);
  write(out.zu + i, zu);
  force = zu - zl;
  return s;
}

void recenter(const Slacks& at, double c, double mu, const Direction& out) {
  over(at.count, [&](std::size_t i, const auto& kind) {
    const Some x(at, i, kind);
    const auto weight = all_lanes(c, kind);
    const auto low = x.zl - c * (x.s - x.lower), high = x.zu - c * (x.upper - x.s);
    auto force = x.zero;
    set_central(x, i, x.s, low, high, weight, mu, out, force);
  });
}

Misses follow(const Slacks& at, const double* weights, const double* y, const double* dy,
              const double* y_new, double mu, double next_mu, double least, const Direction& out) {
  Reduced outside(-infinity), work(0.0);
  over(at.count, [&](std::size_t i, const auto& kind) {
    const Some x(at, i, kind);
    const auto next = read(y_new + i, kind), floor = all_lanes(least, kind);
    const auto below = 1.0 / x.below, above = 1.0 / x.above;
    const auto ds = read(dy + i, kind) + read(y + i, kind) - x.s;
    const auto c = root(larger(x.zl * below + x.zu * above, floor) * least);
    const auto zl = (mu - x.zl * ds) * below, zu = (mu + x.zu * ds) * above;
    auto force = x.zero;
    const auto s = set_central(x, i, next, zl - c * (next - x.lower), zu - c * (x.upper - next), c,
                               next_mu, out, force);
    const auto freed = larger(-zl, x.zero) + larger(-zu, x.zero);
    const auto miss = magnitude(force) * magnitude(next - s);
    work.of(kind) += read(weights + i, kind) * (miss + released * freed);
    const auto beyond = larger(x.lower - next, next - x.upper);
    outside.of(kind) = larger(outside.of(kind), beyond);
  });
  return {outside.largest(), work.total()};
}

constexpr Kernels kernels{condense, shift, aim,  mean_product, largest_miss, correct,
                          center,   merit, move, recenter,     follow};

}  // namespace
}  // namespace hovi::barrier
