// The choice of instruction set: the kernels of a module are compiled once for each.
//
// A module declares a table of functions `Kernels` with the static members `baseline` and `avx2`;
// CMake makes a unit that defines one of them, from kernels.in, for each instruction set. These
// units share no inline function with any other: the linker could keep the copy that was compiled
// for the larger instruction set. So only plain data passes between them and the others, and no
// library's templates.
#pragma once

namespace hovi {

// portable: the baseline instruction set, even where the processor has a faster one.
template <typename Kernels>
const Kernels& choose_kernels(bool portable = false) {
#ifdef HOVI_WITH_AVX2
  static const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (avx2 && !portable) return Kernels::avx2;
#endif
  (void)portable;
  return Kernels::baseline;
}

}  // namespace hovi
