// Distances of many pairs at many configurations: bounding spheres, what is known from the point
// before, and nearest points only where both do not say that a pair is far.
#pragma once

#include "curvature.hpp"
#include "kernels.hpp"
#include "nearest.hpp"
#include "penetration.hpp"
#include "poses.hpp"
#include "rounding.hpp"

namespace hovi::distances {
namespace {

// What is remembered of a pair: the points that its nearest points were between, and its distance
// (or a lower bound) and its shapes' poses where that was computed.
struct Memory {
  std::size_t points, last_first, last_second;
  Vector first[3], second[3];
  bool measured;
  double distance;
  Pose at_first, at_second;
  Vector center_first, center_second;
};

inline std::size_t doubles(std::size_t bytes) { return (bytes + 7) / 8; }

struct Workspace {
  Pose *joint, *shape;
  Twist* twist;
  Vector *center, *velocity;
  Memory* memory;
  double* directions;

  static std::size_t size(const Model& model, std::size_t pairs) {
    return doubles((model.joints + model.shapes) * sizeof(Pose)) +
           doubles(model.nv * sizeof(Twist)) +
           doubles((model.shapes + model.most_columns) * sizeof(Vector)) +
           doubles(pairs * sizeof(Memory)) + 2 * most_directions * model.most_columns;  // or 6
  }

  Workspace(const Model& model, std::size_t pairs, double* work) {
    joint = reinterpret_cast<Pose*>(work);
    shape = joint + model.joints;
    twist = reinterpret_cast<Twist*>(shape + model.shapes);
    center = reinterpret_cast<Vector*>(twist + model.nv);
    velocity = center + model.shapes;
    memory = reinterpret_cast<Memory*>(velocity + model.most_columns);
    directions = reinterpret_cast<double*>(memory + pairs);
    for (std::size_t k = 0; k < pairs; ++k) memory[k] = Memory{};
  }
};

// How far the points of a sphere can have moved at most; |R - S| <= |R - S|_F / sqrt(2).
inline double moved(const Pose& now, const Pose& then, const Vector& center_now,
                    const Vector& center_then, double bound) {
  double square = 0.0;
  for (int i = 0; i < 9; ++i) {
    const double change = now.rotation.m[i] - then.rotation.m[i];
    square += change * change;
  }
  return length(center_now - center_then) + bound * __builtin_sqrt(0.5 * square);
}

inline double lower_bound(const Model& model, const Pair& pair, const Workspace& work,
                          const Memory& memory, double reach) {
  const std::size_t i = pair.first, j = pair.second;
  const Shape &first = model.shape[i], &second = model.shape[j];
  const double apart = length(work.center[j] - work.center[i]) - first.bound - second.bound;
  if (apart > reach || !memory.measured) return apart;
  const double kept =
      memory.distance -
      moved(work.shape[i], memory.at_first, work.center[i], memory.center_first, first.bound) -
      moved(work.shape[j], memory.at_second, work.center[j], memory.center_second, second.bound);
  return kept > apart ? kept : apart;
}

inline void remember(const Pair& pair, const Workspace& work, const Simplex& simplex,
                     double distance, Memory& memory) {
  memory.last_first = simplex.last_first;
  memory.last_second = simplex.last_second;
  memory.points = simplex.count < 3 ? simplex.count : 3;
  for (std::size_t i = 0; i < memory.points; ++i)
    memory.first[i] = simplex.first[i], memory.second[i] = simplex.second[i];
  memory.measured = true;
  memory.distance = distance;
  memory.at_first = work.shape[pair.first];
  memory.at_second = work.shape[pair.second];
  memory.center_first = work.center[pair.first];
  memory.center_second = work.center[pair.second];
}

inline Vector between(const Simplex& simplex, const Vector* points) {
  Vector sum{0.0, 0.0, 0.0};
  for (std::size_t i = 0; i < simplex.count; ++i) sum = sum + simplex.weight[i] * points[i];
  return sum;
}

// The different ones of the points of a simplex on one shape.
inline std::size_t distinct(const Simplex& simplex, const Vector* points, Vector* out) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < simplex.count; ++i) {
    bool known = false;
    for (std::size_t k = 0; k < count; ++k) known = known || same(out[k], points[i]);
    if (!known) out[count++] = points[i];
  }
  return count;
}

// The features at the nearest points of a contact, of which the points are known.
inline void set_features(const Placed& placed, const Simplex& simplex, const Vector& n,
                         double distance, Contact& c) {
  c.distance = distance;
  c.n = n;
  c.first = placed.at_first * c.own_first;
  c.second = placed.at_second * c.own_second;
  Vector points[3];
  const std::size_t before = distinct(simplex, simplex.first, points);
  c.at_first = feature_of(placed.at_first.rotation, *placed.first, before, points, c.own_first, c.n);
  const std::size_t behind = distinct(simplex, simplex.second, points);
  c.at_second =
      feature_of(placed.at_second.rotation, *placed.second, behind, points, c.own_second, c.n);
}

inline Contact contact_of(const Placed& placed, const Simplex& simplex) {
  Contact c{};
  c.own_first = between(simplex, simplex.first);
  c.own_second = between(simplex, simplex.second);
  const Vector w = simplex.nearest();
  const double distance = length(w);
  set_features(placed, simplex, (1.0 / distance) * w, distance, c);
  return c;
}

// The contact of polyhedra that overlap; false if it is not found.
inline bool overlap(const Model& model, const Placed& placed, Simplex& simplex, Contact& c) {
  Vector normal{};
  double depth = 0.0;
  if (simplex.count < 4 || !find_depth(model, placed, simplex, normal, depth)) return false;
  c = Contact{};
  c.own_first = between(simplex, simplex.first);
  c.own_second = between(simplex, simplex.second);
  set_features(placed, simplex, -normal, -depth, c);
  return true;
}

// Newton's method for the nearest points on the features near a contact; whether the points that
// it ends at are those of the least distance, by a lower bound.
inline bool polish(const Model& model, const Placed& placed, const Simplex& simplex, Contact& c) {
  constexpr int steps = 6;
  const Rotation &R = placed.at_first.rotation, &S = placed.at_second.rotation;
  if (placed.first->kind == ShapeKind::cylinder)
    c.own_first = on_surface(*placed.first, c.own_first, turned_back(R, c.n));
  if (placed.second->kind == ShapeKind::cylinder)
    c.own_second = on_surface(*placed.second, c.own_second, -turned_back(S, c.n));
  for (int step = 0; step < steps; ++step) {
    const Vector w = placed.difference(c.own_first, c.own_second);
    if (dot(w, w) < least_distance * least_distance) return false;
    const double distance = length(w);
    set_features(placed, simplex, (1.0 / distance) * w, distance, c);
    Simplex lower;
    lower.last_first = simplex.last_first;
    lower.last_second = simplex.last_second;
    add_support(model, placed, w, lower);
    const double gap = dot(w, w) - dot(w, lower.y[0]);
    if (step > 0 && gap > -round_gap * dot(w, w) && gap < round_gap * dot(w, w)) return true;
    Vector along[most_directions];
    double A[most_directions][most_directions], change[most_directions];
    write_system(c, along, A);
    const std::size_t first = c.at_first.size, k = first + c.at_second.size;
    for (std::size_t i = 0; i < k; ++i) change[i] = -dot(c.n, along[i]);
    solve(k, A, change, 1);
    c.own_first = moved_along(R, *placed.first, c.at_first, change, c.own_first);
    c.own_second = moved_along(S, *placed.second, c.at_second, change + first, c.own_second);
  }
  return false;
}

inline bool is_round(const Placed& placed) {
  return placed.first->kind == ShapeKind::cylinder || placed.second->kind == ShapeKind::cylinder;
}

inline void write_normal(const Vector& n, double* out) {
  out[0] = n.x;
  out[1] = n.y;
  out[2] = n.z;
}

// The distance of a pair, by its bounding spheres if they are far apart; the contact otherwise.
// normal: see Request, or null.
inline Known measure_pair(const Model& model, const Pair& pair, const Workspace& work, double reach,
                          double rounding, double* normal, Memory& memory, Contact& contact,
                          double& distance) {
  distance = lower_bound(model, pair, work, memory, reach);
  if (distance > reach) return Known::far;
  const Shape &first = model.shape[pair.first], &second = model.shape[pair.second];
  if (first.kind == ShapeKind::other || second.kind == ShapeKind::other) return Known::not_at_all;
  const double radii = first.radius + second.radius;
  const Placed placed{&first, &second, work.shape[pair.first], work.shape[pair.second]};
  if (rounding > 0.0 && normal && round_off_from(model, placed, rounding, normal, contact)) {
    write_normal(contact.n, normal);
    distance = contact.distance - radii;
    return distance > reach ? Known::far : Known::exactly;
  }
  if (normal) write_normal({0.0, 0.0, 0.0}, normal);
  Simplex simplex;
  for (std::size_t i = 0; i < memory.points; ++i)
    simplex.add(memory.first[i], memory.second[i], {0.0, 0.0, 0.0});
  simplex.last_first = memory.last_first;
  simplex.last_second = memory.last_second;
  const bool round = is_round(placed);
  const double core_reach = reach + radii;
  double bound = 0.0;
  Known known =
      find_nearest(model, placed, core_reach, round ? coarse_gap : tight_gap, simplex, bound);
  if (known == Known::exactly) contact = contact_of(placed, simplex);
  if (known == Known::exactly && round && !polish(model, placed, simplex, contact)) {
    known = find_nearest(model, placed, core_reach, round_gap, simplex, bound);
    if (known == Known::exactly) contact = contact_of(placed, simplex);
  }
  if (known == Known::not_at_all && !round && overlap(model, placed, simplex, contact))
    known = Known::exactly;
  if (known == Known::not_at_all) {
    memory.points = 0;
    memory.measured = false;
    return known;
  }
  distance = (known == Known::far ? bound : contact.distance) - radii;
  remember(pair, work, simplex, distance, memory);
  if (known == Known::exactly && rounding > 0.0) {
    round_off(model, placed, rounding, contact);
    distance = contact.distance - radii;
    if (normal && contact.rounded) write_normal(contact.n, normal);
  }
  return known;
}

inline void fill(double* x, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) x[i] = 0.0;
}

inline void expand_pair(const Model& model, const Pair& pair, const Workspace& work, Contact& c,
                        double force, double* slope, double* curvature) {
  c.column = model.column + pair.first_column;
  c.columns = pair.columns;
  c.twist = work.twist;
  write_velocities(c, work.velocity);
  for (std::size_t i = 0; i < c.columns; ++i)
    slope[c.column[i].column] = dot(c.n, work.velocity[i]);
  if (curvature && force != 0.0 && c.rounded)
    add_rounded_curvature(c, work.velocity, force, model.nv, work.directions, curvature);
  else if (curvature && force != 0.0)
    add_curvature(c, work.velocity, force, model.nv, work.directions, curvature);
}

std::size_t workspace_size(const Model& model, std::size_t pairs) {
  return Workspace::size(model, pairs);
}

void measure(const Model& model, const Request& request, const Answer& answer, double* memory) {
  const Workspace work(model, request.pairs, memory);
  const std::size_t K = request.pairs, nv = model.nv;
  for (std::size_t p = 0; p < request.points; ++p) {
    place_joints(model, request.q + p * model.nq, work.joint, work.twist);
    place_shapes(model, work.joint, work.shape, work.center);
    double* const curvature = answer.curvature ? answer.curvature + p * nv * nv : nullptr;
    if (curvature) fill(curvature, nv * nv);
    for (std::size_t k = 0; k < K; ++k) {
      const Pair& pair = model.pair[request.pair[k]];
      Contact contact{};
      const std::size_t at = p * K + k;
      Known known = Known::far;
      answer.distance[at] = request.reach;
      if (!request.wanted || request.wanted[at])
        known = measure_pair(model, pair, work, request.reach,
                             request.rounding ? request.rounding[at] : 0.0,
                             request.normals ? request.normals + 3 * at : nullptr, work.memory[k],
                             contact, answer.distance[at]);
      answer.known[at] = static_cast<std::int64_t>(known);
      if (!answer.jacobian) continue;
      double* const slope = answer.jacobian + at * nv;
      fill(slope, nv);
      if (known == Known::exactly)
        expand_pair(model, pair, work, contact, request.force ? request.force[at] : 0.0, slope,
                    curvature);
    }
  }
}

constexpr Kernels kernels{workspace_size, measure};

}  // namespace
}  // namespace hovi::distances
