// Distances of shapes that are made slightly larger, and smooth: their support functions
//
//   h(n) = eps log sum exp(n . v / eps) over the vertices v, and, of a cylinder about z,
//   h(n) = r sqrt(n_x^2 + n_y^2 + (eps / r)^2) + eps log(2 cosh(l n_z / eps)),
//
// exceed those of the shapes by at most eps times the logarithm of the number of vertices. The
// distance of two polyhedra has kinks where faces or edges are parallel, since its nearest points
// jump; the largest separation phi(n) = -h_1(n) - h_2(-n) over unit vectors n is smooth there. With
// p_1, p_2 the gradients of h, which are points of the shapes, D = n . (p_2 - p_1), C the Hessians
// of h in the tangent plane of n, w = p_2 - p_1 with p fixed to the shapes, and u = n x omega for
// the shape that a column moves,
//
//   d'  = n . w_q,
//   d'' = n . w_qq - u^T C u + G^T (C_1 + C_2 + D)^-1 G,   G = w_q - C u in the tangent plane.
#pragma once

#include "curvature.hpp"
#include "nearest.hpp"

namespace hovi::distances {
namespace {

// Differences of heights, over eps, from which vertices have no weight.
constexpr double most_below = 25.0;
constexpr int rounding_steps = 40, rounding_halvings = 20;
// Step of n at which Newton's method ends: what remains is of the order of its square over eps.
constexpr double rounding_step = 1e-7;
// Vertices that may gain weight while n turns by less than this are looked at: by less of a turn
// where these are too many, and by more of one where n turns further.
constexpr double first_turn = 0.02, most_turn = 0.3;
constexpr int turn_changes = 12;
constexpr std::size_t most_candidates = 512;
// Shapes of many vertices are rounded less, since more vertices are near to each other: by at most
// the first of these over their number, but by the second at least, in [m].
constexpr double rounding_of_all = 0.064, least_rounding = 2e-5;
// Radius of a shape above which rounding errors of its heights hide the largest separation, in [m].
constexpr double largest_warm = 10.0;

// The value of a support function, its gradient in the shape's frame, and its Hessian in the plane
// of two directions.
struct Support {
  double value;
  Vector point;
  Plane bend;
};

// The vertices of a shape that may have weight near a direction.
struct Candidates {
  std::size_t count;
  Vector point[most_candidates];
};

// Whether a vertex may have weight while n turns by less than `turn`: `below` the highest one in the
// direction n by more than what counts, and away from it by the root of `square`; or several.
template <typename Number>
inline auto may_count(const Number& below, const Number& square, double turn) {
  return (below <= 0.0) | (below * below <= turn * turn * square);
}

// Hulls with more points than this, up to as many as there are bits, are searched from the highest
// point to neighboring ones: those that may count are connected.
constexpr std::size_t most_scanned = 128, mark_words = 1024;

inline bool find_connected(const Model& model, const Shape& shape, const Vector& n, double eps,
                           double turn, Candidates& out) {
  std::uint64_t marks[mark_words];
  for (std::size_t i = 0; i <= shape.count / 64; ++i) marks[i] = 0;
  std::size_t list[most_candidates];
  const auto mark = [&](std::size_t i) {
    const std::uint64_t bit = std::uint64_t{1} << (i % 64);
    const bool known = marks[i / 64] & bit;
    marks[i / 64] |= bit;
    return !known;
  };
  list[0] = farthest_by_neighbors(model, shape, n, 0);
  mark(list[0]);
  const std::size_t first = shape.first;
  const double top = along(model, first + list[0], n);
  const auto vertex = [&](std::size_t i) {
    return Vector{model.x[first + i], model.y[first + i], model.z[first + i]};
  };
  out.point[0] = vertex(list[0]);
  out.count = 1;
  for (std::size_t k = 0; k < out.count; ++k) {
    const std::size_t* const near = model.first_neighbor + first + list[k];
    for (std::size_t l = near[0]; l < near[1]; ++l) {
      const std::size_t i = model.neighbor[l];
      if (!mark(i)) continue;
      const Vector v = vertex(i);
      const Vector w = v - out.point[0];
      if (!may_count(top - dot(v, n) - most_below * eps, dot(w, w), turn)) continue;
      if (out.count == most_candidates) return false;
      list[out.count] = i;
      out.point[out.count++] = v;
    }
  }
  return true;
}

// False where there are too many. n: in the shape's frame.
inline bool find_candidates(const Model& model, const Shape& shape, const Vector& n, double eps,
                            double turn, Candidates& out) {
  out.count = 0;
  if (shape.kind == ShapeKind::cylinder) return true;
  if (shape.linked && shape.count > most_scanned && shape.count < 64 * mark_words)
    return find_connected(model, shape, n, eps, turn, out);
  const double *x = model.x + shape.first, *y = model.y + shape.first, *z = model.z + shape.first;
  const std::size_t first = farthest_of_all(model, shape, n);
  const Vector highest{x[first], y[first], z[first]};
  const Pack nx = broadcast(n.x), ny = broadcast(n.y), nz = broadcast(n.z);
  const Pack least = broadcast(dot(highest, n) - most_below * eps);
  for (std::size_t i = 0; i < shape.count; i += lanes) {
    const Pack px = load(x + i), py = load(y + i), pz = load(z + i);
    const Pack below = least - (px * nx + py * ny + pz * nz);
    const Pack wx = px - highest.x, wy = py - highest.y, wz = pz - highest.z;
    const Pack square = wx * wx + wy * wy + wz * wz;
    const auto counts = may_count(below, square, turn);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      if (!counts[lane]) continue;
      const Vector v{px[lane], py[lane], pz[lane]};
      if (out.count > 0 && same(v, out.point[out.count - 1])) continue;  // a copy
      if (out.count == most_candidates) return false;
      out.point[out.count++] = v;
    }
  }
  return true;
}

inline Support support_of_points(const Candidates& near, const Vector& n, const Vector& s,
                                 const Vector& t, double eps) {
  double height[most_candidates], top = -__builtin_inf();
  for (std::size_t i = 0; i < near.count; ++i) {
    height[i] = dot(near.point[i], n);
    if (height[i] > top) top = height[i];
  }
  Support h{};
  double sum = 0.0;
  for (std::size_t i = 0; i < near.count; ++i) {
    const double below = (top - height[i]) / eps;
    height[i] = 0.0;
    if (below > most_below) continue;
    height[i] = __builtin_exp(-below);
    sum += height[i];
    h.point = h.point + height[i] * near.point[i];
  }
  h.point = (1.0 / sum) * h.point;
  for (std::size_t i = 0; i < near.count; ++i) {
    if (height[i] == 0.0) continue;
    const Vector w = near.point[i] - h.point;
    h.bend.add(height[i] / (sum * eps), dot(w, s), dot(w, t));
  }
  h.value = top + eps * __builtin_log(sum);
  return h;
}

inline Support support_of_cylinder(const Shape& shape, const Vector& n, const Vector& s,
                                   const Vector& t, double eps) {
  const double r = shape.cylinder_radius, l = shape.half_length, least = eps / r;
  const double slope = __builtin_sqrt(n.x * n.x + n.y * n.y + least * least);
  const double up = n.z < 0.0 ? -n.z : n.z, fall = __builtin_exp(-2.0 * l * up / eps);
  const double share = (1.0 - fall) / (1.0 + fall);
  Support h{};
  h.value = r * slope + l * up + eps * __builtin_log(1.0 + fall);
  h.point = {r * n.x / slope, r * n.y / slope, (n.z < 0.0 ? -l : l) * share};
  const double across = r / slope, radial = -r / (slope * slope * slope);
  h.bend.add(across, s.x, t.x);
  h.bend.add(across, s.y, t.y);
  h.bend.add(radial, n.x * s.x + n.y * s.y, n.x * t.x + n.y * t.y);
  h.bend.add(l * l / eps * (1.0 - share * share), s.z, t.z);
  return h;
}

inline Support support_of(const Candidates& near, const Shape& shape, const Rotation& R,
                          const Vector& n, const Vector& s, const Vector& t, double eps) {
  const Vector own = turned_back(R, n), first = turned_back(R, s), other = turned_back(R, t);
  if (shape.kind == ShapeKind::cylinder) return support_of_cylinder(shape, own, first, other, eps);
  return support_of_points(near, own, first, other, eps);
}

// phi at a unit vector, where it is measured along tangents.
struct Separation {
  Vector n, tangent[2], own_first, own_second, first, second;
  Plane at_first, at_second;
  double value, apart;
};

inline Separation separation(const Candidates* near, const Placed& placed, const Vector& n,
                             double eps) {
  Separation s{};
  s.n = n;
  const double x = n.x * n.x, y = n.y * n.y, z = n.z * n.z;
  const Vector some = x <= y && x <= z   ? Vector{1.0, 0.0, 0.0}
                      : y <= z           ? Vector{0.0, 1.0, 0.0}
                                         : Vector{0.0, 0.0, 1.0};
  const Vector side = cross(n, some);
  s.tangent[0] = (1.0 / length(side)) * side;
  s.tangent[1] = cross(n, s.tangent[0]);
  const Support a = support_of(near[0], *placed.first, placed.at_first.rotation, n, s.tangent[0],
                               s.tangent[1], eps);
  const Support b = support_of(near[1], *placed.second, placed.at_second.rotation, -n,
                               s.tangent[0], s.tangent[1], eps);
  s.own_first = a.point;
  s.own_second = b.point;
  s.first = placed.at_first * a.point;
  s.second = placed.at_second * b.point;
  s.at_first = a.bend;
  s.at_second = b.bend;
  s.value = dot(n, placed.at_second.translation - placed.at_first.translation) - a.value - b.value;
  s.apart = dot(n, placed.difference(a.point, b.point));
  return s;
}

// C_1 + C_2 + D; false where that is not positive definite, so that n is no maximum.
inline bool stiffness(const Separation& s, Plane& M) {
  M.xx = s.at_first.xx + s.at_second.xx + s.apart;
  M.xy = s.at_first.xy + s.at_second.xy;
  M.yy = s.at_first.yy + s.at_second.yy + s.apart;
  return M.xx > 0.0 && M.xx * M.yy - M.xy * M.xy > 0.0;
}

inline void solve_plane(const Plane& M, double x, double y, double* out) {
  const double inverse = 1.0 / (M.xx * M.yy - M.xy * M.xy);
  out[0] = inverse * (M.yy * x - M.xy * y);
  out[1] = inverse * (M.xx * y - M.xy * x);
}

enum class Rounded { found, unfinished, too_many_vertices, turns_further, failed };

// Newton's method for the largest separation near that of a contact, from a direction, which
// becomes the one that it ends at. The contact becomes that of the rounded shapes if it is found
// while n turns by less than `most`, or as far as rounding errors allow if that is unfinished.
inline Rounded round_within(const Model& model, const Placed& placed, double eps, double most,
                            Vector& n, Contact& c) {
  Candidates near[2];
  if (!find_candidates(model, *placed.first, turned_back(placed.at_first.rotation, n), eps, most,
                       near[0]) ||
      !find_candidates(model, *placed.second, -turned_back(placed.at_second.rotation, n), eps, most,
                       near[1]))
    return Rounded::too_many_vertices;
  Separation s = separation(near, placed, n, eps);
  const Vector before = n;
  Plane M;
  bool found = false;
  for (int step = 0; step < rounding_steps && !found; ++step) {
    if (!stiffness(s, M)) return Rounded::failed;
    const Vector w = placed.difference(s.own_first, s.own_second);
    double move[2];
    solve_plane(M, dot(w, s.tangent[0]), dot(w, s.tangent[1]), move);
    double share = 1.0;
    const double size = __builtin_sqrt(move[0] * move[0] + move[1] * move[1]);
    if (size > 0.5) share = 0.5 / size;
    Separation next = s;
    bool better = false;
    for (int k = 0; k < rounding_halvings && !better; ++k, share *= 0.5) {
      const Vector n = s.n + (share * move[0]) * s.tangent[0] + (share * move[1]) * s.tangent[1];
      next = separation(near, placed, (1.0 / length(n)) * n, eps);
      better = next.value > s.value || size < 1e-6;
    }
    if (!better) break;
    s = next;
    found = size < rounding_step;
    const Vector turn = s.n - before;
    if (dot(turn, turn) > most * most) {  // on from the edge of what is looked at
      const Vector edge = before + (0.9 * most / length(turn)) * turn;
      n = (1.0 / length(edge)) * edge;
      return Rounded::turns_further;
    }
  }
  if (!stiffness(s, M)) return Rounded::failed;
  c.own_first = s.own_first;
  c.own_second = s.own_second;
  c.first = s.first;
  c.second = s.second;
  c.n = s.n;
  c.distance = s.value;
  c.rounded = true;
  c.apart = s.apart;
  c.tangent[0] = s.tangent[0];
  c.tangent[1] = s.tangent[1];
  c.bend[0] = s.at_first;
  c.bend[1] = s.at_second;
  return found ? Rounded::found : Rounded::unfinished;
}

// The size by which a shape is rounded if `size` is allowed, in [m].
inline double rounding_of(const Shape& shape, double size) {
  if (shape.kind == ShapeKind::cylinder) return size;
  const double share = rounding_of_all / double(shape.count);
  const double most = share > least_rounding ? share : least_rounding;
  return size < most ? size : most;
}

// The contact of the rounded shapes; it stays as it is where that is not found.
inline void round_off(const Model& model, const Placed& placed, double size, Contact& c) {
  const double eps = rounding_of(*placed.first, rounding_of(*placed.second, size));
  Vector n = c.n;
  double turn = first_turn, most = most_turn;
  for (int change = 0; change < turn_changes; ++change) {
    const Rounded how = round_within(model, placed, eps, turn, n, c);
    if (how == Rounded::found || how == Rounded::unfinished || how == Rounded::failed) return;
    if (how == Rounded::too_many_vertices) most = turn = 0.25 * turn;
    if (how == Rounded::turns_further) turn = 4.0 * turn < most ? 4.0 * turn : most;
  }
}

// A warm start from the normal of a nearby configuration, without GJK; false where the iteration
// does not converge, or where the rounded shapes overlap. The separation is concave where it is
// positive, so that any maximum is the largest one.
inline bool round_off_from(const Model& model, const Placed& placed, double size,
                           const double* normal, Contact& c) {
  Vector n{normal[0], normal[1], normal[2]};
  const double square = dot(n, n);
  if (!(square > 0.5 && square < 2.0)) return false;
  if (placed.first->bound > largest_warm || placed.second->bound > largest_warm) return false;
  n = (1.0 / __builtin_sqrt(square)) * n;
  const double eps = rounding_of(*placed.first, rounding_of(*placed.second, size));
  return round_within(model, placed, eps, first_turn, n, c) == Rounded::found && c.distance > 0.0;
}

// Adds force d'' of rounded shapes to a matrix (nv, nv). work: at least 6 x columns.
inline void add_rounded_curvature(const Contact& c, const Vector* velocity, double force,
                                  std::size_t nv, double* work, double* curvature) {
  const std::size_t m = c.columns;
  Plane M{c.bend[0].xx + c.bend[1].xx + c.apart, c.bend[0].xy + c.bend[1].xy,
          c.bend[0].yy + c.bend[1].yy + c.apart};
  double *const u = work, *const Cu = work + 2 * m, *const G = work + 4 * m;
  for (std::size_t i = 0; i < m; ++i) {
    const Plane& C = c.bend[c.column[i].second];
    const Vector turn = cross(c.n, c.twist[c.column[i].column].angular);
    double* const own = u + 2 * i;
    for (int k = 0; k < 2; ++k) own[k] = dot(turn, c.tangent[k]);
    Cu[2 * i] = C.xx * own[0] + C.xy * own[1];
    Cu[2 * i + 1] = C.xy * own[0] + C.yy * own[1];
    for (int k = 0; k < 2; ++k) G[2 * i + k] = dot(velocity[i], c.tangent[k]) - Cu[2 * i + k];
  }
  for (std::size_t j = 0; j < m; ++j) {
    double X[2];
    solve_plane(M, G[2 * j], G[2 * j + 1], X);
    for (std::size_t i = 0; i <= j; ++i) {
      double value = bending(c, velocity, i, j) + G[2 * i] * X[0] + G[2 * i + 1] * X[1];
      if (c.column[i].second == c.column[j].second)
        value -= u[2 * i] * Cu[2 * j] + u[2 * i + 1] * Cu[2 * j + 1];
      const std::size_t row = c.column[i].column, other = c.column[j].column;
      curvature[row * nv + other] += force * value;
      if (i != j) curvature[other * nv + row] += force * value;
    }
  }
}

}  // namespace
}  // namespace hovi::distances
