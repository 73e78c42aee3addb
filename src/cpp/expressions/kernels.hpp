// The functions that are compiled once per instruction set: see simd/dispatch.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace hovi::expressions {

// Points that an instruction works on together.
constexpr std::size_t width = 16;

enum class Kind : std::uint8_t {
  constant,
  input,
  output,
  assign,
  add,
  subtract,
  multiply,
  divide,
  negate,
  square,
  twice,
  invert,
  root,
  other,
};

// One instruction on registers: `out` from `first` and `second`. An input takes entry `second` of
// argument `first`, an output writes `first` to entry `second` of result `out`. operation: CasADi's
// number of another one.
struct Instruction {
  Kind kind;
  std::uint8_t operation;
  std::uint32_t out, first, second;
  double constant;
};

// f[i] of x[i] and y[i] for an operation of CasADi, i < width.
using Scalar = void (*)(std::uint8_t operation, const double* x, const double* y, double* f);

// count: of the instructions. arguments, results: of P points each, rows of `argument_sizes` and
// `result_sizes` numbers.
struct Program {
  const Instruction* instructions;
  std::size_t count;
  const double* const* arguments;
  const std::size_t* argument_sizes;
  double* const* results;
  const std::size_t* result_sizes;
  Scalar scalar;
};

struct Kernels {
  // Run at the points from `first` up to `last`. registers: memory for `width` numbers of each.
  void (*run)(const Program& program, std::size_t first, std::size_t last, double* registers);

  static const Kernels baseline, avx2;
};

}  // namespace hovi::expressions
