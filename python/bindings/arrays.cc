#include "arrays.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/core/parallel.h"

namespace luxfield::python {
namespace py = pybind11;

namespace {

std::string ShapeText(const Array& array) {
  std::string text = "(";
  for (py::ssize_t axis = 0; axis < array.ndim(); ++axis)
    text += fmt::format("{}{}", axis ? ", " : "", array.shape(axis));
  return text + ")";
}

// How many vectors an array has along one of the axes that all have in common.
py::ssize_t SizeAlong(const Array& array, std::size_t axis, std::size_t axes) {
  const std::size_t missing = axes + 1 - static_cast<std::size_t>(array.ndim());
  return axis < missing ? 1 : array.shape(static_cast<py::ssize_t>(axis - missing));
}

}  // namespace

Rows::Rows(const std::vector<std::pair<std::string, py::object>>& arguments,
           const std::vector<int>& widths) {
  std::size_t axes = 0;
  for (std::size_t k = 0; k < arguments.size(); ++k) {
    const auto& [name, object] = arguments[k];
    const Array array = NumbersOf<double>(name, object);
    const py::ssize_t last = array.ndim() - 1;
    if (last < 0 || array.shape(last) != widths[k])
      throw py::value_error(fmt::format("{} has shape {}; its last axis has to hold {} components",
                                        name, ShapeText(array), widths[k]));
    axes = std::max(axes, static_cast<std::size_t>(last));
    const auto width = static_cast<std::size_t>(widths[k]);
    arguments_.push_back({name, array, width, static_cast<std::size_t>(array.size()) / width, {}});
  }
  shape_.assign(axes, 1);
  for (const Argument& one : arguments_)
    for (std::size_t axis = 0; axis < axes; ++axis) {
      const py::ssize_t size = SizeAlong(one.array, axis, axes);
      if (size == 1) continue;
      if (shape_[axis] != 1 && shape_[axis] != size) {
        std::string text;
        for (const Argument& other : arguments_)
          text +=
              fmt::format("{}{} {}", text.empty() ? "" : ", ", other.name, ShapeText(other.array));
        throw py::value_error("shapes do not go together: " + text);
      }
      shape_[axis] = size;
    }
  for (const py::ssize_t size : shape_) count_ *= static_cast<std::size_t>(size);
  for (Argument& one : arguments_) {
    one.strides.resize(axes);
    std::size_t stride = 1;
    for (std::size_t axis = axes; axis-- > 0;) {
      const auto size = static_cast<std::size_t>(SizeAlong(one.array, axis, axes));
      one.strides[axis] = size == 1 ? 0 : stride;
      stride *= size;
    }
  }
}

const double* Rows::At(const Argument& argument, std::size_t i) const {
  std::size_t own = argument.count == 1 ? 0 : i;
  if (argument.count != 1 && argument.count != count_) {
    own = 0;
    for (std::size_t axis = shape_.size(); axis-- > 0;) {
      const auto size = static_cast<std::size_t>(shape_[axis]);
      own += i % size * argument.strides[axis];
      i /= size;
    }
  }
  return argument.array.data() + own * argument.width;
}

void Rows::Normalise(std::size_t argument) {
  Argument& one = arguments_[argument];
  Array units({static_cast<py::ssize_t>(one.count), py::ssize_t{3}});
  double* unit = units.mutable_data();
  for (std::size_t i = 0; i < one.count; ++i) {
    const double* v = one.array.data() + 3 * i;
    const double length = lightfield::Length({v[0], v[1], v[2]});
    if (!(length > 0) || !std::isfinite(length))
      throw py::value_error(fmt::format("{} {} is ({}, {}, {}), which has no direction", one.name,
                                        i, v[0], v[1], v[2]));
    for (int k = 0; k < 3; ++k) unit[3 * i + k] = v[k] * (1 / length);
  }
  one.array = units;
}

Array Rows::Result(std::vector<py::ssize_t> last) const {
  std::vector<py::ssize_t> shape = shape_;
  shape.insert(shape.end(), last.begin(), last.end());
  return Array(shape);
}

void ForEach(std::size_t count, std::size_t grain, const std::function<void(std::size_t i)>& body) {
  // Between batches the interpreter is asked whether the user wants to stop.
  const std::size_t batch = grain * 256;
  for (std::size_t from = 0; from < count; from += batch) {
    const std::size_t size = std::min(batch, count - from);
    {
      const py::gil_scoped_release unlocked;
      core::ParallelFor(size, grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) body(from + i);
      });
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
}

}  // namespace luxfield::python
