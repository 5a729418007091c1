// *.lf.exr, to the byte in docs/formats/light-field.md.
#include <vector>

#include "lightfield/exr_geometry.h"
#include "lightfield/light_field.h"

namespace luxfield::lightfield {

void WriteLightField(const std::filesystem::path& path, const LightField& field) {
  const LuminaireGeometry& geometry = field.geometry;
  geometry.Validate(path.string());
  const auto names = ChannelNames(geometry.channels);
  std::vector<core::ExrPartView> parts;
  for (int j = 0; j < geometry.grid.height; ++j)
    for (int i = 0; i < geometry.grid.width; ++i) {
      const int m = geometry.grid.index(i, j);
      core::ExrPartView part{
          PartName(kLightFieldKind, i, j), geometry.lattice.width, geometry.lattice.height, {}, {}};
      for (int channel = 0; channel < geometry.channels; ++channel)
        part.channels.push_back({names[channel], field.image(m, channel)});
      parts.push_back(std::move(part));
    }
  parts.front().attributes = GeometryAttributes(kLightFieldKind, geometry, field.provenance);
  core::WriteExr(path, parts, core::ExrCompression::kZip);
}

LightField ReadLightField(const std::filesystem::path& path) {
  core::ExrReader reader(path);
  ExrGeometry header = ReadGeometry(reader, kLightFieldKind);
  LightField field(header.geometry);
  field.provenance = std::move(header.provenance);
  const auto names = ChannelNames(field.geometry.channels);
  for (std::size_t m = 0; m < header.parts.size(); ++m) {
    std::vector<std::span<float>> planes;
    planes.reserve(names.size());
    for (int channel = 0; channel < field.geometry.channels; ++channel)
      planes.push_back(field.image(static_cast<int>(m), channel));
    reader.ReadFloats(header.parts[m], names, planes);
    for (int channel = 0; channel < field.geometry.channels; ++channel)
      RequireFinite(reader, reader.parts()[header.parts[m]].name, names[channel], planes[channel]);
  }
  return field;
}

}  // namespace luxfield::lightfield
