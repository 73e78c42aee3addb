// NumPy arrays as function arguments, and aligned memory for packs.
#pragma once

#include <memory>
#include <new>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

namespace hovi::arrays {

template <typename Scalar, int dimensions>
using Array = nanobind::ndarray<Scalar, nanobind::numpy, nanobind::ndim<dimensions>,
                                nanobind::c_contig, nanobind::device::cpu>;
template <int dimensions>
using Input = Array<const double, dimensions>;
template <int dimensions>
using Output = Array<double, dimensions>;

constexpr std::align_val_t alignment{64};

struct Free {
  void operator()(double* memory) const { ::operator delete(memory, alignment); }
};
using Workspace = std::unique_ptr<double, Free>;

inline Workspace allocate(std::size_t numbers) {
  void* memory = ::operator new(numbers * sizeof(double), alignment);
  return Workspace(static_cast<double*>(memory));
}

}  // namespace hovi::arrays
