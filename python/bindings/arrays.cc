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

}  // namespace

Rows::Rows(const std::vector<std::pair<std::string, py::object>>& arguments,
           const std::vector<int>& widths) {
  const py::module_ numpy = py::module_::import("numpy");
  std::vector<Array> given;
  py::list shapes;
  for (std::size_t k = 0; k < arguments.size(); ++k) {
    const auto& [name, object] = arguments[k];
    Array array = Array::ensure(object);
    if (!array) {
      PyErr_Clear();
      throw py::value_error(name + " is not an array of numbers");
    }
    if (array.ndim() < 1 || array.shape(array.ndim() - 1) != widths[k])
      throw py::value_error(fmt::format("{} has shape {}; its last axis has to hold {} components",
                                        name, ShapeText(array), widths[k]));
    py::list shape;
    for (py::ssize_t axis = 0; axis + 1 < array.ndim(); ++axis) shape.append(array.shape(axis));
    shapes.append(py::tuple(shape));
    names_.push_back(name);
    widths_.push_back(static_cast<std::size_t>(widths[k]));
    given.push_back(std::move(array));
  }
  py::tuple common;
  try {
    common = numpy.attr("broadcast_shapes")(*shapes);
  } catch (const py::error_already_set&) {
    std::string text;
    for (std::size_t k = 0; k < given.size(); ++k)
      text += fmt::format("{}{} {}", k ? ", " : "", names_[k], ShapeText(given[k]));
    throw py::value_error("shapes do not go together: " + text);
  }
  for (const py::handle size : common) shape_.push_back(size.cast<py::ssize_t>());
  for (const py::ssize_t size : shape_) count_ *= static_cast<std::size_t>(size);
  for (std::size_t k = 0; k < given.size(); ++k) {
    py::list full;
    for (const py::ssize_t size : shape_) full.append(size);
    full.append(widths[k]);
    kept_.push_back(Array::ensure(numpy.attr("broadcast_to")(given[k], py::tuple(full))));
    data_.push_back(kept_.back().data());
  }
}

lightfield::Vec3 Rows::unit(std::size_t argument, std::size_t i) const {
  const lightfield::Vec3 v = vec3(argument, i);
  const double length = lightfield::Length(v);
  if (!(length > 0) || !std::isfinite(length))
    throw py::value_error(fmt::format("{} {} is ({}, {}, {}), which has no direction",
                                      names_[argument], i, v.x, v.y, v.z));
  return (1 / length) * v;
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
