#include "luxfield/lightfield/measurements.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.h"
#include "bindings.h"
#include "unlocked.h"

namespace luxfield::python {
namespace {

namespace py = pybind11;
using lightfield::Measurement;
using lightfield::Measurements;

// The measurement at place (i, j) of the grid; IndexError beside it.
Measurement& At(Measurements& all, int i, int j) {
  const lightfield::BasisGrid& grid = all.geometry.grid;
  if (i < 0 || i >= grid.width || j < 0 || j >= grid.height)
    throw py::index_error("position (" + std::to_string(i) + ", " + std::to_string(j) +
                          ") is beside the grid of " + std::to_string(grid.width) + " x " +
                          std::to_string(grid.height));
  return all.positions[static_cast<std::size_t>(grid.index(i, j))];
}

}  // namespace

void AddMeasurements(py::module_& module) {
  py::class_<Measurements> type(module, "Measurements",
                                R"(Irradiance on I behind each filter (an .meas.exr), registered.

`irradiance`, `sigma`, `count` and `mask` take the place (i, j) of the filter on its grid and give
arrays over the object's own memory, read-only.)");
  type.def_static(
      "read",
      [](const std::filesystem::path& path) {
        return Unlocked(2, [&] { return lightfield::ReadMeasurements(path); });
      },
      py::arg("path"), "Reads an .meas.exr.");
  type.def_property_readonly(
      "grid",
      [](const Measurements& all) {
        return std::pair(all.geometry.grid.width, all.geometry.grid.height);
      },
      "Positions along u and v.");
  type.def_property_readonly(
      "delta_m", [](const Measurements& all) { return all.geometry.delta_m; },
      "Distance from F to I.");
  type.def_property_readonly(
      "unit", [](const Measurements& all) { return FluxUnitName(all.geometry.unit); }, "Of flux.");
  type.def_readonly("provenance", &Measurements::provenance, "What made the file.");
  const auto planes = [&](const char* name, std::vector<float> Measurement::*member,
                          bool per_channel, const char* text) {
    type.def(
        name,
        [member, per_channel](const py::object& self, int i, int j) {
          auto& all = self.cast<Measurements&>();
          const lightfield::LuminaireGeometry& g = all.geometry;
          std::vector<py::ssize_t> shape{g.lattice.height, g.lattice.width};
          if (per_channel) shape.insert(shape.begin(), g.channels);
          return View(std::span(At(all, i, j).*member), shape, self, false);
        },
        py::arg("i"), py::arg("j"), text);
  };
  planes("irradiance", &Measurement::irradiance, true,
         "E [channel, row, column], unit m^-2; 0 where `mask` says that it is unknown.");
  planes("sigma", &Measurement::sigma, true, "Standard deviation of `irradiance`.");
  planes("count", &Measurement::count, false, "Effective number of exposures [row, column].");
  type.def(
      "mask",
      [](const py::object& self, int i, int j) {
        auto& all = self.cast<Measurements&>();
        return View(std::span(At(all, i, j).mask),
                    {all.geometry.lattice.height, all.geometry.lattice.width}, self, false);
      },
      py::arg("i"), py::arg("j"),
      "Flags [row, column]: 1 off the sensor, 2 saturated, 4 not detected, 8 defect, 16 partly "
      "defect, 32 below black. 0 is a good value.");
  type.def(
      "displacement_m",
      [](Measurements& all, int i, int j) {
        const lightfield::Vec2 d = At(all, i, j).displacement_m;
        return std::pair(d.x, d.y);
      },
      py::arg("i"), py::arg("j"), "Where the filter was, less where the grid has it, (u, v).");
  type.def("__repr__", [](const Measurements& all) {
    return "<luxfield.Measurements: " + std::to_string(all.geometry.grid.width) + " x " +
           std::to_string(all.geometry.grid.height) + " positions, " +
           std::to_string(all.geometry.lattice.width) + " x " +
           std::to_string(all.geometry.lattice.height) + " texels>";
  });
}

}  // namespace luxfield::python
