#include "integrate.hpp"

#include <cmath>

namespace hovi {
namespace {

constexpr double series_below = 1.0;  // angles squared for which closed forms lose digits

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

void cross(const double* x, const double* y, double* out) {
  const double z[] = {x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2],
                      x[0] * y[1] - x[1] * y[0]};
  for (int i = 0; i < 3; ++i) out[i] = z[i];
}

void normalize(double* x, int size) {
  double square = 0.0;
  for (int i = 0; i < size; ++i) square += x[i] * x[i];
  const double norm = std::sqrt(square);
  for (int i = 0; i < size; ++i) x[i] /= norm;
}

// The product of complex numbers (real, imaginary): p turned by c.
void turn(const double* c, const double* p, double* out) {
  const double real = c[0] * p[0] - c[1] * p[1], imaginary = c[1] * p[0] + c[0] * p[1];
  out[0] = real, out[1] = imaginary;
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
  const double half = 0.5 * std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  const double size = 0.5 * sinc(half), scalar = std::cos(half);
  const double u[] = {size * w[0], size * w[1], size * w[2]};
  double across[3];
  cross(q, u, across);
  const double real = q[3] * scalar - (q[0] * u[0] + q[1] * u[1] + q[2] * u[2]);
  for (int i = 0; i < 3; ++i) result[i] = q[3] * u[i] + scalar * q[i] + across[i];
  result[3] = real;
  normalize(result, 4);
}

void integrate_se3(const double* q, const double* x, double* result) {
  const double *const v = x, *const w = x + 3, *const u = q + 3;
  const double square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
  const double half = sinc(0.5 * std::sqrt(square)), defect = sine_defect(square);
  double once[3], twice[3], local[3];
  cross(w, v, once);
  cross(w, once, twice);
  for (int i = 0; i < 3; ++i) local[i] = v[i] + 0.5 * half * half * once[i] + defect * twice[i];
  // turned by the quaternion: local + 2 s u x local + 2 u x (u x local)
  cross(u, local, once);
  cross(u, once, twice);
  for (int i = 0; i < 3; ++i) result[i] = q[i] + local[i] + 2.0 * (u[3] * once[i] + twice[i]);
  integrate_so3(u, w, result + 3);
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

}  // namespace hovi
