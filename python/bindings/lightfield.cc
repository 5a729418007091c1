#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cstring>

#include "arrays.h"
#include "bindings.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/light_vector.h"
#include "unlocked.h"

namespace luxfield::python {
namespace {

namespace py = pybind11;
using lightfield::LightField;
using lightfield::LuminaireGeometry;
using Shape = std::vector<py::ssize_t>;

Shape CoefficientShape(const LuminaireGeometry& geometry) {
  return {geometry.grid.count(), geometry.channels, geometry.lattice.height,
          geometry.lattice.width};
}

LightField FromArray(const py::object& C, std::pair<int, int> grid, double spacing_m,
                     double delta_m, double texel_m, const std::string& basis, double basis_a,
                     const std::string& unit, std::optional<std::pair<double, double>> corner_m,
                     std::optional<std::pair<double, double>> top_left_m,
                     const lightfield::Provenance& provenance) {
  const Numbers<float> coefficients = NumbersOf<float>("C", C);
  if (coefficients.ndim() != 4)
    throw py::value_error("C has " + std::to_string(coefficients.ndim()) +
                          " axes; it needs four: [image, channel, row, column]");
  LuminaireGeometry geometry;
  geometry.delta_m = delta_m;
  geometry.grid = lightfield::BasisGrid::Centred(lightfield::Basis::FromName(basis, basis_a),
                                                 grid.first, grid.second, spacing_m);
  if (corner_m) std::tie(geometry.grid.u0_m, geometry.grid.v0_m) = *corner_m;
  geometry.channels = static_cast<int>(coefficients.shape(1));
  geometry.unit = lightfield::FluxUnitFromName(unit);
  lightfield::Lattice& lattice = geometry.lattice;
  lattice.height = static_cast<int>(coefficients.shape(2));
  lattice.width = static_cast<int>(coefficients.shape(3));
  lattice.ds_m = lattice.dt_m = texel_m;
  lattice.s0_m = top_left_m ? top_left_m->first : -0.5 * lattice.extent_s_m();
  lattice.t1_m = top_left_m ? top_left_m->second : 0.5 * lattice.extent_t_m();
  Unlocked(1, [&] {
    geometry.Validate("LightField");
    return true;
  });
  if (coefficients.shape(0) != geometry.grid.count())
    throw py::value_error("C has " + std::to_string(coefficients.shape(0)) + " images, a grid of " +
                          std::to_string(grid.first) + " x " + std::to_string(grid.second) +
                          " needs " + std::to_string(geometry.grid.count()));
  LightField field(geometry);
  field.provenance = provenance;
  std::memcpy(field.data.data(), coefficients.data(), field.data.size() * sizeof(float));
  for (const float value : field.data)
    if (!std::isfinite(value)) throw py::value_error("C holds values that are not finite");
  return field;
}

// One value per channel of the field for each of the rows.
template <class PerChannel>
Array PerRow(const LightField& field, const Rows& rows, std::size_t grain, PerChannel of_row) {
  const int channels = field.geometry.channels;
  Array result = rows.Result({channels});
  double* out = result.mutable_data();
  ForEach(rows.count(), grain, [&](std::size_t i) {
    const std::array<double, 3> value = of_row(i);
    for (int c = 0; c < channels; ++c) out[i * channels + c] = value[c];
  });
  return result;
}

std::vector<double> Channels(const LightField& field, const std::array<double, 3>& values) {
  return {values.begin(), values.begin() + field.geometry.channels};
}

std::string Describe(const LightField& field) {
  const LuminaireGeometry& g = field.geometry;
  return "<luxfield.LightField: " + std::to_string(g.grid.width) + " x " +
         std::to_string(g.grid.height) + " " + g.grid.basis.name() + ", " +
         std::to_string(g.lattice.width) + " x " + std::to_string(g.lattice.height) + " texels, " +
         std::to_string(g.channels) + (g.channels == 1 ? " channel" : " channels") + ", " +
         lightfield::FluxUnitName(g.unit) + ">";
}

}  // namespace

void AddLightField(py::module_& module) {
  py::class_<LightField> type(module, "LightField", R"(A luminaire as a light field.

Its coefficient images C and the basis on the filter plane F give the radiance of every ray from u
on F to s on the image plane I, which lies delta_m before F (docs/theory.md, section 2):

    L(u -> s) = delta^2 / cos^4(theta) sum_ij C_ij(s) Phi_ij(u)

All lengths are metres in the luminaire's frame: F is z = 0, light travels towards +z. Arrays of
points and directions have any shape whose last axis is the vector; results have that shape with one
value per channel. The interpreter's lock is released while numbers are computed.)");
  type.def(py::init(&FromArray), py::arg("C"), py::kw_only(), py::arg("grid"), py::arg("spacing_m"),
           py::arg("delta_m"), py::arg("texel_m"), py::arg("basis") = "bspline2",
           py::arg("basis_a") = 0.5, py::arg("unit") = "relative", py::arg("corner_m") = py::none(),
           py::arg("top_left_m") = py::none(), py::arg("provenance") = lightfield::Provenance{},
           R"(A light field from an array, which is copied.

C          [image, channel, row, column], unit sr^-1 m^-4; image j W + i of grid = (W, H);
           1 channel (luminance) or 3 (linear Rec. 709)
spacing_m  between neighbouring basis functions
texel_m    side of a texel on I
basis      "box", "bilinear", "quadratic" (shape basis_a) or "bspline2"
unit       of flux: "W", "lm" or "relative"
corner_m   (u, v) of the support's lower corner; None centres the grid on the axis
top_left_m (s, t) of the upper left corner of the picture on I; None centres it)");
  type.def_static(
      "read",
      [](const std::filesystem::path& path) {
        return Unlocked(2, [&] { return lightfield::ReadLightField(path); });
      },
      py::arg("path"), "Reads an .lf.exr; InputError for what is none or damaged.");
  type.def(
      "write",
      [](const LightField& field, const std::filesystem::path& path) {
        lightfield::WriteLightField(path, field);
      },
      py::arg("path"), py::call_guard<py::gil_scoped_release>(),
      "Writes an .lf.exr: whole, or not at all.");
  type.def_property_readonly(
      "C",
      [](const py::object& self) {
        auto& field = self.cast<LightField&>();
        return View(std::span(field.data), CoefficientShape(field.geometry), self, true);
      },
      "The coefficients [image, channel, row, column], float32, sr^-1 m^-4: the object's own "
      "memory, "
      "writable.");
  type.def_property_readonly(
      "flux",
      [](const LightField& field) {
        const std::vector<double> flux = Channels(field, lightfield::TotalFlux(field));
        return Array(static_cast<py::ssize_t>(flux.size()), flux.data());
      },
      "Flux through F of each channel, in `unit`.");
  const auto number = [&](const char* name, auto get, const char* text) {
    type.def_property_readonly(
        name, [get](const LightField& field) { return get(field.geometry); }, text);
  };
  number(
      "delta_m", [](const auto& g) { return g.delta_m; }, "Distance from F to I.");
  number(
      "grid", [](const auto& g) { return std::pair(g.grid.width, g.grid.height); },
      "Basis functions along u and v.");
  number(
      "spacing_m", [](const auto& g) { return g.grid.spacing_m; }, "Between basis functions.");
  number(
      "corner_m", [](const auto& g) { return std::pair(g.grid.u0_m, g.grid.v0_m); },
      "(u, v) of the support's lower corner.");
  number(
      "basis", [](const auto& g) { return g.grid.basis.name(); }, "Name of the basis.");
  number(
      "texel_m", [](const auto& g) { return std::pair(g.lattice.ds_m, g.lattice.dt_m); },
      "Sides of a texel on I along s and t.");
  number(
      "top_left_m", [](const auto& g) { return std::pair(g.lattice.s0_m, g.lattice.t1_m); },
      "(s, t) of the upper left corner of the picture on I.");
  number(
      "unit", [](const auto& g) { return lightfield::FluxUnitName(g.unit); }, "Of flux.");
  type.def_readonly("provenance", &LightField::provenance,
                    "What made the file, as names to values.");

  type.def(
      "radiance",
      [](const LightField& field, const py::object& u, const py::object& s) {
        const Rows rows({{"u", u}, {"s", s}}, {2, 2});
        return PerRow(field, rows, 256, [&](std::size_t i) {
          return lightfield::Radiance(field, rows.vec2(0, i), rows.vec2(1, i));
        });
      },
      py::arg("u"), py::arg("s"),
      "Radiance of the rays from u[..., 2] on F to s[..., 2] on I: [..., channel], unit sr^-1 "
      "m^-2; "
      "0 beside the supports or the picture.");
  type.def(
      "irradiance",
      [](const LightField& field, const py::object& points, const py::object& normals) {
        Rows rows({{"points", points}, {"normals", normals}}, {3, 3});
        rows.Normalise(1);
        return PerRow(field, rows, 1, [&](std::size_t i) {
          return lightfield::ExactIrradiance(field, rows.vec3(0, i), rows.vec3(1, i));
        });
      },
      py::arg("points"), py::arg("normals"),
      "Irradiance at points[..., 3] on surfaces with these normals[..., 3] (of any length), direct "
      "light without shadows: [..., channel], unit m^-2. Closed form in double precision, about "
      "1e-12, also where the horizon cuts the lamp (docs/theory.md, section 7).");
  type.def(
      "light_vector",
      [](const LightField& field, const py::object& points) {
        const Rows rows({{"points", points}}, {3});
        const int channels = field.geometry.channels;
        Array result = rows.Result({channels, 3});
        double* out = result.mutable_data();
        ForEach(rows.count(), 1, [&](std::size_t i) {
          const lightfield::LightVector light =
              lightfield::ClosedFormLightVector(field, rows.vec3(0, i));
          for (int c = 0; c < channels; ++c) {
            double* j = out + (i * channels + c) * 3;
            j[0] = light.j[c].x, j[1] = light.j[c].y, j[2] = light.j[c].z;
          }
        });
        return result;
      },
      py::arg("points"),
      "J at points[..., 3]: [..., channel, 3], unit m^-2. n . J is the irradiance on a surface "
      "that "
      "sees all of the lamp; J points to the lamp.");
  type.def(
      "intensity",
      [](const LightField& field, const py::object& directions) {
        Rows rows({{"directions", directions}}, {3});
        rows.Normalise(0);
        return PerRow(field, rows, 4, [&](std::size_t i) {
          return lightfield::FarFieldIntensity(field, rows.vec3(0, i));
        });
      },
      py::arg("directions"),
      "Far-field intensity in directions[..., 3] (of any length): [..., channel], unit sr^-1.");
  type.def("__repr__", &Describe);

  module.def(
      "gram_matrix",
      [](const std::string& basis, int count, double spacing_m, double basis_a) {
        if (count < 1) throw py::value_error("count has to be 1 or more");
        return Take(
            lightfield::GramMatrix(lightfield::Basis::FromName(basis, basis_a), count, spacing_m),
            {count, count});
      },
      py::arg("basis"), py::arg("count"), py::arg("spacing_m"), py::arg("basis_a") = 0.5,
      "<Phi_i, Phi_m> along one axis, [count, count], metres.");
  module.def(
      "basis_values",
      [](const std::string& name, const py::object& x, double basis_a) {
        const lightfield::Basis basis = lightfield::Basis::FromName(name, basis_a);
        return py::vectorize([basis](double at) { return basis.Value(at); })(
            NumbersOf<double>("x", x));
      },
      py::arg("basis"), py::arg("x"), py::arg("basis_a") = 0.5,
      "B(x), x in spacings from the lower end of the support.");
  module.def(
      "basis_cells",
      [](const std::string& name) { return lightfield::Basis::FromName(name).cells; },
      py::arg("basis"), "How many knot cells a basis function covers along an axis.");
}

}  // namespace luxfield::python
