// Between numpy and plain vectors: points, directions and pixels, without copies where memory can
// be shared.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::python {

using Array = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

// Several arguments of vectors, broadcast against each other as numpy does: any shape, but the last
// axis holds the `width` components of a vector.
class Rows {
 public:
  // ValueError naming the argument for another last axis or shapes that do not go together.
  Rows(const std::vector<std::pair<std::string, pybind11::object>>& arguments,
       const std::vector<int>& widths);

  std::size_t count() const { return count_; }
  // Component k of vector i of an argument.
  double at(std::size_t argument, std::size_t i, int k) const {
    return data_[argument][i * widths_[argument] + k];
  }
  lightfield::Vec2 vec2(std::size_t argument, std::size_t i) const {
    return {at(argument, i, 0), at(argument, i, 1)};
  }
  lightfield::Vec3 vec3(std::size_t argument, std::size_t i) const {
    return {at(argument, i, 0), at(argument, i, 1), at(argument, i, 2)};
  }
  // The unit vector along it; ValueError naming the argument if it has no length.
  lightfield::Vec3 unit(std::size_t argument, std::size_t i) const;

  // An array of the arguments' common shape with `last` axes behind it.
  Array Result(std::vector<pybind11::ssize_t> last) const;

 private:
  std::vector<std::string> names_;
  std::vector<std::size_t> widths_;
  std::vector<Array> kept_;
  std::vector<const double*> data_;
  std::vector<pybind11::ssize_t> shape_;
  std::size_t count_ = 1;
};

// body(i) for every i in [0, count), on all threads, without the interpreter's lock; every
// `grain` of them Ctrl-C is looked at, which raises KeyboardInterrupt.
void ForEach(std::size_t count, std::size_t grain, const std::function<void(std::size_t i)>& body);

// A numpy array of this shape over memory that `owner` keeps alive. Read-only unless `writable`.
template <class T>
pybind11::array View(std::span<T> pixels, const std::vector<pybind11::ssize_t>& shape,
                     pybind11::handle owner, bool writable) {
  pybind11::array_t<std::remove_const_t<T>> array(shape, pixels.data(), owner);
  if (!writable) array.attr("setflags")(pybind11::arg("write") = false);
  return array;
}

// A numpy array that takes a vector's memory over.
template <class T>
pybind11::array Take(std::vector<T>&& values, const std::vector<pybind11::ssize_t>& shape) {
  auto kept = std::make_unique<std::vector<T>>(std::move(values));
  T* data = kept->data();
  pybind11::capsule owner(kept.release(), [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return pybind11::array_t<T>(shape, data, owner);
}

}  // namespace luxfield::python
