// The instructions of an expression, each at several points at once.
//
// Every instruction rounds as CasADi's interpreter does, so that results are the same bits.
#pragma once

#include <algorithm>
#include <cstddef>

#include "kernels.hpp"
#include "simd/pack.hpp"

namespace hovi::expressions {
namespace {

static_assert(width % lanes == 0, "registers are whole packs");

// o = operation(x, y), pack by pack.
template <typename Operation>
inline void each(double* o, const double* x, const double* y, Operation operation) {
  for (std::size_t i = 0; i < width; i += lanes) store(o + i, operation(load(x + i), load(y + i)));
}

inline void read(const Program& program, const Instruction& now, std::size_t point,
                 std::size_t count, double* o) {
  const std::size_t size = program.argument_sizes[now.first];
  const double* const from = program.arguments[now.first] + point * size + now.second;
  for (std::size_t lane = 0; lane < width; ++lane)
    o[lane] = from[std::min(lane, count - 1) * size];
}

inline void write(const Program& program, const Instruction& now, std::size_t point,
                  std::size_t count, const double* x) {
  const std::size_t size = program.result_sizes[now.out];
  double* const to = program.results[now.out] + point * size + now.second;
  for (std::size_t lane = 0; lane < count; ++lane) to[lane * size] = x[lane];
}

// At `count` points, at most `width`.
inline void run_block(const Program& program, std::size_t point, std::size_t count,
                      double* registers) {
  const Instruction* const end = program.instructions + program.count;
  for (const Instruction* now = program.instructions; now != end; ++now) {
    double* const o = registers + width * now->out;
    const double* const x = registers + width * now->first;
    const double* const y = registers + width * now->second;
    switch (now->kind) {
      case Kind::constant: std::fill(o, o + width, now->constant); break;
      case Kind::input: read(program, *now, point, count, o); break;
      case Kind::output: write(program, *now, point, count, x); break;
      case Kind::assign: each(o, x, x, [](Pack a, Pack) { return a; }); break;
      case Kind::add: each(o, x, y, [](Pack a, Pack b) { return a + b; }); break;
      case Kind::subtract: each(o, x, y, [](Pack a, Pack b) { return a - b; }); break;
      case Kind::multiply: each(o, x, y, [](Pack a, Pack b) { return a * b; }); break;
      case Kind::divide: each(o, x, y, [](Pack a, Pack b) { return a / b; }); break;
      case Kind::negate: each(o, x, x, [](Pack a, Pack) { return -a; }); break;
      case Kind::square: each(o, x, x, [](Pack a, Pack) { return a * a; }); break;
      case Kind::twice: each(o, x, x, [](Pack a, Pack) { return a + a; }); break;
      case Kind::invert: each(o, x, x, [](Pack a, Pack) { return 1.0 / a; }); break;
      case Kind::root:
        for (std::size_t lane = 0; lane < width; ++lane) o[lane] = __builtin_sqrt(x[lane]);
        break;
      case Kind::other: program.scalar(now->operation, x, y, o); break;
    }
  }
}

void run(const Program& program, std::size_t first, std::size_t last, double* registers) {
  for (std::size_t point = first; point < last; point += width)
    run_block(program, point, std::min(width, last - point), registers);
}

constexpr Kernels kernels{run};

}  // namespace
}  // namespace hovi::expressions
