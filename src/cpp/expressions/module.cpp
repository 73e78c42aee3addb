// The Python binding: CasADi functions of SX expressions, evaluated at many points.
#include <casadi/core/function.hpp>
#include <nanobind/nanobind.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "kernels.hpp"
#include "simd/arrays.hpp"
#include "simd/dispatch.hpp"
#include "simd/threads.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hovi::arrays;
using namespace hovi::expressions;

namespace {

// Approximate time of an instruction at a point, with AVX2 [ns].
constexpr double instruction_cost = 1.0;

void scalar(std::uint8_t operation, const double* x, const double* y, double* f) {
  casadi::casadi_math<double>::fun(operation, x, y, f, static_cast<casadi_int>(width));
}

Kind kind_of(casadi_int operation) {
  switch (operation) {
    case casadi::OP_CONST: return Kind::constant;
    case casadi::OP_INPUT: return Kind::input;
    case casadi::OP_OUTPUT: return Kind::output;
    case casadi::OP_ASSIGN: return Kind::assign;
    case casadi::OP_ADD: return Kind::add;
    case casadi::OP_SUB: return Kind::subtract;
    case casadi::OP_MUL: return Kind::multiply;
    case casadi::OP_DIV: return Kind::divide;
    case casadi::OP_NEG: return Kind::negate;
    case casadi::OP_SQ: return Kind::square;
    case casadi::OP_TWICE: return Kind::twice;
    case casadi::OP_INV: return Kind::invert;
    case casadi::OP_SQRT: return Kind::root;
    default: return Kind::other;
  }
}

// The function that an object of CasADi's Python module wraps. Throws TypeError for other objects.
const casadi::Function& wrapped(nb::handle object) {
  if (!nb::isinstance(object, nb::module_::import_("casadi").attr("Function")))
    throw nb::type_error("function must be a casadi.Function.");
  const nb::object address = nb::steal(PyNumber_Long(object.attr("this").ptr()));  // as SWIG has it
  if (!address.is_valid()) nb::raise_python_error();
  return *reinterpret_cast<const casadi::Function*>(nb::cast<std::uintptr_t>(address));
}

// The instructions of a function, which are read once, and run at points of any number.
class Expression {
 public:
  // function: of SX expressions with dense arguments and results, which calls no others.
  explicit Expression(const casadi::Function& function) {
    for (casadi_int i = 0; i < function.n_in(); ++i)
      arguments_.push_back(static_cast<std::size_t>(function.numel_in(i)));
    for (casadi_int i = 0; i < function.n_out(); ++i)
      results_.push_back(static_cast<std::size_t>(function.numel_out(i)));
    registers_ = static_cast<std::size_t>(function.sz_w());
    instructions_.reserve(static_cast<std::size_t>(function.n_instructions()));
    for (casadi_int k = 0; k < function.n_instructions(); ++k) add(function, k);
  }

  // arguments: arrays (P, width). results: arrays (P, size), which are written.
  void operator()(nb::tuple arguments, nb::tuple results, std::size_t points, int threads) const {
    if (nb::len(arguments) != arguments_.size() || nb::len(results) != results_.size())
      refuse("arguments and results must be as many as the function has.");
    std::vector<const double*> from;
    std::vector<double*> to;
    for (std::size_t i = 0; i < arguments_.size(); ++i) {
      const Input<2> each(arguments[i]);
      each.require(("argument " + std::to_string(i)).c_str(), {points, arguments_[i]});
      from.push_back(each.data());
    }
    for (std::size_t i = 0; i < results_.size(); ++i) {
      const Output<2> each(results[i]);
      each.require(("result " + std::to_string(i)).c_str(), {points, results_[i]});
      to.push_back(each.data());
    }
    const nb::gil_scoped_release unlocked;
    run({instructions_.data(), instructions_.size(), from.data(), arguments_.data(), to.data(),
         results_.data(), scalar},
        points, threads);
  }

 private:
  void add(const casadi::Function& function, casadi_int k) {
    const casadi_int operation = function.instruction_id(k);
    Instruction now{kind_of(operation), static_cast<std::uint8_t>(operation), 0, 0, 0, 0.0};
    const auto in = function.instruction_input(k), out = function.instruction_output(k);
    const auto number = [](const std::vector<casadi_int>& of, std::size_t i) {
      return of.size() > i ? static_cast<std::uint32_t>(of[i]) : 0;
    };
    now.out = number(out, 0);
    now.first = number(in, 0);
    now.second = number(now.kind == Kind::output ? out : in, 1);
    if (now.kind == Kind::constant) now.constant = function.instruction_constant(k);
    if (now.kind == Kind::other && in.size() < 2) now.second = now.first;
    instructions_.push_back(now);
  }

  // The threads take contiguous chunks of whole blocks.
  void run(const Program& program, std::size_t points, int threads) const {
    const Kernels& kernels = hovi::choose_kernels<Kernels>();
    const std::size_t blocks = (points + width - 1) / width, memory = width * (registers_ + 1);
    const double work = instruction_cost * static_cast<double>(points * program.count);
    const std::size_t chunks =
        hovi::useful_threads(static_cast<std::size_t>(std::max(threads, 1)), work);
    const Workspace registers = allocate(chunks * memory);
    hovi::share_out(chunks, [&](std::size_t chunk) {
      const std::size_t first = blocks * chunk / chunks * width;
      const std::size_t last = std::min(blocks * (chunk + 1) / chunks * width, points);
      kernels.run(program, first, last, registers.get() + chunk * memory);
    });
  }

  std::vector<Instruction> instructions_;
  std::vector<std::size_t> arguments_, results_;
  std::size_t registers_ = 0;
};

// Whether a function is of SX expressions with dense arguments and results, and calls no others.
bool is_expression(const casadi::Function& function) {
  if (!function.is_a("SXFunction")) return false;
  for (casadi_int i = 0; i < function.n_in(); ++i)
    if (!function.sparsity_in(i).is_dense()) return false;
  for (casadi_int i = 0; i < function.n_out(); ++i)
    if (!function.sparsity_out(i).is_dense()) return false;
  for (casadi_int k = 0; k < function.n_instructions(); ++k)
    if (function.instruction_id(k) == casadi::OP_CALL) return false;
  return true;
}

nb::object expression_of(nb::handle object) {
  const casadi::Function& function = wrapped(object);
  return is_expression(function) ? nb::cast(Expression(function)) : nb::none();
}

}  // namespace

NB_MODULE(expressions, m) {
  m.def("expression_of", &expression_of, "function"_a);
  nb::class_<Expression>(m, "Expression")
      .def("__call__", &Expression::operator(), "arguments"_a, "results"_a, "points"_a,
           "threads"_a);
}
