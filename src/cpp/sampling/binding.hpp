// The class PathSampler of the module `dynamics`.
#pragma once

#include <nanobind/nanobind.h>

namespace hovi::sampling {

void bind(nanobind::module_& m);

}  // namespace hovi::sampling
