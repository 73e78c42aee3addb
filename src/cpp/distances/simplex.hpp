// The point of a simplex with the least distance from the origin [Ericson2004, chapter 5].
#pragma once

#include "vectors.hpp"

namespace hovi::distances {
namespace {

// Points of the difference of two shapes, y = second - first, with the points of the shapes in
// their own frames, and the weights of the point of least norm.
struct Simplex {
  std::size_t count = 0;
  Vector y[4]{}, first[4]{}, second[4]{};
  double weight[4]{};
  std::size_t last_first = 0, last_second = 0;  // where the last searches for farthest points ended

  void add(const Vector& a, const Vector& b, const Vector& difference) {
    first[count] = a;
    second[count] = b;
    y[count++] = difference;
  }

  // Keeps some points, given by ascending numbers, with these weights.
  void keep(std::size_t points, const std::size_t* number, const double* weights) {
    for (std::size_t i = 0; i < points; ++i) {
      const std::size_t k = number[i];
      y[i] = y[k], first[i] = first[k], second[i] = second[k];
      weight[i] = weights[i];
    }
    count = points;
  }

  Vector nearest() const {
    Vector sum{0.0, 0.0, 0.0};
    for (std::size_t i = 0; i < count; ++i) sum = sum + weight[i] * y[i];
    return sum;
  }
};

// A face of a simplex: the numbers of its points, and the weights of its nearest point.
struct Face {
  std::size_t count = 0;
  std::size_t number[3]{};
  double weight[3]{};

  void add(std::size_t k, double share) {
    number[count] = k;
    weight[count++] = share;
  }
  Vector nearest(const Vector* y) const {
    Vector sum{0.0, 0.0, 0.0};
    for (std::size_t i = 0; i < count; ++i) sum = sum + weight[i] * y[number[i]];
    return sum;
  }
};

inline Face nearest_on_segment(const Vector* y, std::size_t i, std::size_t j) {
  const Vector edge = y[j] - y[i];
  const double along = -dot(y[i], edge), square = dot(edge, edge);
  Face face;
  if (along <= 0.0) {
    face.add(i, 1.0);
  } else if (along >= square) {
    face.add(j, 1.0);
  } else {
    face.add(i, 1.0 - along / square);
    face.add(j, along / square);
  }
  return face;
}

inline Face nearer(const Vector* y, const Face& first, const Face& second) {
  const Vector a = first.nearest(y), b = second.nearest(y);
  return dot(b, b) < dot(a, a) ? second : first;
}

inline Face nearest_on_triangle(const Vector* y, std::size_t i, std::size_t j, std::size_t k) {
  const Vector &a = y[i], &b = y[j], &c = y[k];
  const Vector ab = b - a, ac = c - a;
  const double d1 = -dot(ab, a), d2 = -dot(ac, a), d3 = -dot(ab, b), d4 = -dot(ac, b);
  const double d5 = -dot(ab, c), d6 = -dot(ac, c);
  Face face;
  if (d1 <= 0.0 && d2 <= 0.0) {
    face.add(i, 1.0);
    return face;
  }
  if (d3 >= 0.0 && d4 <= d3) {
    face.add(j, 1.0);
    return face;
  }
  if (d6 >= 0.0 && d5 <= d6) {
    face.add(k, 1.0);
    return face;
  }
  // The signed areas opposite to the corners, by the normal: less is lost in thin triangles.
  const Vector normal = cross(ab, ac);
  const double va = dot(normal, cross(b, c)), vb = dot(normal, cross(c, a)),
               vc = dot(normal, cross(a, b));
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return nearest_on_segment(y, i, j);
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return nearest_on_segment(y, i, k);
  if (va <= 0.0 && d4 >= d3 && d5 >= d6) return nearest_on_segment(y, j, k);
  const double total = va + vb + vc;
  if (!(va > 0.0 && vb > 0.0 && vc > 0.0)) {  // no area
    const Face other = nearer(y, nearest_on_segment(y, i, k), nearest_on_segment(y, j, k));
    return nearer(y, nearest_on_segment(y, i, j), other);
  }
  face.add(i, va / total);
  face.add(j, vb / total);
  face.add(k, vc / total);
  return face;
}

// The nearest of the faces with the last point that the origin is not inside of; no points if it is
// inside of all: then the shapes overlap.
inline Face nearest_on_tetrahedron(const Vector* y) {
  constexpr std::size_t faces[3][4] = {{0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
  Face best;
  double least = 0.0;
  for (const auto& f : faces) {
    const Vector normal = cross(y[f[1]] - y[f[0]], y[f[2]] - y[f[0]]);
    const double origin = -dot(normal, y[f[0]]), opposite = dot(normal, y[f[3]] - y[f[0]]);
    if (origin * opposite > 0.0) continue;
    const Face face = nearest_on_triangle(y, f[0], f[1], f[2]);
    const Vector w = face.nearest(y);
    const double square = dot(w, w);
    if (best.count == 0 || square < least) best = face, least = square;
  }
  return best;
}

inline Face nearest_face(const Simplex& simplex) {
  const Vector* y = simplex.y;
  Face face;
  switch (simplex.count) {
    case 1:
      face.add(0, 1.0);
      return face;
    case 2:
      return nearest_on_segment(y, 0, 1);
    case 3:
      return nearest_on_triangle(y, 0, 1, 2);
    default:
      return nearest_on_tetrahedron(y);
  }
}

}  // namespace
}  // namespace hovi::distances
