#include <algorithm>
#include <chrono>
#include <pinocchio/algorithm/rnea-derivatives.hpp>

#include "archive.hpp"
#include "kernel.hpp"
#include "pinocchio_calls.hpp"

namespace hovi {

PinocchioCalls::PinocchioCalls(const pinocchio::Model& model_)
    : model(model_), data(model), q(model.nq), v(model.nv), a(model.nv) {}

void PinocchioCalls::read_point(const Points& points, std::size_t point) {
  const std::size_t n = model.nv;
  std::copy_n(points.q + point * model.nq, model.nq, q.data());
  std::copy_n(points.v + point * n, n, v.data());
  std::copy_n(points.a + point * n, n, a.data());
}

void PinocchioCalls::first_derivatives() {
  pinocchio::computeRNEADerivatives(model, data, q, v, a);
}

double time_pinocchio_calls(const std::string& archive, Points points, int repeats) {
  const pinocchio::Model model = read_archive(archive);
  PinocchioCalls calls(model);
  const auto start = std::chrono::steady_clock::now();
  for (int repeat = 0; repeat < repeats; ++repeat)
    for (std::size_t point = 0; point < points.count; ++point) {
      calls.read_point(points, point);
      calls.first_derivatives();
      calls.second_derivatives();
    }
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  return elapsed.count() / (static_cast<double>(repeats) * points.count);
}

}  // namespace hovi
