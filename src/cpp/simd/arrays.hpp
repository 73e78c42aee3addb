// NumPy arrays as function arguments, which say what is wrong with them, and aligned memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

namespace hovi::arrays {

// Such as "float64 array of shape (3, 2), read-only", or the type of what is no array.
inline std::string description(nanobind::handle argument) {
  for (const char* name : {"dtype", "shape", "flags"})
    if (!nanobind::hasattr(argument, name)) return nanobind::type_name(argument.type()).c_str();
  const nanobind::object dtype = argument.attr("dtype"), shape = argument.attr("shape");
  std::string words = nanobind::str(nanobind::handle(dtype)).c_str();
  words += std::string(" array of shape ") + nanobind::str(nanobind::handle(shape)).c_str();
  const nanobind::object flags = argument.attr("flags");
  if (!nanobind::cast<bool>(flags.attr("c_contiguous"))) words += ", not contiguous";
  if (!nanobind::cast<bool>(flags.attr("aligned"))) words += ", not aligned";
  if (!nanobind::cast<bool>(flags.attr("writeable"))) words += ", read-only";
  return words;
}

template <std::size_t dimensions>
std::string in_words(const std::array<std::size_t, dimensions>& shape) {
  std::string words = "(";
  for (std::size_t axis = 0; axis < dimensions; ++axis)
    words += (axis ? ", " : "") + std::to_string(shape[axis]);
  return words + (dimensions == 1 ? ",)" : ")");
}

template <typename Scalar>
constexpr const char* scalar_name() {
  if constexpr (std::is_same_v<Scalar, bool>) return "bool";
  return std::is_integral_v<Scalar> ? "int64" : "float64";
}

// Throws ValueError.
[[noreturn]] inline void refuse(const std::string& sentence) {
  throw std::invalid_argument(sentence);
}

// An argument of a compiled function, which nothing else may be assumed of before `require` has
// returned: data is null, and every size 0, where the argument is not an aligned, C-contiguous
// array of these scalars and dimensions, writable unless the scalar is const.
template <typename Scalar, std::size_t dimensions>
class Array {
 public:
  using Shape = std::array<std::size_t, dimensions>;

  Array() = default;
  explicit Array(nanobind::handle argument) : argument_(argument) {
    if (!nanobind::try_cast(argument, array_, false)) return;
    if (reinterpret_cast<std::uintptr_t>(array_.data()) % alignof(Scalar)) return;
    data_ = array_.data();
    for (std::size_t axis = 0; axis < dimensions; ++axis) shape_[axis] = array_.shape(axis);
    valid_ = true;
  }

  Scalar* data() const { return data_; }
  std::size_t shape(std::size_t axis) const { return shape_[axis]; }
  std::size_t size() const { return valid_ ? array_.size() : 0; }

  // Throws TypeError if the argument is another kind of array, ValueError if it has another shape.
  void require(const char* name, const Shape& shape) const {
    require_kind(name);
    if (shape_ != shape)
      refuse(std::string(name) + " must have shape " + in_words(shape) + ", got " +
             in_words(shape_) + ".");
  }

  void require_kind(const char* name) const {
    if (valid_) return;
    using Value = std::remove_const_t<Scalar>;
    const char* const access = std::is_const_v<Scalar> ? "an" : "a writable,";
    const std::string expected = std::string(access) + " aligned, C-contiguous array of " +
                                 scalar_name<Value>() + " with " + std::to_string(dimensions) +
                                 (dimensions == 1 ? " dimension" : " dimensions");
    const std::string message =
        std::string(name) + " must be " + expected + ", got: " + description(argument_) + ".";
    throw nanobind::type_error(message.c_str());
  }

 private:
  using Contiguous = nanobind::ndarray<Scalar, nanobind::numpy,
                                       nanobind::ndim<static_cast<nanobind::ssize_t>(dimensions)>,
                                       nanobind::c_contig, nanobind::device::cpu>;

  nanobind::handle argument_;
  Contiguous array_;
  Scalar* data_ = nullptr;
  Shape shape_{};
  bool valid_ = false;
};

template <std::size_t dimensions>
using Input = Array<const double, dimensions>;
template <std::size_t dimensions>
using Output = Array<double, dimensions>;
using Index = Array<const std::int64_t, 1>;

// As `require`, where there is an array.
template <typename Array>
auto* data_or_null(const char* name, const std::optional<Array>& array,
                   const typename Array::Shape& shape) {
  if (array) array->require(name, shape);
  return array ? array->data() : nullptr;
}

constexpr std::align_val_t alignment{64};

struct Free {
  void operator()(double* memory) const { ::operator delete(memory, alignment); }
};
using Workspace = std::unique_ptr<double, Free>;

inline Workspace allocate(std::size_t numbers) {
  void* memory = ::operator new(numbers * sizeof(double), alignment);
  return Workspace(static_cast<double*>(memory));
}

}  // namespace hovi::arrays

namespace nanobind::detail {

// Accepts everything, so that `require` says what is wrong and with which argument.
template <typename Scalar, std::size_t dimensions>
struct type_caster<hovi::arrays::Array<Scalar, dimensions>> {
  using Argument = hovi::arrays::Array<Scalar, dimensions>;
  NB_TYPE_CASTER(Argument, const_name("numpy.ndarray"))

  template <typename Flags>
  bool from_python(handle argument, Flags, cleanup_list*) noexcept {
    value = Argument(argument);
    return true;
  }
};

}  // namespace nanobind::detail
