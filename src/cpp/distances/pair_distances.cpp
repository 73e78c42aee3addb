#include "pair_distances.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "simd/arrays.hpp"
#include "simd/dispatch.hpp"

namespace hovi::distances {
namespace {

void require(bool condition, const std::string& sentence) {
  if (!condition) throw std::invalid_argument(sentence + ".");
}

std::size_t index_of(JointKind kind) { return static_cast<std::size_t>(kind); }

bool within(std::size_t first, std::size_t count, std::size_t size) {
  return first <= size && count <= size - first;
}

}  // namespace

PairDistances::PairDistances(std::size_t nq, std::size_t nv, std::vector<Joint> joints,
                             std::vector<Shape> shapes,
                             const std::vector<Hull>& hulls, std::vector<Pair> pairs,
                             bool portable)
    : nq_(nq),
      nv_(nv),
      joints_(std::move(joints)),
      shapes_(std::move(shapes)),
      pairs_(std::move(pairs)),
      kernels_(choose_kernels<Kernels>(portable)) {
  check();
  pack(hulls);
  for (Pair& pair : pairs_) relate(pair);
}

void PairDistances::check() const {
  std::size_t coordinates = 0, columns = 0;
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const Joint& joint = joints_[k];
    const std::string name = "joint " + std::to_string(k);
    require(-1 <= joint.parent && joint.parent < static_cast<std::int64_t>(k),
            name + " must come after its parent");
    const std::size_t kind = index_of(joint.kind);
    require(within(joint.coordinate, coordinates_of[kind], nq_) &&
                within(joint.column, columns_of[kind], nv_),
            name + " must have its numbers within a configuration and a velocity");
    coordinates += coordinates_of[kind];
    columns += columns_of[kind];
  }
  require(coordinates == nq_ && columns == nv_, "nq and nv must be those of the joints");
  for (const Shape& shape : shapes_)
    require(-1 <= shape.joint && shape.joint < static_cast<std::int64_t>(joints_.size()),
            "shapes must be moved by a joint or be fixed");
  for (const Pair& pair : pairs_)
    require(pair.first < shapes_.size() && pair.second < shapes_.size(),
            "pairs must be of two of the shapes");
}

void PairDistances::pack(const std::vector<Hull>& hulls) {
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    Shape& shape = shapes_[k];
    const Hull& hull = hulls[k];
    const std::size_t count = hull.points.size() / 3;
    require(count > 0 || shape.kind != ShapeKind::points, "a hull must have points");
    shape.first = x_.size();
    shape.count = (count + point_group - 1) / point_group * point_group;
    shape.linked = count > 0;
    for (std::size_t i = 0; i < shape.count; ++i) {
      const double* const point = hull.points.data() + 3 * std::min(i, count - 1);
      x_.push_back(point[0]);
      y_.push_back(point[1]);
      z_.push_back(point[2]);
      first_neighbor_.push_back(neighbors_.size());
      if (i >= count) continue;
      const auto& near = hull.neighbors[i];
      shape.linked = shape.linked && !near.empty();
      for (const std::size_t next : near) require(next < count, "neighbors must be points of a hull");
      neighbors_.insert(neighbors_.end(), near.begin(), near.end());
    }
  }
  first_neighbor_.push_back(neighbors_.size());
}

// Joints that move both shapes do not change their distance.
void PairDistances::relate(Pair& pair) {
  pair.first_column = columns_.size();
  std::vector<bool> moves[2];
  for (const bool second : {false, true}) {
    std::vector<bool>& moved = moves[second];
    moved.assign(joints_.size(), false);
    std::int64_t joint = shapes_[second ? pair.second : pair.first].joint;
    for (; joint >= 0; joint = joints_[static_cast<std::size_t>(joint)].parent)
      moved[static_cast<std::size_t>(joint)] = true;
  }
  for (std::size_t k = 0; k < joints_.size(); ++k)
    if (moves[0][k] != moves[1][k])
      for (std::size_t i = 0; i < columns_of[index_of(joints_[k].kind)]; ++i)
        columns_.push_back({joints_[k].column + i, k, bool(moves[1][k])});
  pair.columns = columns_.size() - pair.first_column;
  most_columns_ = std::max(most_columns_, pair.columns);
}

Model PairDistances::model() const {
  Model model{};
  model.nq = nq_;
  model.nv = nv_;
  model.joints = joints_.size();
  model.shapes = shapes_.size();
  model.pairs = pairs_.size();
  model.most_columns = most_columns_;
  model.joint = joints_.data();
  model.shape = shapes_.data();
  model.x = x_.data();
  model.y = y_.data();
  model.z = z_.data();
  model.first_neighbor = first_neighbor_.data();
  model.neighbor = neighbors_.data();
  model.pair = pairs_.data();
  model.column = columns_.data();
  return model;
}

void PairDistances::measure(const Request& request, const Answer& answer) const {
  const Model model = this->model();
  const auto work = arrays::allocate(kernels_.workspace_size(model, request.pairs));
  kernels_.measure(model, request, answer, work.get());
}

}  // namespace hovi::distances
