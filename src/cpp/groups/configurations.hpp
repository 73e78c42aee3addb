// q (+) x and q1 (-) q0 on products of groups, one configuration at a time.
//
// Quaternions are (x, y, z, w), angles of SO(2) and SE(2) (cos, sin).
#pragma once

#include "kernels.hpp"

namespace hovi::groups {

// What has unit norm leaves with unit norm. result may be q.
void integrate(const Space& space, const double* q, const double* x, double* result);

// The tangent vector of least angles from q0 to q1; with the full turns that come nearest to an
// expected answer where there is one.
void difference(const Space& space, const double* q0, const double* q1, const double* expected,
                double* result);

}  // namespace hovi::groups
