// The chain rule of charts, a pack of intervals at a time: covectors of (q, h v, h^2 a) at the
// points and of (x1, h x1') at the far ends, pulled back, and steps pushed forward.
//
// Arrays of packs are strided twice: by `order` from q to v, and by `spacing` from one coordinate
// to the next, so that rows and columns of a Hessian are covectors alike.
#pragma once

#include "end_chart.hpp"
#include "rates.hpp"

namespace hovi::groups {
namespace {

// sum += n L. L is a linear map of the group.
template <typename Group>
[[gnu::always_inline]] inline void add_pulled(const Pack* n, std::size_t spacing,
                                              const Square<Group>& L, Pack (&sum)[Group::k]) {
  for (std::size_t i = 0; i < Group::k; ++i)
    for (std::size_t j = i < Group::translations ? 0 : Group::translations; j < Group::k; ++j)
      sum[j] += n[i * spacing] * L.at[i][j];
}

// sum += L x.
template <typename Group>
[[gnu::always_inline]] inline void add_pushed(const Square<Group>& L, const Pack* x,
                                              Pack (&sum)[Group::k]) {
  for (std::size_t i = 0; i < Group::k; ++i)
    for (std::size_t j = i < Group::translations ? 0 : Group::translations; j < Group::k; ++j)
      sum[i] += L.at[i][j] * x[j];
}

template <typename Group>
inline void put(const Pack (&sum)[Group::k], Pack* to, std::size_t spacing) {
  for (std::size_t i = 0; i < Group::k; ++i) to[i * spacing] = sum[i];
}

// A covector of (q, v, a) as one of (q0, x, x', x'').
template <typename Group>
inline void pull(const PointJacobian<Group>& by, const Pack* n, std::size_t order,
                 std::size_t spacing, Pack* out) {
  const Pack *const q = n, *const v = n + order, *const a = v + order;
  Pack base[Group::k] = {}, x[Group::k] = {}, dx[Group::k] = {}, ddx[Group::k] = {};
  add_pulled<Group>(q, spacing, by.inverse_adjoint, base);
  add_pulled<Group>(q, spacing, by.J, x);
  add_pulled<Group>(v, spacing, by.K, x);
  add_pulled<Group>(a, spacing, by.K1, x);
  add_pulled<Group>(v, spacing, by.J, dx);
  add_pulled<Group>(a, spacing, by.J1_K, dx);
  add_pulled<Group>(a, spacing, by.J, ddx);
  put<Group>(base, out, spacing);
  put<Group>(x, out + order, spacing);
  put<Group>(dx, out + 2 * order, spacing);
  put<Group>(ddx, out + 3 * order, spacing);
}

// A covector of (q0, h v0, x1, h x1', ...) as one of (q0, h v0, q1, h v1, ...), in place.
template <typename Group>
inline void pull_end(const EndJacobian<Group>& by, Pack* n, std::size_t order,
                     std::size_t spacing) {
  const Pack *const x = n + 2 * order, *const dx = x + order;
  Pack q0[Group::k], q1[Group::k] = {}, v1[Group::k] = {};
  for (std::size_t i = 0; i < Group::k; ++i) q0[i] = n[i * spacing];
  add_pulled<Group>(x, spacing, by.x_by[0], q0);
  add_pulled<Group>(dx, spacing, by.dx_by[0], q0);
  add_pulled<Group>(x, spacing, by.x_by[1], q1);
  add_pulled<Group>(dx, spacing, by.dx_by[1], q1);
  add_pulled<Group>(dx, spacing, by.inverse_J, v1);
  put<Group>(q0, n, spacing);
  put<Group>(q1, n + 2 * order, spacing);
  put<Group>(v1, n + 3 * order, spacing);
}

// A step of (q0, x, x', x'') as one of (q, v, a), in its first three blocks.
template <typename Group>
inline void push(const PointJacobian<Group>& by, Pack* step, std::size_t order) {
  const Pack *const base = step, *const x = base + order, *const dx = x + order,
                   *const ddx = dx + order;
  Pack q[Group::k] = {}, v[Group::k] = {}, a[Group::k] = {};
  add_pushed<Group>(by.inverse_adjoint, base, q);
  add_pushed<Group>(by.J, x, q);
  add_pushed<Group>(by.K, x, v);
  add_pushed<Group>(by.J, dx, v);
  add_pushed<Group>(by.K1, x, a);
  add_pushed<Group>(by.J1_K, dx, a);
  add_pushed<Group>(by.J, ddx, a);
  put<Group>(q, step, 1), put<Group>(v, step + order, 1), put<Group>(a, step + 2 * order, 1);
}

// A step of (q0, h v0, q1, h v1, ...) as one of (q0, h v0, x1, h x1', ...), in place.
template <typename Group>
inline void push_end(const EndJacobian<Group>& by, Pack* step, std::size_t order) {
  const Pack *const q0 = step, *const q1 = step + 2 * order, *const v1 = step + 3 * order;
  Pack x[Group::k] = {}, dx[Group::k] = {};
  add_pushed<Group>(by.x_by[0], q0, x);
  add_pushed<Group>(by.x_by[1], q1, x);
  add_pushed<Group>(by.dx_by[0], q0, dx);
  add_pushed<Group>(by.dx_by[1], q1, dx);
  add_pushed<Group>(by.inverse_J, v1, dx);
  put<Group>(x, step + 2 * order, 1), put<Group>(dx, step + 3 * order, 1);
}

}  // namespace
}  // namespace hovi::groups
