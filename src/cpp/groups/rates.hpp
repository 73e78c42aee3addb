// Velocities and accelerations of curves q0 (+) x(t), a pack of points at a time.
#pragma once

#include <algorithm>

#include "kernels.hpp"
#include "point_chart.hpp"

namespace hovi::groups {
namespace {

// action(group) for the group of a part whose chart is not the identity.
template <typename Action>
inline void on_group(Kind kind, const Action& action) {
  switch (kind) {
    case Kind::se2: return action(SE2{});
    case Kind::so3: return action(SO3{});
    case Kind::se3: return action(SE3{});
    default: return;
  }
}

inline bool curved(const Part& part) { return part.kind >= Kind::se2; }

// The rows of a pack: those past the last one repeat it, and are not written.
struct Rows {
  std::size_t first, count;
  std::size_t at[lanes];

  Rows(std::size_t begin, std::size_t end) : first(begin), count(std::min(lanes, end - begin)) {
    for (std::size_t lane = 0; lane < lanes; ++lane) at[lane] = std::min(begin + lane, end - 1);
  }
};

inline void transpose(Pack (&x)[lanes]) {
#if HOVI_LANES == 2
  const Pack a = x[0], b = x[1];
  x[0] = Pack{a[0], b[0]}, x[1] = Pack{a[1], b[1]};
#else
  const Pack a = Pack{x[0][0], x[1][0], x[0][2], x[1][2]};
  const Pack b = Pack{x[0][1], x[1][1], x[0][3], x[1][3]};
  const Pack c = Pack{x[2][0], x[3][0], x[2][2], x[3][2]};
  const Pack d = Pack{x[2][1], x[3][1], x[2][3], x[3][3]};
  x[0] = Pack{a[0], a[1], c[0], c[1]}, x[1] = Pack{b[0], b[1], d[0], d[1]};
  x[2] = Pack{a[2], a[3], c[2], c[3]}, x[3] = Pack{b[2], b[3], d[2], d[3]};
#endif
}

// Numbers of each row, `stride` from row to row.
inline void read(const double* from, std::size_t stride, const Rows& rows, std::size_t numbers,
                 Pack* to) {
  std::size_t i = 0;
  for (; i + lanes <= numbers; i += lanes) {
    Pack block[lanes];
    for (std::size_t lane = 0; lane < lanes; ++lane)
      block[lane] = load(from + rows.at[lane] * stride + i);
    transpose(block);
    for (std::size_t j = 0; j < lanes; ++j) to[i + j] = block[j];
  }
  for (; i < numbers; ++i)
    for (std::size_t lane = 0; lane < lanes; ++lane) to[i][lane] = from[rows.at[lane] * stride + i];
}

// The packs lie `spacing` apart.
inline void write(const Pack* from, std::size_t numbers, const Rows& rows, std::size_t stride,
                  double* to, std::size_t spacing = 1) {
  std::size_t i = 0;
  for (; i + lanes <= numbers; i += lanes) {
    Pack block[lanes];
    for (std::size_t j = 0; j < lanes; ++j) block[j] = from[(i + j) * spacing];
    transpose(block);
    for (std::size_t lane = 0; lane < rows.count; ++lane)
      store(to + rows.at[lane] * stride + i, block[lane]);
  }
  for (; i < numbers; ++i) {
    const Pack last = from[i * spacing];
    for (std::size_t lane = 0; lane < rows.count; ++lane)
      to[rows.at[lane] * stride + i] = last[lane];
  }
}

template <typename Group>
inline void rates_of(std::size_t n, const Rows& rows, const double* x, const double* base_rates,
                     std::size_t points, double* v, double* a) {
  constexpr std::size_t k = Group::k;
  Pack in[3][k], out[k];
  for (std::size_t r = 0; r < 3; ++r) read(x + r * points * n, n, rows, k, in[r]);
  const Motion at(curve<Group>(in[0], in[1], in[2]));
  Vector<Dual> velocity = at.v, acceleration = at.a;
  if (base_rates) {
    for (std::size_t r = 0; r < 2; ++r) read(base_rates + r * points * n, n, rows, k, in[r]);
    const Matrix<Dual> Ad = at.adjoint_of_inverse();
    const Vector<Dual> seen = Ad * motion<Group>(in[0]);
    acceleration = Ad * motion<Group>(in[1]) + acceleration - cross(velocity, seen);
    velocity = seen + velocity;
  }
  read<Group>(velocity, out), write(out, k, rows, n, v);
  read<Group>(acceleration, out), write(out, k, rows, n, a);
}

inline void flat_rates(const Part& part, std::size_t n, std::size_t points, const double* x,
                       const double* base_rates, double* v, double* a) {
  for (std::size_t p = 0; p < points; ++p)
    for (std::int64_t i = part.v; i < part.v + part.size; ++i) {
      v[p * n + i] = x[(points + p) * n + i];
      a[p * n + i] = x[(2 * points + p) * n + i];
      if (!base_rates) continue;
      v[p * n + i] += base_rates[p * n + i];
      a[p * n + i] += base_rates[(points + p) * n + i];
    }
}

void rates(const Space& space, std::size_t points, const double* x, const double* base_rates,
           double* v, double* a) {
  const std::size_t n = space.nv;
  for (const Part* part = space.part; part != space.part + space.parts; ++part) {
    if (!curved(*part)) flat_rates(*part, n, points, x, base_rates, v, a);
    on_group(part->kind, [&](auto group) {
      const double* const moving = base_rates ? base_rates + part->v : nullptr;
      for (std::size_t p = 0; p < points; p += lanes)
        rates_of<decltype(group)>(n, Rows(p, points), x + part->v, moving, points, v + part->v,
                                  a + part->v);
    });
  }
}

template <typename Group>
inline void local_rates_of(std::size_t n, const Rows& rows, const double* x, const double* v,
                           const double* a, double* dx, double* ddx) {
  constexpr std::size_t k = Group::k;
  Pack position[k], velocity[k], acceleration[k], still[k] = {};
  read(x, n, rows, k, position), read(v, n, rows, k, velocity), read(a, n, rows, k, acceleration);
  const Turning here(curve<Group>(position, still, still));
  const Matrix<Dual> inverse_J = inverse(coefficient<0>(right_jacobian(here)));
  read<Group>(inverse_J * motion<Group>(velocity), velocity);
  const Turning moving(curve<Group>(position, velocity, still));
  const Matrix<Dual> J1 = coefficient<1>(right_jacobian(moving));
  const Vector<Dual> rest = motion<Group>(acceleration) - J1 * motion<Group>(velocity);
  read<Group>(inverse_J * rest, acceleration);
  write(velocity, k, rows, n, dx), write(acceleration, k, rows, n, ddx);
}

void local_rates(const Space& space, std::size_t points, const double* x, const double* v,
                 const double* a, double* dx, double* ddx) {
  const std::size_t n = space.nv;
  std::copy(v, v + points * n, dx), std::copy(a, a + points * n, ddx);
  for (const Part* part = space.part; part != space.part + space.parts; ++part)
    on_group(part->kind, [&](auto group) {
      const std::size_t i = part->v;
      for (std::size_t p = 0; p < points; p += lanes)
        local_rates_of<decltype(group)>(n, Rows(p, points), x + i, v + i, a + i, dx + i, ddx + i);
    });
}

}  // namespace
}  // namespace hovi::groups
