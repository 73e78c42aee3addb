// Inverse dynamics and its derivatives over a pack of points, everything in the world's frame.
//
// phi = curvature^T tau = sum_b w_b . f_b, with w_b the sum of curvature_k S_k over the joints k
// that move body b, and f_b = I_b A_b + V_b x* I_b V_b. So no tensor of n^3 numbers arises: phi's
// gradient and Hessian are sums over the bodies b that a joint i moves,
//   I = sum I_b,  B_V = sum B(I_b, V_b),  B_w = sum B(I_b, w_b),
//   f = sum f_b,  y = sum 2 B(I_b, V_b)^T w_b,  z = sum I_b w_b;
//   dphi/da_i = S . z,  dphi/dv_i = S . y + T . z,  dphi/dq_i = dS . y + ddS . z + L . f
// with V, A, w of the parent in dS = V x S, T = 2 dS, ddS = A x S + V x dS, L = w x S.
// Joint j moves its body and its descendants by S_j. Seen from there, for j and its descendants,
//   dV = dS_j,  dA = ddS_j + dS_j x V,  dw = L_j  per dq_j,
//   dV = S_j,   dA = S_j x V + T_j,     dw = 0    per dv_j,
//   dA = S_j                                      per da_j.
// A base that moves changes little of this: see base.hpp.
// First derivatives: [SinghRussellWensing2022]; multipliers that enter before differentiation:
// [NgangaWensing2021].
#pragma once

#include "base.hpp"

namespace hovi::dynamics {
namespace {

// tau, and on the way all that depends on no multiplier and is not summed.
// No inlining: its rounding must be the same for values alone and with derivatives.
__attribute__((noinline)) void inverse_dynamics(const TreeView& tree, Workspace& work) {
  const Vec zero = zero_vec();
  const Motion rest{zero, zero};
  work.fall = against_gravity(tree, work);
  const Pack one = broadcast(1), none = broadcast(0);
  const Mat identity{{one, none, none}, {none, one, none}, {none, none, one}};
  for (int i = 0; i < tree.n; ++i) {
    const TreeJoint& model = tree.joints[i];
    Joint& joint = work.joints[i];
    const Joint* parent = model.parent < 0 ? nullptr : &work.joints[model.parent];
    const Mat& R = parent ? parent->R : identity;
    const bool floats = moves_base(tree, i);
    if (floats)
      place_on_base(tree.base.twist_indices[i], R, joint);
    else
      place(model, R, parent ? parent->p : zero, work.q + model.q, joint);
    move_body(model, joint);
    const Motion& V = parent ? parent->V : rest;
    joint.dS = floats ? rest : cross(V, joint.S);
    joint.V = V + work.v[i] * joint.S;
    joint.A = (parent ? parent->A : work.fall) + work.a[i] * joint.S + work.v[i] * joint.dS;
    joint.f = body_force(model.mass, joint.moments, joint.V, joint.A);
  }
  for (int i = tree.n - 1; i >= 0; --i) {
    const TreeJoint& model = tree.joints[i];
    const Joint& joint = work.joints[i];
    work.tau[i] = dot(joint.S, joint.f) + model.armature * work.a[i];
    if (model.parent >= 0) {
      Joint& parent = work.joints[model.parent];
      parent.f = parent.f + joint.f;
    }
  }
}

// T, ddS, and B_V of each body. After inverse_dynamics.
__attribute__((noinline)) void first_order(const TreeView& tree, Workspace& work) {
  for (int i = 0; i < tree.n; ++i) {
    const TreeJoint& model = tree.joints[i];
    Joint& joint = work.joints[i];
    joint.B_V = coriolis(model.mass, joint.moments, joint.V);
    const bool floats = moves_base(tree, i), first = floats || model.parent < 0;
    joint.T = floats ? cross(base_velocity(tree, work), joint.S) : joint.dS + joint.dS;
    joint.ddS = cross(first ? work.fall : work.joints[model.parent].A, joint.S);
    if (!first) joint.ddS = joint.ddS + cross(work.joints[model.parent].V, joint.dS);
  }
}

// c_a = I S,  c_v = 2 B_V S + I T,  c_q = 2 B_V dS + I ddS + S x* f,  r = 2 B_V^T S.
__attribute__((noinline)) void add_first_order(const TreeView& tree, Workspace& work) {
  for (int i = tree.n - 1; i >= 0; --i) {
    const TreeJoint& model = tree.joints[i];
    Joint& joint = work.joints[i];
    const double mass = model.subtree_mass;
    joint.c_a = apply(mass, joint.moments, joint.S);
    joint.c_v = 2.0 * (joint.B_V * joint.S) + apply(mass, joint.moments, joint.T);
    joint.c_q = 2.0 * (joint.B_V * joint.dS) + apply(mass, joint.moments, joint.ddS);
    if (!moves_base(tree, i)) joint.c_q = joint.c_q + cross(joint.S, joint.f);
    joint.r = 2.0 * transposed(joint.B_V, joint.S);
    if (model.parent < 0) continue;
    Joint& parent = work.joints[model.parent];
    parent.moments = parent.moments + joint.moments;
    parent.B_V = parent.B_V + joint.B_V;
  }
}

// L, and B_w and y of each body. Between first_order, which finds B_V, and add_first_order, which
// adds up the moments.
__attribute__((noinline)) void second_order(const TreeView& tree, Workspace& work) {
  const Vec zero = zero_vec();
  const Motion rest{zero, zero};
  for (int i = 0; i < tree.n; ++i) {
    const TreeJoint& model = tree.joints[i];
    Joint& joint = work.joints[i];
    const Motion& w = model.parent < 0 ? rest : work.joints[model.parent].w;
    joint.L = moves_base(tree, i) ? rest : cross(w, joint.S);
    joint.w = w + work.curvature[i] * joint.S;
    joint.B_w = coriolis(model.mass, joint.moments, joint.w);
    joint.y = 2.0 * transposed(joint.B_V, joint.w);
  }
}

// e = S x* z + I L,  k = 2 (S x* z - B_w S),  h = S x* y + T x* z - 2 B_w dS + 2 B_V^T L: what the
// changes of the gradient at i by its ancestors are products with. After add_first_order.
__attribute__((noinline)) void add_second_order(const TreeView& tree, Workspace& work) {
  for (int i = tree.n - 1; i >= 0; --i) {
    const TreeJoint& model = tree.joints[i];
    Joint& joint = work.joints[i];
    const Force z = momentum(joint.B_w);
    const Force turned = cross(joint.S, z);
    if (moves_base(tree, i)) {
      joint.e = joint.h = {zero_vec(), zero_vec()};
      joint.k = turned - 2.0 * (joint.B_w * joint.S);
    } else {
      joint.e = turned + apply(model.subtree_mass, joint.moments, joint.L);
      joint.k = 2.0 * (turned - joint.B_w * joint.S);
      joint.h = 2.0 * (cross(joint.dS, z) - joint.B_w * joint.dS);
      joint.h.n = joint.h.n + cross(joint.S.w, joint.y) + 2.0 * transposed(joint.B_V, joint.L);
    }
    if (model.parent < 0) continue;
    Joint& parent = work.joints[model.parent];
    parent.B_w = parent.B_w + joint.B_w;
    parent.y = parent.y + joint.y;
  }
}

}  // namespace
}  // namespace hovi::dynamics
