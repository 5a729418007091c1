#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.h"
#include "bindings.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/radiance_hdr.h"

namespace luxfield::python {
namespace {

namespace py = pybind11;

// Every channel of every part as an array: "Y", or "PART/Y" where there are several parts.
py::dict Layers(const std::filesystem::path& path) {
  core::ExrReader reader(path);
  py::dict layers;
  const bool named = reader.parts().size() > 1;
  for (std::size_t p = 0; p < reader.parts().size(); ++p) {
    const core::ExrReader::Part& part = reader.parts()[p];
    const std::vector<py::ssize_t> shape{part.height, part.width};
    for (std::size_t c = 0; c < part.channels.size(); ++c) {
      const std::string& channel = part.channels[c];
      const py::str name(named ? part.name + "/" + channel : channel);
      const int index = static_cast<int>(p);
      if (part.channel_is_uint[c])
        layers[name] = Take(reader.ReadUint(index, channel), shape);
      else
        layers[name] = Take(reader.ReadFloat(index, channel), shape);
    }
  }
  return layers;
}

py::dict Attributes(const std::filesystem::path& path) {
  const core::ExrReader reader(path);
  py::dict attributes;
  for (const auto& [name, value] : reader.parts().front().attributes)
    std::visit([&, key = py::str(name)](const auto& v) { attributes[key] = v; }, value);
  return attributes;
}

}  // namespace

void AddPicture(py::module_& module) {
  module.def("read_exr_layers", &Layers, py::arg("path"),
             "Every channel of an OpenEXR file, [row, column], float32 or uint32, by name.");
  module.def("read_exr_attributes", &Attributes, py::arg("path"),
             "The attributes of an OpenEXR file's first part.");
  module.def(
      "read_hdr",
      [](const std::filesystem::path& path) {
        core::Image image = core::ReadRadianceHdr(path);
        const std::vector<py::ssize_t> shape{image.channels, image.height, image.width};
        return Take(std::move(image.data), shape);
      },
      py::arg("path"), "A Radiance picture, [channel, row, column], linear Rec. 709.");
}

}  // namespace luxfield::python
