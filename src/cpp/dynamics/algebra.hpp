// Spatial vectors [Featherstone2008] of packs: each number is that of several points at once.
//
// Everything is in an unnamed namespace: each instruction set has its own (see simd/dispatch.hpp).
#pragma once

#include "simd/pack.hpp"

namespace hovi::dynamics {
namespace {

struct Vec {
  Pack x, y, z;
};

inline Vec operator+(const Vec& a, const Vec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(const Vec& a, const Vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(const Pack& s, const Vec& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Vec operator*(double s, const Vec& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Pack dot(const Vec& a, const Vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Vec zero_vec() { return {Pack{}, Pack{}, Pack{}}; }

// By columns.
struct Mat {
  Vec x, y, z;
};

inline Mat operator+(const Mat& A, const Mat& B) { return {A.x + B.x, A.y + B.y, A.z + B.z}; }
inline Vec operator*(const Mat& A, const Vec& b) { return b.x * A.x + b.y * A.y + b.z * A.z; }
inline Vec transposed(const Mat& A, const Vec& b) {
  return {dot(A.x, b), dot(A.y, b), dot(A.z, b)};
}
inline Vec rotate(const Mat& R, const double* b) { return b[0] * R.x + b[1] * R.y + b[2] * R.z; }

// v(A)_i = sum_jk epsilon_ijk A_kj: of u x^T it is x x u.
inline Vec axial(const Mat& A) { return {A.y.z - A.z.y, A.z.x - A.x.z, A.x.y - A.y.x}; }

struct Sym {
  Pack xx, xy, xz, yy, yz, zz;
};

inline Sym operator+(const Sym& A, const Sym& B) {
  return {A.xx + B.xx, A.xy + B.xy, A.xz + B.xz, A.yy + B.yy, A.yz + B.yz, A.zz + B.zz};
}
inline Mat full(const Sym& A) {
  return {{A.xx, A.xy, A.xz}, {A.xy, A.yy, A.yz}, {A.xz, A.yz, A.zz}};
}

struct Motion {
  Vec w, u;  // angular, linear
};

struct Force {
  Vec n, f;  // moment, force
};

inline Motion operator+(const Motion& a, const Motion& b) { return {a.w + b.w, a.u + b.u}; }
inline Motion operator*(const Pack& s, const Motion& a) { return {s * a.w, s * a.u}; }
inline Motion cross(const Motion& a, const Motion& b) {
  return {cross(a.w, b.w), cross(a.w, b.u) + cross(a.u, b.w)};
}

inline Force operator+(const Force& a, const Force& b) { return {a.n + b.n, a.f + b.f}; }
inline Force operator-(const Force& a, const Force& b) { return {a.n - b.n, a.f - b.f}; }
inline Force operator*(double s, const Force& a) { return {s * a.n, s * a.f}; }
inline Force cross(const Motion& a, const Force& b) {
  return {cross(a.w, b.n) + cross(a.u, b.f), cross(a.w, b.f)};
}
inline Pack dot(const Motion& a, const Force& b) { return dot(a.w, b.n) + dot(a.u, b.f); }

// Mass, first and second moment about the world's origin: I (w, u) = (Ibar w + h x u, m u - h x w)
// with Ibar = tr(Sigma) 1 - Sigma.
struct Moments {
  Vec h;
  Sym sigma;
};

inline Moments operator+(const Moments& a, const Moments& b) {
  return {a.h + b.h, a.sigma + b.sigma};
}

// B(I, V) x = 1/2 (V x* I - I V x + (I V) x*) x, linear in I and V [SinghRussellWensing2022].
// In the world's frame it is (C w, w x p): C = -(W Sigma + H U) with W, H, U the cross matrices of
// V.w, h, V.u, and p = m V.u + V.w x h. With it -v(C) and p are moment and force of I V, and
// B(I, V)^T w = -B(I, w)^T V.
struct Coriolis {
  Mat C;
  Vec p;
};

inline Coriolis operator+(const Coriolis& a, const Coriolis& b) { return {a.C + b.C, a.p + b.p}; }

inline Coriolis coriolis(double mass, const Moments& I, const Motion& V) {
  const Mat sigma = full(I.sigma);
  Mat C{cross(sigma.x, V.w) - I.h.x * V.u, cross(sigma.y, V.w) - I.h.y * V.u,
        cross(sigma.z, V.w) - I.h.z * V.u};
  const Pack trace = dot(V.u, I.h);
  C.x.x += trace;
  C.y.y += trace;
  C.z.z += trace;
  return {C, mass * V.u + cross(V.w, I.h)};
}

inline Force operator*(const Coriolis& B, const Motion& x) { return {B.C * x.w, cross(x.w, B.p)}; }

// B^T x, whose force vanishes.
inline Vec transposed(const Coriolis& B, const Motion& x) {
  return transposed(B.C, x.w) + cross(B.p, x.u);
}

inline Force momentum(const Coriolis& B) { return {zero_vec() - axial(B.C), B.p}; }

inline Force apply(double mass, const Moments& I, const Motion& x) {
  const Sym& s = I.sigma;
  const Sym inertia{s.yy + s.zz, -s.xy, -s.xz, s.xx + s.zz, -s.yz, s.xx + s.yy};
  return {full(inertia) * x.w + cross(I.h, x.u), mass * x.u + cross(x.w, I.h)};
}

}  // namespace
}  // namespace hovi::dynamics
