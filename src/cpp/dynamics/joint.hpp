// A joint, the body it moves, and what the algorithms keep of a pack of points.
#pragma once

#include <cmath>

#include "algebra.hpp"
#include "kernels.hpp"

namespace hovi::dynamics {
namespace {

// One joint and the body it moves. From `moments` on, a body's quantity becomes the sum over all
// that the joint moves as the recursion goes back to the base.
struct Joint {
  Mat R;
  Vec p;
  Motion S, dS, ddS, T, L;
  Motion V, A, w;
  Moments moments;
  Force f;
  Coriolis B_V, B_w;
  Vec y;  // 2 B_V^T w summed over bodies: a moment

  Force c_q, c_v, c_a;  // dtau_j/d(q,v,a)_i = S_j . c for the ancestors j of this joint i
  Vec r;                // 2 B_V^T S
  Force e, k, h;        // second derivatives of phi: see torque_hessian.hpp
};

struct Workspace {
  Joint* joints;
  Pack *q, *v, *a, *weight, *curvature;
  Pack *tau, *J, *weighted_J;
  const Pack* zeros;  // nine of them
  Motion fall;        // against gravity: the acceleration of what all joints stand on
};

// Where the joint is: R, p, S and the moments of its body.
void place(const TreeJoint& model, const Mat& R, const Vec& p, const Pack* q, Joint& joint) {
  Mat T{rotate(R, model.rotation), rotate(R, model.rotation + 3), rotate(R, model.rotation + 6)};
  Vec origin = p + rotate(R, model.translation);
  if (model.angular != 0) {
    Pack s, c;
    if (model.continuous) {
      c = q[0];
      s = q[1];
    } else {
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        s[lane] = std::sin(q[0][lane]);
        c[lane] = std::cos(q[0][lane]);
      }
    }
    T = {c * T.x + s * T.y, c * T.y - s * T.x, T.z};
  }
  joint.S = {model.angular * T.z, model.angular * cross(origin, T.z)};
  if (model.linear != 0) {
    joint.S.u = joint.S.u + model.linear * T.z;
    origin = origin + (model.linear * q[0]) * T.z;
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

}  // namespace
}  // namespace hovi::dynamics
