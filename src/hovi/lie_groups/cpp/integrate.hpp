// q (+) x on products of groups.
#pragma once

#include "doors.hpp"

namespace hovi {

// One configuration. Quaternions are (x, y, z, w), angles of SO(2) and SE(2) (cos, sin); what has
// unit norm leaves with unit norm. result may be q.
void integrate(const Space& space, const double* q, const double* x, double* result);

}  // namespace hovi
