#include "configurations.hpp"
#include "quaternions.hpp"

namespace hovi::groups {
namespace {

constexpr double no_turn = 1e-9;      // turn, in [rad], below which its axis says nothing
constexpr double full_turn = 6.283185307179586;

// Of (1 - (t / 2) cot(t / 2)) / t^2 in t^2, by Bernoulli's numbers.
constexpr int series_terms = 11;
constexpr double cotangent_series[series_terms] = {
    1.0 / 12,
    1.0 / 720,
    1.0 / 30240,
    1.0 / 1209600,
    1.0 / 47900160,
    691.0 / 1307674368000,
    1.0 / 74724249600,
    3617.0 / 10670622842880000,
    43867.0 / 5109094217170944000,
    174611.0 / 802857662698291200000.0,
    77683.0 / 14101100039391805440000.0,
};

// (1 - (t / 2) cot(t / 2)) / t^2 of t^2, for |t| < 2 pi.
double half_cotangent(double square) {
  if (square >= series_below) {
    const double half = 0.5 * std::sqrt(square);
    return (1.0 - half * std::cos(half) / std::sin(half)) / square;
  }
  double sum = 0.0;
  for (int k = series_terms; k-- > 0;) sum = sum * square + cotangent_series[k];
  return sum;
}

// Full turns about the axis of w, so that it comes nearest to what is expected; where nothing
// turns, about the axis that is expected.
void add_turns(const double* expected, int size, double* w) {
  const double angle = std::sqrt(dot(w, w, size)), reach = std::sqrt(dot(expected, expected, size));
  const double* const along = angle > no_turn ? w : expected;
  const double norm = angle > no_turn ? angle : reach;
  if (norm == 0.0) return;
  const double turns = std::nearbyint((dot(along, expected, size) / norm - angle) / full_turn);
  for (int i = 0; i < size; ++i) w[i] += full_turn * turns * along[i] / norm;
}

double angle_between(const double* p, const double* q) {
  return std::atan2(p[0] * q[1] - p[1] * q[0], dot(p, q, 2));
}

// The turn from one unit quaternion to another.
void turn_between(const double* p, const double* q, double* w) {
  const double back[] = {-p[0], -p[1], -p[2], p[3]};
  double product[4];
  multiply(back, q, product);
  const double sign = product[3] < 0.0 ? -1.0 : 1.0, size = std::sqrt(dot(product, product));
  const bool tiny = size < 1e-150;
  const double factor = tiny ? 2.0 : 2.0 * std::atan2(size, sign * product[3]) / size;
  for (int i = 0; i < 3; ++i) w[i] = sign * factor * product[i];
}

void difference_se2(const double* q0, const double* q1, double w, double* result) {
  const double back[] = {q0[2], -q0[3]};
  // (w / 2) cot(w / 2) and -w / 2
  const double inverse[] = {1.0 - w * w * half_cotangent(w * w), -0.5 * w};
  double p[] = {q1[0] - q0[0], q1[1] - q0[1]};
  turn(back, p, p);
  turn(inverse, p, result);
}

void difference_se3(const double* q0, const double* q1, const double* w, double* result) {
  const double back[] = {-q0[3], -q0[4], -q0[5], q0[6]};
  double p[] = {q1[0] - q0[0], q1[1] - q0[1], q1[2] - q0[2]}, once[3], twice[3];
  rotate(back, p, p);
  cross(w, p, once);
  cross(w, once, twice);
  const double cotangent = half_cotangent(dot(w, w));
  for (int i = 0; i < 3; ++i) result[i] = p[i] - 0.5 * once[i] + cotangent * twice[i];
}

// Of a group; translations come first.
void difference_of(Kind kind, const double* q0, const double* q1, const double* expected,
                   double* result) {
  const bool spatial = kind == Kind::so3 || kind == Kind::se3;
  const int translations = kind == Kind::se2 ? 2 : kind == Kind::se3 ? 3 : 0;
  double* const w = result + translations;
  if (spatial)
    turn_between(q0 + translations, q1 + translations, w);
  else
    w[0] = angle_between(q0 + translations, q1 + translations);
  if (expected) add_turns(expected + translations, spatial ? 3 : 1, w);
  if (kind == Kind::se2) difference_se2(q0, q1, w[0], result);
  if (kind == Kind::se3) difference_se3(q0, q1, w, result);
}

}  // namespace

void difference(const Space& space, const double* q0, const double* q1, const double* expected,
                double* result) {
  for (const Part* part = space.part; part != space.part + space.parts; ++part) {
    const double *const from = q0 + part->q, *const to = q1 + part->q;
    double* const x = result + part->v;
    if (part->kind == Kind::plain)
      for (std::int64_t i = 0; i < part->size; ++i) x[i] = to[i] - from[i];
    else
      difference_of(part->kind, from, to, expected ? expected + part->v : nullptr, x);
  }
}

}  // namespace hovi::groups
