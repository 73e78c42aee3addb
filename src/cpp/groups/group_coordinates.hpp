// SE(2), SO(3) and SE(3) as parts of SO(3) over dual numbers w + e v.
#pragma once

#include "dual_numbers.hpp"

namespace hovi::groups {
namespace {

// Indices of a group's tangent vectors in those (v, w) of SE(3); translations come first.
struct SE2 {
  static constexpr std::size_t k = 3, translations = 2;
  static constexpr std::size_t twist_indices[k] = {0, 1, 5};
};
struct SO3 {
  static constexpr std::size_t k = 3, translations = 0;
  static constexpr std::size_t twist_indices[k] = {3, 4, 5};
};
struct SE3 {
  static constexpr std::size_t k = 6, translations = 3;
  static constexpr std::size_t twist_indices[k] = {0, 1, 2, 3, 4, 5};
};
constexpr std::size_t largest_group = 6;

// A matrix of the group's tangent space. Linear maps have zeros where rotations would depend on
// translations.
template <typename Group>
struct Square {
  Pack at[Group::k][Group::k];
};

template <typename Group>
inline Vector<Dual> motion(const Pack* x) {
  Vector<Dual> dual{};
  for (std::size_t i = 0; i < Group::k; ++i) {
    const std::size_t index = Group::twist_indices[i];
    dual.at[index % 3].at[0][index < 3] = x[i];
  }
  return dual;
}

template <typename Group>
inline void read(const Vector<Dual>& dual, Pack* x) {
  for (std::size_t i = 0; i < Group::k; ++i) {
    const std::size_t index = Group::twist_indices[i];
    x[i] = dual.at[index % 3].at[0][index < 3];
  }
}

// A covector: n . y is the part in e of (n_v + e n_w) . (y_w + e y_v).
template <typename Group>
inline Vector<Dual> force(const Pack* n) {
  Vector<Dual> dual{};
  for (std::size_t i = 0; i < Group::k; ++i) {
    const std::size_t index = Group::twist_indices[i];
    dual.at[index % 3].at[0][index >= 3] = n[i];
  }
  return dual;
}

// A linear map.
template <typename Group>
inline Square<Group> linear(const Matrix<Dual>& dual) {
  Square<Group> matrix;
  for (std::size_t i = 0; i < Group::k; ++i)
    for (std::size_t j = 0; j < Group::k; ++j) {
      const std::size_t row = Group::twist_indices[i], column = Group::twist_indices[j];
      const Dual& entry = dual.at[row % 3][column % 3];
      matrix.at[i][j] = row >= 3 && column < 3 ? Pack{} : entry.at[0][row < 3 && column >= 3];
    }
  return matrix;
}

// A bilinear form: y, z -> the part in e of y . F z.
template <typename Group>
inline Square<Group> form(const Matrix<Dual>& dual) {
  Square<Group> matrix;
  for (std::size_t i = 0; i < Group::k; ++i)
    for (std::size_t j = 0; j < Group::k; ++j) {
      const std::size_t row = Group::twist_indices[i], column = Group::twist_indices[j];
      const Dual& entry = dual.at[row % 3][column % 3];
      matrix.at[i][j] = row < 3 && column < 3 ? Pack{} : entry.at[0][row >= 3 && column >= 3];
    }
  return matrix;
}

}  // namespace
}  // namespace hovi::groups
