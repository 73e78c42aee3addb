// Inverse dynamics and its derivatives over a pack of points, everything in the world's frame.
//
// phi = curvature^T tau = sum_b w_b . f_b, with w_b the sum of curvature_k S_k over the joints k
// that carry body b, and f_b = I_b A_b + V_b x* I_b V_b. So no tensor of n^3 numbers arises: phi's
// gradient and Hessian are sums over the bodies b that a joint i carries,
//   I = sum I_b,  B_V = sum B(I_b, V_b),  B_w = sum B(I_b, w_b),
//   f = sum f_b,  y = sum 2 B(I_b, V_b)^T w_b,  z = sum I_b w_b;
//   dphi/da_i = S . z,  dphi/dv_i = S . y + 2 dS . z,  dphi/dq_i = dS . y + ddS . z + L . f
// with V, A, w of the parent in dS = V x S, ddS = A x S + V x dS, L = w x S.
// Turning joint j moves all that it carries by S_j. Seen from there, for what j carries and itself,
//   dV = dS_j,  dA = ddS_j + dS_j x V,  dw = L_j  per dq_j,
//   dV = S_j,   dA = S_j x V + 2 dS_j,  dw = 0    per dv_j,
//   dA = S_j                                      per da_j.
// First derivatives: [SinghRussellWensing2022]; multipliers that enter before differentiation:
// [NgangaWensing2021].
#pragma once

#include <cmath>

#include "packed_algebra.hpp"
#include "packed_kernel.hpp"

namespace hovi {
namespace {

// One joint and the body it moves. From `moments` on, a body's quantity becomes the sum over all
// that the joint carries as the recursion goes back to the base.
struct Joint {
  Mat R;
  Vec p;
  Motion S, dS, ddS, L;
  Motion V, A, w;
  Moments moments;
  Force f;
  Coriolis B_V, B_w;
  Vec y;  // 2 B_V^T w summed over bodies: a moment

  Force c_q, c_v, c_a;  // dtau_j/d(q,v,a)_i = S_j . c for the ancestors j of this joint i
  Vec r;                // 2 B_V^T S
  Force e, k, h;        // second derivatives of phi: see packed_pairs.hpp
};

struct Workspace {
  Joint* joints;
  Pack *q, *v, *a, *weight, *curvature;
  Pack *tau, *J, *weighted_J;
  const Pack* zeros;  // nine of them
};

// Where the joint is: R, p, S and the moments of its body.
void place(const TreeJoint& model, const Mat& R, const Vec& p, const Pack& q, Joint& joint) {
  Mat T{rotate(R, model.rotation), rotate(R, model.rotation + 3), rotate(R, model.rotation + 6)};
  Vec origin = p + rotate(R, model.translation);
  if (model.turn != 0) {
    Pack s, c;
    for (int lane = 0; lane < lanes; ++lane) {
      s[lane] = std::sin(q[lane]);
      c[lane] = std::cos(q[lane]);
    }
    T = {c * T.x + s * T.y, c * T.y - s * T.x, T.z};
  }
  joint.S = {model.turn * T.z, model.turn * cross(origin, T.z)};
  if (model.slide != 0) {
    joint.S.u = joint.S.u + model.slide * T.z;
    origin = origin + (model.slide * q) * T.z;
  }
  joint.R = T;
  joint.p = origin;
}

void move_body(const TreeJoint& model, Joint& joint) {
  const Mat& R = joint.R;
  const Vec center = joint.p + rotate(R, model.center);
  const Vec h = model.mass * center;
  const double* m = model.moment;
  const double columns[9] = {m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5]};
  const Mat RM{rotate(R, columns), rotate(R, columns + 3), rotate(R, columns + 6)};
  const auto entry = [&](Pack Vec::*r, Pack Vec::*c) {
    return RM.x.*r * (R.x.*c) + RM.y.*r * (R.y.*c) + RM.z.*r * (R.z.*c) + h.*r * (center.*c);
  };
  joint.moments = {h,
                   {entry(&Vec::x, &Vec::x), entry(&Vec::x, &Vec::y), entry(&Vec::x, &Vec::z),
                    entry(&Vec::y, &Vec::y), entry(&Vec::y, &Vec::z), entry(&Vec::z, &Vec::z)}};
}

// f = integral of (x x K(x), K(x)) dm with K(x) = (A^ + V^ V^) x the acceleration at x.
Force body_force(double mass, const Moments& I, const Motion& V, const Motion& A) {
  const Vec& w = V.w;
  const Pack xx = w.x * w.x, yy = w.y * w.y, zz = w.z * w.z;
  const Pack xy = w.x * w.y, xz = w.x * w.z, yz = w.y * w.z;
  const Mat K{{-(yy + zz), xy + A.w.z, xz - A.w.y},
              {xy - A.w.z, -(xx + zz), yz + A.w.x},
              {xz + A.w.y, yz - A.w.x, -(xx + yy)}};
  const Mat sigma = full(I.sigma);
  const Vec origin = A.u + cross(w, V.u);
  return {cross(I.h, origin) + axial({K * sigma.x, K * sigma.y, K * sigma.z}),
          mass * origin + K * I.h};
}

// tau, and on the way all that depends on no multiplier and is not summed.
// No inlining: its rounding must be the same for values alone and with derivatives.
__attribute__((noinline)) void inverse_dynamics(const TreeView& tree, Workspace& work) {
  const double* g = tree.gravity;
  const Vec zero = zero_vec();
  const Motion rest{zero, zero};
  const Motion fall{{broadcast(-g[3]), broadcast(-g[4]), broadcast(-g[5])},
                    {broadcast(-g[0]), broadcast(-g[1]), broadcast(-g[2])}};
  const Pack one = broadcast(1), none = broadcast(0);
  const Mat identity{{one, none, none}, {none, one, none}, {none, none, one}};
  for (int i = 0; i < tree.n; ++i) {
    const TreeJoint& model = tree.joints[i];
    Joint& joint = work.joints[i];
    const Joint* parent = model.parent < 0 ? nullptr : &work.joints[model.parent];
    place(model, parent ? parent->R : identity, parent ? parent->p : zero, work.q[i], joint);
    move_body(model, joint);
    const Motion& V = parent ? parent->V : rest;
    joint.dS = cross(V, joint.S);
    joint.V = V + work.v[i] * joint.S;
    joint.A = (parent ? parent->A : fall) + work.a[i] * joint.S + work.v[i] * joint.dS;
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

// ddS, and B_V of each body. After inverse_dynamics.
__attribute__((noinline)) void first_order(const TreeView& tree, Workspace& work) {
  const double* g = tree.gravity;
  const Motion fall{{broadcast(-g[3]), broadcast(-g[4]), broadcast(-g[5])},
                    {broadcast(-g[0]), broadcast(-g[1]), broadcast(-g[2])}};
  for (int i = 0; i < tree.n; ++i) {
    const TreeJoint& model = tree.joints[i];
    Joint& joint = work.joints[i];
    joint.B_V = coriolis(model.mass, joint.moments, joint.V);
    const bool fixed = model.parent < 0;
    const Motion& A = fixed ? fall : work.joints[model.parent].A;
    joint.ddS = cross(A, joint.S);
    if (!fixed) joint.ddS = joint.ddS + cross(work.joints[model.parent].V, joint.dS);
  }
}

// c_a = I S,  c_v = 2 (B_V S + I dS),  c_q = 2 B_V dS + I ddS + S x* f,  r = 2 B_V^T S.
__attribute__((noinline)) void add_first_order(const TreeView& tree, Workspace& work) {
  for (int i = tree.n - 1; i >= 0; --i) {
    const TreeJoint& model = tree.joints[i];
    Joint& joint = work.joints[i];
    const double mass = model.subtree_mass;
    joint.c_a = apply(mass, joint.moments, joint.S);
    joint.c_v = 2.0 * (joint.B_V * joint.S + apply(mass, joint.moments, joint.dS));
    joint.c_q = 2.0 * (joint.B_V * joint.dS) + apply(mass, joint.moments, joint.ddS) +
                cross(joint.S, joint.f);
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
    joint.L = cross(w, joint.S);
    joint.w = w + work.curvature[i] * joint.S;
    joint.B_w = coriolis(model.mass, joint.moments, joint.w);
    joint.y = 2.0 * transposed(joint.B_V, joint.w);
  }
}

// e = S x* z + I L,  k = 2 (S x* z - B_w S),  h = S x* y + 2 dS x* z - 2 B_w dS + 2 B_V^T L: what
// the changes of the gradient at i by its carriers are products with. After add_first_order.
__attribute__((noinline)) void add_second_order(const TreeView& tree, Workspace& work) {
  for (int i = tree.n - 1; i >= 0; --i) {
    const TreeJoint& model = tree.joints[i];
    Joint& joint = work.joints[i];
    const Force z = momentum(joint.B_w);
    const Force turned = cross(joint.S, z);
    joint.e = turned + apply(model.subtree_mass, joint.moments, joint.L);
    joint.k = 2.0 * (turned - joint.B_w * joint.S);
    joint.h = 2.0 * (cross(joint.dS, z) - joint.B_w * joint.dS);
    joint.h.n = joint.h.n + cross(joint.S.w, joint.y) + 2.0 * transposed(joint.B_V, joint.L);
    if (model.parent < 0) continue;
    Joint& parent = work.joints[model.parent];
    parent.B_w = parent.B_w + joint.B_w;
    parent.y = parent.y + joint.y;
  }
}

}  // namespace
}  // namespace hovi
