// The Python binding, which checks its arguments against each other.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pair_distances.hpp"
#include "simd/arrays.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hovi::arrays;
using namespace hovi::distances;

namespace {

using Index2 = Array<const std::int64_t, 2>;
using IndexOut2 = Array<std::int64_t, 2>;
using Mask2 = Array<const bool, 2>;

std::size_t natural(const char* name, std::int64_t value, std::int64_t end) {
  if (value < 0 || value >= end)
    refuse(std::string(name) + " must be from 0 to " + std::to_string(end - 1) + ", got " +
           std::to_string(value) + ".");
  return static_cast<std::size_t>(value);
}

constexpr std::int64_t most = std::int64_t{1} << 30;
constexpr double most_rounding = 1.0;

struct JointArrays {
  const Index &parents, &kinds, &coordinates, &columns;
  const Input<3>& rotations;
  const Input<2>&translations, &axes;
};

std::vector<Joint> joints_of(const JointArrays& a) {
  a.parents.require_kind("parents");
  const std::size_t n = a.parents.shape(0);
  a.kinds.require("kinds", {n});
  a.coordinates.require("coordinates", {n});
  a.columns.require("columns", {n});
  a.rotations.require("rotations", {n, 3, 3});
  a.translations.require("translations", {n, 3});
  a.axes.require("axes", {n, 6});
  std::vector<Joint> joints(n);
  for (std::size_t k = 0; k < n; ++k) {
    Joint& joint = joints[k];
    joint.parent = a.parents.data()[k];
    joint.kind = static_cast<JointKind>(natural("kinds", a.kinds.data()[k], joint_kinds));
    joint.coordinate = natural("coordinates", a.coordinates.data()[k], most);
    joint.column = natural("columns", a.columns.data()[k], most);
    std::copy_n(a.rotations.data() + 9 * k, 9, joint.rotation);
    std::copy_n(a.translations.data() + 3 * k, 3, joint.translation);
    std::copy_n(a.axes.data() + 6 * k, 6, joint.axis);
  }
  return joints;
}

struct ShapeArrays {
  const Index &joints, &kinds;
  const Input<3>& rotations;
  const Input<2>&translations, &sizes, &spheres, &points;
  const Index &counts, &neighbor_counts, &neighbors;
};

// A count that is taken off what is left of a list.
std::size_t taken(const char* name, std::int64_t value, std::size_t& left) {
  const std::size_t count = natural(name, value, most);
  if (count > left) refuse(std::string(name) + " must add up to the length of their list.");
  left -= count;
  return count;
}

std::vector<Hull> hulls_of(const ShapeArrays& a) {
  a.points.require_kind("points");
  const std::size_t rows = a.points.shape(0);
  a.points.require("points", {rows, 3});
  a.neighbor_counts.require("neighbor_counts", {rows});
  a.neighbors.require_kind("neighbors");
  const double* point = a.points.data();
  const std::int64_t *next = a.neighbors.data(), *near = a.neighbor_counts.data();
  std::size_t points_left = rows, neighbors_left = a.neighbors.shape(0);
  std::vector<Hull> hulls(a.counts.shape(0));
  for (std::size_t k = 0; k < hulls.size(); ++k) {
    const std::size_t count = taken("point_counts", a.counts.data()[k], points_left);
    hulls[k].points.assign(point, point + 3 * count);
    point += 3 * count;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t size = taken("neighbor_counts", *near++, neighbors_left);
      std::vector<std::size_t> list;
      for (std::size_t l = 0; l < size; ++l) list.push_back(natural("neighbors", *next++, most));
      hulls[k].neighbors.push_back(std::move(list));
    }
  }
  if (points_left) refuse("point_counts must add up to the length of their list.");
  if (neighbors_left) refuse("neighbor_counts must add up to the length of their list.");
  return hulls;
}

std::vector<Shape> shapes_of(const ShapeArrays& a) {
  a.joints.require_kind("shape_joints");
  const std::size_t n = a.joints.shape(0);
  a.kinds.require("shape_kinds", {n});
  a.rotations.require("shape_rotations", {n, 3, 3});
  a.translations.require("shape_translations", {n, 3});
  a.sizes.require("shape_sizes", {n, 3});
  a.spheres.require("shape_spheres", {n, 4});
  a.counts.require("point_counts", {n});
  std::vector<Shape> shapes(n);
  for (std::size_t k = 0; k < n; ++k) {
    Shape& shape = shapes[k];
    shape.joint = a.joints.data()[k];
    shape.kind = static_cast<ShapeKind>(natural("shape_kinds", a.kinds.data()[k], shape_kinds));
    std::copy_n(a.rotations.data() + 9 * k, 9, shape.rotation);
    std::copy_n(a.translations.data() + 3 * k, 3, shape.translation);
    shape.radius = a.sizes.data()[3 * k];
    shape.cylinder_radius = a.sizes.data()[3 * k + 1];
    shape.half_length = a.sizes.data()[3 * k + 2];
    std::copy_n(a.spheres.data() + 4 * k, 3, shape.center);
    shape.bound = a.spheres.data()[4 * k + 3];
  }
  return shapes;
}

std::vector<Pair> pairs_of(const Index2& pairs) {
  pairs.require_kind("pairs");
  const std::size_t n = pairs.shape(0);
  pairs.require("pairs", {n, 2});
  std::vector<Pair> list(n);
  for (std::size_t k = 0; k < n; ++k) {
    list[k].first = natural("pairs", pairs.data()[2 * k], most);
    list[k].second = natural("pairs", pairs.data()[2 * k + 1], most);
  }
  return list;
}

void construct(PairDistances* self, std::int64_t nq, std::int64_t nv, const Index& parents,
               const Index& kinds, const Index& coordinates, const Index& columns,
               const Input<3>& rotations, const Input<2>& translations, const Input<2>& axes,
               const Index& shape_joints, const Index& shape_kinds,
               const Input<3>& shape_rotations, const Input<2>& shape_translations,
               const Input<2>& shape_sizes, const Input<2>& shape_spheres, const Input<2>& points,
               const Index& point_counts, const Index& neighbor_counts, const Index& neighbors,
               const Index2& pairs, bool portable) {
  const std::size_t q = natural("nq", nq, most), v = natural("nv", nv, most);
  auto joints = joints_of({parents, kinds, coordinates, columns, rotations, translations, axes});
  const ShapeArrays arrays{shape_joints, shape_kinds,  shape_rotations, shape_translations,
                           shape_sizes,  shape_spheres, points,          point_counts,
                           neighbor_counts, neighbors};
  auto shapes = shapes_of(arrays);
  new (self) PairDistances(q, v, std::move(joints), std::move(shapes), hulls_of(arrays),
                           pairs_of(pairs), portable);
}

Request request_of(const PairDistances& self, const Input<2>& q, const Index& chosen,
                   double reach) {
  q.require_kind("q");
  const std::size_t points = q.shape(0);
  q.require("q", {points, self.nq()});
  chosen.require_kind("chosen");
  const std::size_t pairs = chosen.shape(0);
  for (std::size_t k = 0; k < pairs; ++k)
    natural("chosen", chosen.data()[k], static_cast<std::int64_t>(self.size()));
  return {points, q.data(), pairs, chosen.data(), reach, nullptr, nullptr, nullptr, nullptr};
}

const double* rounding_of(const std::optional<Input<2>>& rounding, std::size_t points,
                          std::size_t pairs) {
  const double* const sizes = data_or_null("rounding", rounding, {points, pairs});
  for (std::size_t i = 0; sizes && i < points * pairs; ++i)
    if (!(0.0 <= sizes[i] && sizes[i] <= most_rounding)) refuse("rounding must be from 0 to 1 m.");
  return sizes;
}

void values(const PairDistances& self, const Input<2>& q, const Index& chosen, double reach,
            const Output<2>& distances, const IndexOut2& known,
            const std::optional<Mask2>& wanted,
            const std::optional<Input<2>>& rounding,
            const std::optional<Output<3>>& normals) {
  Request request = request_of(self, q, chosen, reach);
  request.wanted = data_or_null("wanted", wanted, {request.points, request.pairs});
  request.rounding = rounding_of(rounding, request.points, request.pairs);
  request.normals = data_or_null("normals", normals, {request.points, request.pairs, 3});
  distances.require("distances", {request.points, request.pairs});
  known.require("known", {request.points, request.pairs});
  const nb::gil_scoped_release released;
  self.measure(request, {distances.data(), known.data(), nullptr, nullptr});
}

void expand(const PairDistances& self, const Input<2>& q, const Index& chosen, double reach,
            const std::optional<Input<2>>& force, const Output<2>& distances,
            const IndexOut2& known, const Output<3>& jacobian, const Output<3>& curvature,
            const std::optional<Mask2>& wanted,
            const std::optional<Input<2>>& rounding,
            const std::optional<Output<3>>& normals) {
  Request request = request_of(self, q, chosen, reach);
  const std::size_t P = request.points, K = request.pairs, nv = self.nv();
  request.rounding = rounding_of(rounding, P, K);
  request.normals = data_or_null("normals", normals, {P, K, 3});
  request.force = data_or_null("force", force, {P, K});
  request.wanted = data_or_null("wanted", wanted, {P, K});
  distances.require("distances", {P, K});
  known.require("known", {P, K});
  jacobian.require("jacobian", {P, K, nv});
  curvature.require("curvature", {P, nv, nv});
  const nb::gil_scoped_release released;
  self.measure(request, {distances.data(), known.data(), jacobian.data(), curvature.data()});
}

}  // namespace

NB_MODULE(distances, m) {
  nb::class_<PairDistances>(m, "PairDistances")
      .def("__init__", &construct, "nq"_a, "nv"_a, "parents"_a, "kinds"_a, "coordinates"_a,
           "columns"_a, "rotations"_a, "translations"_a, "axes"_a, "shape_joints"_a,
           "shape_kinds"_a, "shape_rotations"_a, "shape_translations"_a, "shape_sizes"_a,
           "shape_spheres"_a, "points"_a, "point_counts"_a,
           "neighbor_counts"_a, "neighbors"_a, "pairs"_a, "portable"_a = false)
      .def_prop_ro("nq", &PairDistances::nq)
      .def_prop_ro("nv", &PairDistances::nv)
      .def_prop_ro("size", &PairDistances::size)
      .def("values", &values, "q"_a, "chosen"_a, "reach"_a, "distances"_a, "known"_a,
           "wanted"_a = nb::none(), "rounding"_a = nb::none(), "normals"_a = nb::none())
      .def("expand", &expand, "q"_a, "chosen"_a, "reach"_a, "force"_a.none(), "distances"_a,
           "known"_a, "jacobian"_a, "curvature"_a, "wanted"_a = nb::none(),
           "rounding"_a = nb::none(), "normals"_a = nb::none());
}
