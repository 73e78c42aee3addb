// The penetration depth of two polyhedral cores, by the expanding polytope algorithm
// [VanDenBergen2001].
#pragma once

#include "nearest.hpp"

namespace hovi::distances {
namespace {

constexpr std::size_t most_vertices = 96, most_faces = 2 * most_vertices;
// Gap in [m] between the bounds of a depth at which the iteration ends.
constexpr double depth_gap = 1e-12;
// Difference of distances in [m] up to which triangles may be in one plane.
constexpr double in_plane = 1e-9;

// A triangle of the polytope around the origin, with its outward normal and its distance.
struct Triangle {
  std::size_t corner[3];
  Vector normal;
  double distance;
};

// Points of the difference of two shapes and the triangles of their hull.
struct Polytope {
  std::size_t vertices = 0, faces = 0;
  Vector y[most_vertices], first[most_vertices], second[most_vertices];
  Triangle face[most_faces];

  // Whether there was room, and the triangle has an area and the origin behind it.
  bool add_face(std::size_t i, std::size_t j, std::size_t k) {
    if (faces == most_faces) return false;
    const Vector normal = cross(y[j] - y[i], y[k] - y[i]);
    const double size = length(normal);
    if (!(size > 1e-16)) return false;
    Triangle& added = face[faces++];
    added = {{i, j, k}, (1.0 / size) * normal, dot(normal, y[i]) / size};
    return added.distance > -depth_gap;
  }

  std::size_t nearest_face() const {
    std::size_t best = 0;
    for (std::size_t k = 1; k < faces; ++k)
      if (face[k].distance < face[best].distance) best = k;
    return best;
  }

  // The points that a point of the surface is between. Triangles in one plane are at the same
  // distance, but only one has the point inside.
  void write_nearest(const Vector& point, double depth, Simplex& simplex) const {
    double least = __builtin_inf();
    for (std::size_t k = 0; k < faces; ++k) {
      if (face[k].distance > depth + in_plane) continue;
      Simplex other;
      for (const std::size_t i : face[k].corner) other.add(first[i], second[i], y[i] - point);
      const Face part = nearest_on_triangle(other.y, 0, 1, 2);
      const Vector rest = part.nearest(other.y);
      if (dot(rest, rest) >= least) continue;
      least = dot(rest, rest);
      other.keep(part.count, part.number, part.weight);
      other.last_first = simplex.last_first;
      other.last_second = simplex.last_second;
      simplex = other;
    }
  }

  // Replaces the faces that the last vertex is in front of.
  bool expand() {
    constexpr std::size_t most_edges = 128;
    const std::size_t last = vertices - 1;
    std::size_t edge[most_edges][2], edges = 0, kept = 0;
    for (std::size_t k = 0; k < faces; ++k) {
      const Triangle& each = face[k];
      if (dot(each.normal, y[last]) - each.distance <= 0.1 * depth_gap) {
        face[kept++] = each;
        continue;
      }
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t from = each.corner[i], to = each.corner[(i + 1) % 3];
        std::size_t other = 0;
        while (other < edges && !(edge[other][0] == to && edge[other][1] == from)) ++other;
        if (other < edges) {
          --edges;
          edge[other][0] = edge[edges][0], edge[other][1] = edge[edges][1];
        } else if (edges < most_edges) {
          edge[edges][0] = from, edge[edges][1] = to;
          ++edges;
        } else {
          return false;
        }
      }
    }
    faces = kept;
    for (std::size_t k = 0; k < edges; ++k)
      if (!add_face(edge[k][0], edge[k][1], last)) return false;
    return edges > 0;
  }
};

// Begins with a tetrahedron around the origin; ends with the triangle that has the point w of least
// norm on the difference's surface between its points. normal: outward there, so that
// w = depth normal. False where rounding or a lack of room stops it.
inline bool find_depth(const Model& model, const Placed& placed, Simplex& simplex, Vector& normal,
                       double& depth) {
  Polytope polytope;
  polytope.vertices = 4;
  for (std::size_t i = 0; i < 4; ++i) {
    polytope.y[i] = simplex.y[i];
    polytope.first[i] = simplex.first[i];
    polytope.second[i] = simplex.second[i];
  }
  const Vector* y = polytope.y;
  const bool left = dot(cross(y[1] - y[0], y[2] - y[0]), y[3] - y[0]) > 0.0;
  constexpr std::size_t faces[2][4][3] = {{{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}},
                                          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  for (const auto& f : faces[left])
    if (!polytope.add_face(f[0], f[1], f[2])) return false;
  while (polytope.vertices < most_vertices) {
    const Triangle nearest = polytope.face[polytope.nearest_face()];
    Simplex end;
    end.last_first = simplex.last_first;
    end.last_second = simplex.last_second;
    add_support(model, placed, -nearest.normal, end);
    simplex.last_first = end.last_first;
    simplex.last_second = end.last_second;
    if (dot(end.y[0], nearest.normal) - nearest.distance <= depth_gap) {
      normal = nearest.normal;
      depth = nearest.distance;
      polytope.write_nearest(depth * normal, depth, simplex);
      return depth > least_distance;
    }
    const std::size_t last = polytope.vertices++;
    polytope.y[last] = end.y[0];
    polytope.first[last] = end.first[0];
    polytope.second[last] = end.second[0];
    if (!polytope.expand()) return false;
  }
  return false;
}

}  // namespace
}  // namespace hovi::distances
