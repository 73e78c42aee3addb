#include "configurations.hpp"
#include "quaternions.hpp"

namespace hovi::groups {
namespace {

double sinc(double x) { return x == 0.0 ? 1.0 : std::sin(x) / x; }

// (t - sin t) / t^3 of t^2.
double sine_defect(double square) {
  if (square >= series_below) {
    const double t = std::sqrt(square);
    return (t - std::sin(t)) / (t * square);
  }
  double sum = 0.0;
  for (int k = 10; k >= 0; --k) sum = (1.0 - sum * square) / ((2 * k + 2) * (2 * k + 3));
  return sum;
}

void normalize(double* x, int size) {
  const double norm = std::sqrt(dot(x, x, size));
  for (int i = 0; i < size; ++i) x[i] /= norm;
}

void integrate_so2(const double* q, double angle, double* result) {
  const double circle[] = {std::cos(angle), std::sin(angle)};
  turn(q, circle, result);
  normalize(result, 2);
}

void integrate_se2(const double* q, const double* x, double* result) {
  const double w = x[2], half = sinc(0.5 * w);
  // V(w) v = (sin w / w) v + ((1 - cos w) / w) (-v_y, v_x)
  const double V[] = {sinc(w), 0.5 * w * half * half};
  double local[2];
  turn(V, x, local);
  turn(q + 2, local, local);
  result[0] = q[0] + local[0], result[1] = q[1] + local[1];
  integrate_so2(q + 2, w, result + 2);
}

void integrate_so3(const double* q, const double* w, double* result) {
  const double half = 0.5 * std::sqrt(dot(w, w)), size = 0.5 * sinc(half);
  const double step[] = {size * w[0], size * w[1], size * w[2], std::cos(half)};
  multiply(q, step, result);
  normalize(result, 4);
}

void integrate_se3(const double* q, const double* x, double* result) {
  const double *const v = x, *const w = x + 3;
  const double square = dot(w, w), half = sinc(0.5 * std::sqrt(square));
  double once[3], twice[3], local[3];
  cross(w, v, once);
  cross(w, once, twice);
  for (int i = 0; i < 3; ++i)
    local[i] = v[i] + 0.5 * half * half * once[i] + sine_defect(square) * twice[i];
  rotate(q + 3, local, local);
  for (int i = 0; i < 3; ++i) result[i] = q[i] + local[i];
  integrate_so3(q + 3, w, result + 3);
}

}  // namespace

void integrate(const Space& space, const double* q, const double* x, double* result) {
  for (const Part* part = space.part; part != space.part + space.parts; ++part) {
    const double *const from = q + part->q, *const by = x + part->v;
    double* const to = result + part->q;
    switch (part->kind) {
      case Kind::plain:
        for (std::int64_t i = 0; i < part->size; ++i) to[i] = from[i] + by[i];
        break;
      case Kind::so2: integrate_so2(from, by[0], to); break;
      case Kind::se2: integrate_se2(from, by, to); break;
      case Kind::so3: integrate_so3(from, by, to); break;
      case Kind::se3: integrate_se3(from, by, to); break;
    }
  }
}

}  // namespace hovi::groups
