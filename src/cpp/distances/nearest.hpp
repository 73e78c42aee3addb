// The nearest points of two convex cores that do not overlap, by the algorithm of Gilbert, Johnson
// and Keerthi [GilbertJohnsonKeerthi1988].
#pragma once

#include "kernels.hpp"
#include "simd/pack.hpp"
#include "simplex.hpp"
#include "vectors.hpp"

namespace hovi::distances {
namespace {

constexpr int most_iterations = 500;
// Gaps between the upper and the lower bound of a distance, relative to it: at which the iteration
// ends, for polyhedra and for round cores, at which Newton's method takes over, and up to which a
// distance is used if the iteration stagnates.
constexpr double tight_gap = 1e-14, round_gap = 1e-12, coarse_gap = 1e-5, allowed_gap = 1e-9;
// The same, in [m], where the cores nearly touch.
constexpr double allowed_error = 1e-12;
// Distance of cores in [m], below which they count as overlapping: the normal would be rounding.
constexpr double least_distance = 1e-9;

// Hulls with more points than this are searched from point to neighboring point.
constexpr std::size_t most_searched = 32;

inline double along(const Model& model, std::size_t i, const Vector& direction) {
  return model.x[i] * direction.x + model.y[i] * direction.y + model.z[i] * direction.z;
}

inline std::size_t farthest_of_all(const Model& model, const Shape& shape,
                                   const Vector& direction) {
  typedef long long Mask __attribute__((vector_size(8 * HOVI_LANES)));
  const double *x = model.x + shape.first, *y = model.y + shape.first, *z = model.z + shape.first;
  const Pack dx = broadcast(direction.x), dy = broadcast(direction.y), dz = broadcast(direction.z);
  Pack top = broadcast(-__builtin_inf());
  Mask where{}, here{};
  for (std::size_t i = 0; i < lanes; ++i) here[i] = static_cast<long long>(i);
  for (std::size_t i = 0; i < shape.count; i += lanes, here += static_cast<long long>(lanes)) {
    const Pack value = load(x + i) * dx + load(y + i) * dy + load(z + i) * dz;
    const Mask better = value > top;
    top = better ? value : top;
    where = better ? here : where;
  }
  std::size_t best = 0;
  for (std::size_t i = 1; i < lanes; ++i)
    if (top[i] > top[best]) best = i;
  return static_cast<std::size_t>(where[best]);
}

// Every vertex of a convex polyhedron but the farthest has a neighbor that is farther.
inline std::size_t farthest_by_neighbors(const Model& model, const Shape& shape,
                                         const Vector& direction, std::size_t start) {
  std::size_t best = start, before = start;
  double most = along(model, shape.first + best, direction);
  do {
    before = best;
    const std::size_t* const list = model.first_neighbor + shape.first + before;
    for (std::size_t i = list[0]; i < list[1]; ++i) {
      const std::size_t next = model.neighbor[i];
      const double value = along(model, shape.first + next, direction);
      if (value > most) most = value, best = next;
    }
  } while (best != before);
  return best;
}

// The point of a core that is farthest in a direction, both in the core's frame. last: where the
// last search ended.
inline Vector farthest_point(const Model& model, const Shape& shape, const Vector& direction,
                             std::size_t& last) {
  const bool few = shape.count <= most_searched || !shape.linked;
  last = few ? farthest_of_all(model, shape, direction)
             : farthest_by_neighbors(model, shape, direction, last);
  const std::size_t i = shape.first + last;
  return {model.x[i], model.y[i], model.z[i]};
}

inline Vector support(const Model& model, const Shape& shape, const Vector& direction,
                      std::size_t& last) {
  if (shape.kind == ShapeKind::points) return farthest_point(model, shape, direction, last);
  const double across = __builtin_sqrt(direction.x * direction.x + direction.y * direction.y);
  const double share = across > 0.0 ? shape.cylinder_radius / across : 0.0;
  const double z = direction.z < 0.0 ? -shape.half_length : shape.half_length;
  return {share * direction.x, share * direction.y, z};
}

// Two shapes in their places.
struct Placed {
  const Shape *first, *second;
  Pose at_first, at_second;

  Vector difference(const Vector& a, const Vector& b) const {
    return (at_second.translation - at_first.translation) +
           (at_second.rotation * b - at_first.rotation * a);
  }
};

inline void add_support(const Model& model, const Placed& placed, const Vector& w,
                        Simplex& simplex) {
  const Vector a = support(model, *placed.first, turned_back(placed.at_first.rotation, w),
                           simplex.last_first);
  const Vector b = support(model, *placed.second, -turned_back(placed.at_second.rotation, w),
                           simplex.last_second);
  simplex.add(a, b, placed.difference(a, b));
}

inline bool holds_last(const Simplex& simplex) {
  const std::size_t last = simplex.count - 1;
  for (std::size_t i = 0; i < last; ++i)
    if (same(simplex.y[i], simplex.y[last])) return true;
  return false;
}

// Begins with the points that the simplex has, of other placements of the same shapes; ends with
// the fewest points that have the point w of least norm between them. bound: a lower bound of |w|.
// reach: of |w|, beyond which a lower bound is enough. gap: at which the iteration ends. Four points
// are left where the origin is between them: the cores overlap.
inline Known find_nearest(const Model& model, const Placed& placed, double reach, double gap,
                          Simplex& simplex, double& bound) {
  for (std::size_t i = 0; i < simplex.count; ++i)
    simplex.y[i] = placed.difference(simplex.first[i], simplex.second[i]);
  if (simplex.count == 0)
    add_support(model, placed, placed.at_second.translation - placed.at_first.translation, simplex);
  Face face = nearest_face(simplex);
  Vector w = face.nearest(simplex.y);
  double square = dot(w, w);
  bound = 0.0;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    simplex.keep(face.count, face.number, face.weight);
    if (square < least_distance * least_distance) return Known::not_at_all;
    add_support(model, placed, w, simplex);
    const std::size_t last = simplex.count - 1;
    const double below = dot(w, simplex.y[last]), size = __builtin_sqrt(square);
    if (below > bound * size) bound = below / size;
    if (bound > reach) return Known::far;
    const bool found = square - below <= gap * square || holds_last(simplex);
    if (!found) {
      const Face nearer = nearest_face(simplex);
      // A flat tetrahedron may seem to have the origin inside although the cores are apart.
      if (nearer.count == 0 && bound <= 0.0) return Known::not_at_all;
      const Vector next = nearer.nearest(simplex.y);
      const double smaller = dot(next, next);
      if (nearer.count > 0 && smaller < square) {
        face = nearer;
        w = next;
        square = smaller;
        continue;
      }
    }
    simplex.count = last;
    const double allowed = gap > allowed_gap ? gap : allowed_gap;
    const bool near = square - bound * size <= allowed * square || size - bound <= allowed_error;
    return near ? Known::exactly : Known::not_at_all;
  }
  simplex.count = 0;
  return Known::not_at_all;
}

}  // namespace
}  // namespace hovi::distances
