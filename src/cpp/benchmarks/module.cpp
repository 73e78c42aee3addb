// The Python binding of functions for a benchmark.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <string>

#include "dynamics/symbolic/archive.hpp"
#include "pinocchio_calls.hpp"
#include "simd/arrays.hpp"

using namespace nanobind::literals;
using hovi::arrays::Input;
using hovi::benchmarks::PinocchioCalls;

namespace hovi::benchmarks {

PinocchioCalls::PinocchioCalls(const pinocchio::Model& model_)
    : model(model_), data(model), q(model.nq), v(model.nv), a(model.nv) {}

}  // namespace hovi::benchmarks

namespace {

void read_row(const Input<2>& rows, std::size_t row, Eigen::VectorXd& x) {
  if (row >= rows.shape(0) || rows.shape(1) != static_cast<std::size_t>(x.size()))
    throw std::invalid_argument("points must have the model's sizes");
  std::copy_n(rows.data() + row * x.size(), x.size(), x.data());
}

void evaluate(PinocchioCalls& calls, const Input<2>& q, const Input<2>& v, const Input<2>& a) {
  for (std::size_t point = 0; point < q.shape(0); ++point) {
    read_row(q, point, calls.q), read_row(v, point, calls.v), read_row(a, point, calls.a);
    calls.first_derivatives();
    calls.second_derivatives();
  }
}

// Seconds per point of computeRNEADerivatives and ComputeRNEASecondOrderDerivatives.
double time_pinocchio_calls(const std::string& archive, const Input<2>& q, const Input<2>& v,
                            const Input<2>& a, int repeats) {
  const pinocchio::Model model = hovi::read_archive(archive);
  PinocchioCalls calls(model);
  const auto start = std::chrono::steady_clock::now();
  for (int repeat = 0; repeat < repeats; ++repeat) evaluate(calls, q, v, a);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  return elapsed.count() / (static_cast<double>(repeats) * q.shape(0));
}

}  // namespace

NB_MODULE(hovi_benchmarks, m) {
  m.def("time_pinocchio_calls", &time_pinocchio_calls, "archive"_a, "q"_a, "v"_a, "a"_a,
        "repeats"_a);
}
