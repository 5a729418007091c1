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

template <class T>
using Numbers = pybind11::array_t<T, pybind11::array::c_style | pybind11::array::forcecast>;
using Array = Numbers<double>;

// An argument as an array, converted where it has another layout. ValueError naming it where it
// holds no numbers; numpy's MemoryError.
template <class T>
Numbers<T> NumbersOf(const std::string& name, const pybind11::object& object) {
  try {
    return Numbers<T>(object);
  } catch (pybind11::error_already_set& error) {
    for (PyObject* kind : {PyExc_TypeError, PyExc_ValueError, PyExc_OverflowError})
      if (error.matches(kind)) throw pybind11::value_error(name + " is not an array of numbers");
    throw;
  }
}

// Several arguments of vectors, broadcast against each other as numpy does: any shape, but the last
// axis holds the `width` components of a vector. Nothing is copied for that.
class Rows {
 public:
  // ValueError naming the argument for another last axis or shapes that do not go together.
  Rows(const std::vector<std::pair<std::string, pybind11::object>>& arguments,
       const std::vector<int>& widths);

  // Vectors of the common shape; more than memory holds, until Result has been made for them.
  std::size_t count() const { return count_; }
  // Vector i of an argument.
  lightfield::Vec2 vec2(std::size_t argument, std::size_t i) const {
    const double* v = At(arguments_[argument], i);
    return {v[0], v[1]};
  }
  lightfield::Vec3 vec3(std::size_t argument, std::size_t i) const {
    const double* v = At(arguments_[argument], i);
    return {v[0], v[1], v[2]};
  }

  // Turns an argument's vectors of three components into unit vectors; ValueError naming it and the
  // first that has no length.
  void Normalise(std::size_t argument);

  // An array of the arguments' common shape with `last` axes behind it; numpy's errors where it is
  // too large.
  Array Result(std::vector<pybind11::ssize_t> last) const;

 private:
  struct Argument {
    std::string name;
    Array array;
    std::size_t width, count;          // components of a vector, vectors of its own
    std::vector<std::size_t> strides;  // along each axis of the common shape, in vectors
  };
  const double* At(const Argument& argument, std::size_t i) const;

  std::vector<Argument> arguments_;
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
