// A base that moves on a group: the first joints of the tree are the components of its velocity.
//
// What is in the world's frame for a robot that stands is in the base's own frame here. There its
// velocity and acceleration are sums of v_j S_j and a_j S_j with constant S_j, and where it is
// enters only through gravity, as an acceleration `fall` that turns against it. Instead of the
// changes in recursions.hpp, for all joints on the base and the base itself,
//   dV = 0,    dA = fall x S_j,     dw = 0   per dq_j: so dS = L = 0, ddS = fall x S,
//   dV = S_j,  dA = S_j x V + T_j,  dw = 0   per dv_j with T = V x S, V of the base,
// and nothing turns S_i of another of its joints: c_q lacks S x* f, e = h = 0,
// k = S x* z - 2 B_w S.
// fall(d) = fall - d x fall + d x (d x fall) / 2 adds its bend to d2 phi / dq_i dq_j.
#pragma once

#include "joint.hpp"

namespace hovi::dynamics {
namespace {

inline bool moves_base(const TreeView& tree, int joint) { return joint < tree.base.size; }

// R^T g, with R the rotation of the base.
Vec in_base(const TreeBase& base, const Pack* q, const Vec& g) {
  if (base.planar) return {q[0] * g.x + q[1] * g.y, q[0] * g.y - q[1] * g.x, g.z};
  const Vec axis{q[0], q[1], q[2]};
  const Vec twice = 2.0 * cross(g, axis);
  return g + q[3] * twice + cross(twice, axis);
}

inline Motion against_gravity(const TreeView& tree, const Workspace& work) {
  const double* g = tree.gravity;
  Motion fall{{broadcast(-g[3]), broadcast(-g[4]), broadcast(-g[5])},
              {broadcast(-g[0]), broadcast(-g[1]), broadcast(-g[2])}};
  if (tree.base.size > 0) fall.u = in_base(tree.base, work.q + tree.base.q, fall.u);
  return fall;
}

void place_on_base(int twist_index, const Mat& identity, Joint& joint) {
  const Vec zero = zero_vec();
  const Vec axis = twist_index % 3 == 0   ? identity.x
                   : twist_index % 3 == 1 ? identity.y
                                          : identity.z;
  joint.S = twist_index < 3 ? Motion{zero, axis} : Motion{axis, zero};
  joint.R = identity;
  joint.p = zero;
}

inline const Motion& base_velocity(const TreeView& tree, const Workspace& work) {
  return work.joints[tree.base.size - 1].V;
}

// d2/dq_i dq_j of F . fall, with F the force of z. After add_second_order.
inline Pack bend(const Workspace& work, const Joint& i, const Joint& j) {
  const Vec &F = work.joints[0].B_w.p, &fall = work.fall.u;
  const Vec &x = i.S.w, &y = j.S.w;
  return 0.5 * (dot(F, x) * dot(fall, y) + dot(F, y) * dot(fall, x)) - dot(x, y) * dot(F, fall);
}

}  // namespace
}  // namespace hovi::dynamics
