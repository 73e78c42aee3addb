#include "kernel.hpp"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include "archive.hpp"
#include "worker.hpp"

namespace hovi {

namespace {

using Eigen::Index;
using Tensor = pinocchio::Data::Tensor3x;

Index padded(Index size) { return (size + tile - 1) / tile * tile; }

// c[j + n k] = sum_i curvature_i T(i, j, k)
void contract(const Tensor& T, const Eigen::VectorXd& curvature, Eigen::VectorXd& c) {
  const Index n = curvature.size();
  c.noalias() = Eigen::Map<const Eigen::MatrixXd>(T.data(), n, n * n).transpose() * curvature;
}

// More threads than points or cores would only cost memory.
std::size_t useful_threads(std::size_t asked, std::size_t points) {
  const std::size_t cores = std::max(1u, std::thread::hardware_concurrency());
  return std::max<std::size_t>(1, std::min({asked, points, cores}));
}

void gather_jacobian(Worker& w) {
  const Index n = w.q.size();
  w.J.middleCols(0, n) = w.data.dtau_dq;
  w.J.middleCols(n, n) = w.data.dtau_dv;
  for (Index i = 0; i < n; ++i)
    for (Index j = i; j < n; ++j) w.J(i, 2 * n + j) = w.J(j, 2 * n + i) = w.data.M(i, j);
}

// The upper triangle of H = J^T W J, in tiles that stay in registers.
void accumulate_gauss_newton(Worker& w) {
  using Tile = Eigen::Matrix<double, tile, tile, Eigen::RowMajor>;
  using TileRow = Eigen::Matrix<double, 1, tile>;
  const Index n = w.q.size(), width = w.J.cols();
  for (Index r = 0; r < width; r += tile)
    for (Index c = r; c < width; c += tile) {
      Tile sum = Tile::Zero();
      for (Index i = 0; i < n; ++i) {
        const auto left = Eigen::Map<const TileRow>(&w.weighted_J(i, r));
        const auto right = Eigen::Map<const TileRow>(&w.J(i, c));
        sum.noalias() += left.transpose() * right;
      }
      w.H.block<tile, tile>(r, c) = sum;
    }
}

// tau is affine in a and quadratic in v: the blocks va and aa of its second derivatives vanish.
void add_curvature(Worker& w) {
  const Index n = w.q.size();
  contract(w.data.d2tau_dqdq, w.curvature, w.curved_qq);
  contract(w.data.d2tau_dvdv, w.curvature, w.curved_vv);
  contract(w.data.d2tau_dqdv, w.curvature, w.curved_qv);
  contract(w.data.d2tau_dadq, w.curvature, w.curved_aq);
  for (Index j = 0; j < n; ++j)
    for (Index k = 0; k < n; ++k) {
      w.H(j, k) += w.curved_qq[j + n * k];
      w.H(n + j, n + k) += w.curved_vv[j + n * k];
      w.H(j, n + k) += w.curved_qv[j + n * k];
      w.H(j, 2 * n + k) += w.curved_aq[k + n * j];
    }
}

// From the upper triangle only, so that the result is symmetric to the last bit.
void write_symmetric(const RowMatrix& H, Index size, double* out) {
  for (Index r = 0; r < size; ++r)
    for (Index c = r; c < size; ++c) out[r * size + c] = out[c * size + r] = H(r, c);
}

void write_first_order(const Worker& w, std::size_t point, Expansion out) {
  const Index n = w.q.size();
  std::copy_n(w.data.tau.data(), n, out.tau + point * n);
  if (!out.jacobian) return;
  for (Index i = 0; i < n; ++i)
    std::copy_n(&w.J(i, 0), 3 * n, out.jacobian + (point * n + i) * 3 * n);
}

}  // namespace

Worker::Worker(const pinocchio::Model& model_)
    : model(model_),
      data(model),
      q(model.nv),
      v(model.nv),
      a(model.nv),
      curvature(model.nv),
      J(RowMatrix::Zero(model.nv, padded(3 * model.nv))),
      weighted_J(J),
      H(J.cols(), J.cols()) {
  for (auto* curved : {&curved_qq, &curved_vv, &curved_qv, &curved_aq})
    curved->resize(static_cast<Index>(model.nv) * model.nv);
}

void Worker::read_point(const double* q_, const double* v_, const double* a_) {
  std::copy_n(q_, q.size(), q.data());
  std::copy_n(v_, v.size(), v.data());
  std::copy_n(a_, a.size(), a.data());
}

struct InverseDynamicsKernel::Parts {
  pinocchio::Model model;
  std::vector<std::unique_ptr<Worker>> workers;
  std::mutex busy;

  // Runs work(worker, point) for every point, on contiguous chunks of them.
  template <typename Work>
  void for_each_point(const Points& points, int threads, const Work& work) {
    const std::lock_guard<std::mutex> lock(busy);
    const std::size_t n = model.nv;
    const std::size_t chunks = useful_threads(threads, points.count);
    while (workers.size() < chunks) workers.push_back(std::make_unique<Worker>(model));
    const auto run = [&](std::size_t chunk) {
      Worker& worker = *workers[chunk];
      const std::size_t end = points.count * (chunk + 1) / chunks;
      for (std::size_t i = points.count * chunk / chunks; i < end; ++i) {
        worker.read_point(points.q + i * n, points.v + i * n, points.a + i * n);
        work(worker, i);
      }
    };
    std::vector<std::thread> others;
    for (std::size_t chunk = 1; chunk < chunks; ++chunk) others.emplace_back(run, chunk);
    run(0);
    for (auto& other : others) other.join();
  }
};

InverseDynamicsKernel::InverseDynamicsKernel(const std::string& archive)
    : parts_(new Parts{read_archive(archive), {}, {}}) {}

InverseDynamicsKernel::~InverseDynamicsKernel() = default;

std::size_t InverseDynamicsKernel::dof() const { return parts_->model.nv; }

void InverseDynamicsKernel::torque(Points points, Expansion out, int threads) {
  parts_->for_each_point(points, threads, [&](Worker& w, std::size_t point) {
    w.torque();
    write_first_order(w, point, out);
  });
}

void InverseDynamicsKernel::linearize(Points points, Expansion out, int threads) {
  parts_->for_each_point(points, threads, [&](Worker& w, std::size_t point) {
    w.first_derivatives();
    gather_jacobian(w);
    write_first_order(w, point, out);
  });
}

void InverseDynamicsKernel::expand(Points points, const double* weight, const double* curvature,
                                   Expansion out, int threads) {
  const std::size_t n = dof();
  parts_->for_each_point(points, threads, [&](Worker& w, std::size_t point) {
    w.first_derivatives();
    gather_jacobian(w);
    write_first_order(w, point, out);
    const Eigen::Map<const Eigen::VectorXd> R(weight + point * n, n);
    w.weighted_J.noalias() = R.asDiagonal() * w.J;
    accumulate_gauss_newton(w);
    if (curvature) {
      std::copy_n(curvature + point * n, n, w.curvature.data());
      w.second_derivatives();
      add_curvature(w);
    }
    write_symmetric(w.H, 3 * n, out.hessian + point * 9 * n * n);
  });
}

double InverseDynamicsKernel::time_pinocchio_calls(Points points, int repeats) {
  const auto start = std::chrono::steady_clock::now();
  for (int repeat = 0; repeat < repeats; ++repeat)
    parts_->for_each_point(points, 1, [](Worker& w, std::size_t) {
      w.first_derivatives();
      for (auto* tensor : {&w.data.d2tau_dqdq, &w.data.d2tau_dvdv, &w.data.d2tau_dqdv,
                           &w.data.d2tau_dadq})
        tensor->setZero();  // as Pinocchio's own overload does
      w.second_derivatives();
    });
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  return elapsed.count() / (static_cast<double>(repeats) * points.count);
}

}  // namespace hovi
