#include "luxfield/environment/environment_map.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.h"
#include "bindings.h"
#include "unlocked.h"

namespace luxfield::python {
namespace {

namespace py = pybind11;
using environment::EnvironmentPicture;

environment::EnvironmentLayout LayoutOf(const std::string& name) {
  if (const auto layout = environment::EnvironmentLayoutFromName(name)) return *layout;
  throw py::value_error("layout '" + name + "' is none of " +
                        environment::EnvironmentLayoutNames());
}

// The pixel that shows a direction, if one does.
std::optional<std::pair<int, int>> PixelOf(const EnvironmentPicture& picture,
                                           const environment::TexelEdges& edges,
                                           lightfield::Vec3 w) {
  const auto place = environment::PictureFromDirection(picture.layout, w);
  if (!place) return std::nullopt;
  const auto cell = [](const std::vector<double>& borders, double at) {
    const auto above = std::upper_bound(borders.begin() + 1, borders.end() - 1, at);
    return static_cast<int>(above - borders.begin()) - 1;
  };
  return std::pair(cell(edges.y, place->point.y), cell(edges.x, place->point.x));
}

}  // namespace

void AddEnvironment(py::module_& module) {
  py::class_<EnvironmentPicture> type(
      module, "Environment",
      R"(An environment map: light from infinitely far (.exr or .hdr).

World frame: right-handed, z up; forward, the middle of a latitude-longitude picture, is -y.)");
  type.def_static(
      "read",
      [](const std::filesystem::path& path, const std::optional<std::string>& layout) {
        std::optional<environment::EnvironmentLayout> named;
        if (layout) named = LayoutOf(*layout);
        return Unlocked(2, [&] { return environment::ReadEnvironmentPicture(path, named); });
      },
      py::arg("path"), py::arg("layout") = py::none(),
      "Reads a picture; `layout` is of one that does not tell it.");
  type.def_property_readonly(
      "pixels",
      [](const py::object& self) {
        auto& image = self.cast<EnvironmentPicture&>().image;
        return View(std::span(image.data), {image.channels, image.height, image.width}, self, true);
      },
      "Radiance [channel, row, column], float32: the object's own memory.");
  type.def_property_readonly(
      "layout",
      [](const EnvironmentPicture& picture) {
        return std::string(environment::EnvironmentLayoutName(picture.layout));
      },
      "How directions lie on the picture.");
  type.def(
      "radiance",
      [](const EnvironmentPicture& picture, const py::object& directions) {
        Rows rows({{"directions", directions}}, {3});
        rows.Normalise(0);
        const core::Image& image = picture.image;
        const environment::TexelEdges edges = environment::MakeTexelEdges(
            picture.layout, picture.registration, image.width, image.height);
        Array result = rows.Result({image.channels});
        double* out = result.mutable_data();
        ForEach(rows.count(), 1024, [&](std::size_t i) {
          const auto pixel = PixelOf(picture, edges, rows.vec3(0, i));
          for (int c = 0; c < image.channels; ++c)
            out[i * image.channels + c] = pixel ? image.at(c, pixel->first, pixel->second) : 0.0;
        });
        return result;
      },
      py::arg("directions"),
      "Radiance of the pixel that shows each of directions[..., 3]: [..., channel]; 0 where the "
      "picture shows nothing.");
  type.def("__repr__", [](const EnvironmentPicture& picture) {
    return "<luxfield.Environment: " + std::to_string(picture.image.width) + " x " +
           std::to_string(picture.image.height) + ", " +
           std::string(environment::EnvironmentLayoutName(picture.layout)) + ">";
  });
}

}  // namespace luxfield::python
