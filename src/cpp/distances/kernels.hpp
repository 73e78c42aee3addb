// The functions that are compiled once per instruction set, and the plain data that they read.
#pragma once

#include <cstddef>
#include <cstdint>

namespace hovi::distances {

enum class JointKind : std::int64_t { axis, continuous, floating, spherical, planar };
constexpr std::int64_t joint_kinds = 5;

// Numbers in q and in v of each kind of joint.
constexpr std::size_t coordinates_of[] = {1, 2, 7, 4, 4};
constexpr std::size_t columns_of[] = {1, 1, 6, 3, 3};

// A joint, after its parent (-1: the world). axis: displacement and rotation vector per unit of q,
// in its own frame, for the kinds with one axis.
struct Joint {
  std::int64_t parent;
  JointKind kind;
  std::size_t coordinate, column;
  double rotation[9], translation[3], axis[6];
};

enum class ShapeKind : std::int64_t { points, cylinder, other };
constexpr std::int64_t shape_kinds = 3;

// Everything within `radius` of a core: the convex hull of points, or a cylinder about z. Other
// shapes have bounding spheres only. joint: that moves it, or -1.
// first, count: its points, in groups of `point_group`. linked: whether they have neighbors.
// center, bound: of its bounding sphere.
struct Shape {
  std::int64_t joint;
  ShapeKind kind;
  double rotation[9], translation[3];
  double radius, cylinder_radius, half_length;
  std::size_t first, count;
  bool linked;
  double center[3], bound;
};

// Points of a shape are padded to a multiple of this by copies.
constexpr std::size_t point_group = 4;

// A column of the derivative of a pair's distance. joint: to which it belongs. second: which shape
// it moves.
struct PairColumn {
  std::size_t column, joint;
  bool second;
};

// Two shapes, and the columns that move one of them, each after those of its ancestors.
struct Pair {
  std::size_t first, second, first_column, columns;
};

struct Model {
  std::size_t nq, nv, joints, shapes, pairs, most_columns;
  const Joint* joint;
  const Shape* shape;
  const double *x, *y, *z;
  // Neighbors of each point on its hull, numbered from the first point of its shape; those of point
  // i begin at first_neighbor[i] and end at first_neighbor[i + 1].
  const std::size_t *first_neighbor, *neighbor;
  const Pair* pair;
  const PairColumn* column;
};

// How a distance is known: to rounding; as a lower bound of at least `reach`; or not at all, since
// the cores overlap or are of another kind.
enum class Known : std::int64_t { exactly, far, not_at_all };

// points: configurations, (P, nq). pairs: numbers of k pairs. force: weights of the second
// derivatives, (P, k), or null. wanted: which distances are, (P, k), or null for all; others count
// as far. rounding: eps of rounding.hpp, (P, k), in [m], 0 for shapes as they are, or null if all
// are. normals: unit normals from the first to the second rounded shape, (P, k, 3), updated in
// place: initial guesses, 0 for a cold start, are replaced by the normals found; or null.
struct Request {
  std::size_t points;
  const double* q;
  std::size_t pairs;
  const std::int64_t* pair;
  double reach;
  const double* force;
  const bool* wanted;
  const double* rounding;
  double* normals;
};

// distance, known: (P, k). jacobian: (P, k, nv), or null; zero where the distance is not known
// exactly. curvature: sum of force d'' over the pairs known exactly, (P, nv, nv), or null.
struct Answer {
  double* distance;
  std::int64_t* known;
  double *jacobian, *curvature;
};

struct Kernels {
  // Doubles that `measure` works in.
  std::size_t (*workspace_size)(const Model& model, std::size_t pairs);

  // Signed distances of pairs of shapes, with their derivatives along `integrate`. Points near each
  // other should follow each other: each begins where the one before ended.
  void (*measure)(const Model& model, const Request& request, const Answer& answer,
                  double* workspace);

  static const Kernels baseline, avx2;
};

}  // namespace hovi::distances
