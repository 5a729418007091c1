// *.lf.exr, to the byte in docs/formats/light-field.md.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/exr_geometry.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::lightfield {
namespace {

constexpr const char* kSeveralName = "light-fields";
constexpr int kMaxFields = 100;
constexpr const char* kFieldsAttribute = "luxfield:fields";
constexpr const char* kFieldNameAttribute = "luxfield:field_name";

// Parts of field k of several are k.C.JJ.II.
std::string FieldPrefix(int field) {
  return fmt::format("{}.{}", field, kLightFieldKind.part_prefix);
}

ExrKind FieldKind(const std::string& prefix) {
  return {kSeveralName, prefix.c_str(), kLightFieldKind.channel_prefix, false};
}

// [rotation | translation], row and column from 0.
std::string PoseAttribute(int row, int column) {
  return fmt::format("luxfield:luminaire_from_field.{}{}", row, column);
}

core::ExrAttributes PoseAttributes(const RigidPose& pose) {
  core::ExrAttributes attributes;
  const double t[3] = {pose.translation_m.x, pose.translation_m.y, pose.translation_m.z};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      attributes[PoseAttribute(row, column)] = pose.rotation[3 * row + column];
    attributes[PoseAttribute(row, 3)] = t[row];
  }
  return attributes;
}

RigidPose ReadPose(const core::ExrReader& reader, int part) {
  RigidPose pose;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      pose.rotation[3 * row + column] = reader.GetDouble(part, PoseAttribute(row, column));
  pose.translation_m = {reader.GetDouble(part, PoseAttribute(0, 3)),
                        reader.GetDouble(part, PoseAttribute(1, 3)),
                        reader.GetDouble(part, PoseAttribute(2, 3))};
  pose.Validate(reader.path().string());
  return pose;
}

void RequireWritable(const std::filesystem::path& path, const LightField& field) {
  field.geometry.Validate(path.string());
  if (const auto bad = std::find_if_not(field.data.begin(), field.data.end(),
                                        [](float c) { return std::isfinite(c); });
      bad != field.data.end())
    throw InputError(path.string(), fmt::format("would hold C = {}", *bad),
                     "look for absurd numbers in what it is made from");
}

// Appends the parts of one field; the first has the attributes, and states the geometry `stated`.
void AddParts(const ExrKind& kind, const LightField& field, const LuminaireGeometry& stated,
              core::ExrAttributes attributes, std::vector<core::ExrPartView>& parts) {
  const LuminaireGeometry& geometry = field.geometry;
  const auto names = ChannelNames(geometry.channels);
  for (int j = 0; j < geometry.grid.height; ++j)
    for (int i = 0; i < geometry.grid.width; ++i) {
      const int m = geometry.grid.index(i, j);
      core::ExrPartView part{
          PartName(kind, i, j), geometry.lattice.width, geometry.lattice.height, {}, {}};
      for (int channel = 0; channel < geometry.channels; ++channel)
        part.channels.push_back({names[channel], field.image(m, channel)});
      if (m == 0) {
        part.attributes = GeometryAttributes(kind, stated, field.provenance);
        part.attributes.merge(attributes);
      }
      parts.push_back(std::move(part));
    }
}

LightField ReadField(core::ExrReader& reader, const ExrKind& kind) {
  ExrGeometry header = ReadGeometry(reader, kind);
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

// Part 0.C.00.00, or -1 if the file does not hold several fields.
int FirstOfSeveral(const core::ExrReader& reader) {
  const std::string prefix = FieldPrefix(0);
  return reader.find_part(PartName(FieldKind(prefix), 0, 0));
}

void RequireOneLuminaire(const std::string& file, std::span<const PosedLightField> fields) {
  std::set<std::string> names;
  for (const PosedLightField& posed : fields) {
    if (posed.field.geometry.unit != fields.front().field.geometry.unit)
      throw InputError(file,
                       fmt::format("its light fields are in {} and in {}",
                                   FluxUnitName(fields.front().field.geometry.unit),
                                   FluxUnitName(posed.field.geometry.unit)),
                       "make one luminaire of fields of one unit");
    if (!names.insert(posed.name).second)
      throw InputError(file, fmt::format("two of its light fields are named '{}'", posed.name),
                       "give each field a name of its own");
  }
}

}  // namespace

void WriteLightField(const std::filesystem::path& path, const LightField& field) {
  RequireWritable(path, field);
  std::vector<core::ExrPartView> parts;
  AddParts(kLightFieldKind, field, field.geometry, {}, parts);
  core::WriteExr(path, parts, core::ExrCompression::kZip);
}

void WriteLightFieldRows(const std::filesystem::path& path, const LuminaireGeometry& whole,
                         const LightField& rows) {
  RequireWritable(path, rows);
  whole.Validate(path.string());
  std::vector<core::ExrPartView> parts;
  AddParts(kLightFieldKind, rows, whole, {}, parts);
  core::WriteExr(path, parts, core::ExrCompression::kZip);
}

LightField ReadLightField(const std::filesystem::path& path) {
  core::ExrReader reader(path);
  if (FirstOfSeveral(reader) >= 0)
    throw InputError(path.string(),
                     "holds light fields in several directions where one is asked for",
                     "light a scene with it (`render`), or make a file of one field: "
                     "`luxfield import --faces one`");
  return ReadField(reader, kLightFieldKind);
}

void WriteLightFields(const std::filesystem::path& path, std::span<const PosedLightField> fields) {
  const std::string file = path.string();
  if (fields.empty() || fields.size() > kMaxFields)
    throw InputError(file,
                     fmt::format("{} light fields are not 1 to {}", fields.size(), kMaxFields),
                     "write at least one");
  if (fields.size() == 1 && fields[0].luminaire_from_field == RigidPose{})
    return WriteLightField(path, fields[0].field);
  RequireOneLuminaire(file, fields);
  std::vector<core::ExrPartView> parts;
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const PosedLightField& posed = fields[k];
    RequireWritable(path, posed.field);
    posed.luminaire_from_field.Validate(file);
    auto attributes = PoseAttributes(posed.luminaire_from_field);
    attributes[kFieldNameAttribute] = posed.name;
    if (k == 0) attributes[kFieldsAttribute] = static_cast<int>(fields.size());
    const std::string prefix = FieldPrefix(static_cast<int>(k));
    AddParts(FieldKind(prefix), posed.field, posed.field.geometry, std::move(attributes), parts);
  }
  core::WriteExr(path, parts, core::ExrCompression::kZip);
}

std::vector<PosedLightField> ReadLightFields(const std::filesystem::path& path) {
  core::ExrReader reader(path);
  std::vector<PosedLightField> fields;
  const int first = FirstOfSeveral(reader);
  if (first < 0) {
    fields.push_back({"", {}, ReadField(reader, kLightFieldKind)});
    return fields;
  }
  const std::string file = path.string();
  const int count = reader.GetInt(first, kFieldsAttribute);
  if (count < 1 || count > kMaxFields)
    throw InputError(file,
                     fmt::format("{} = {} is not 1 to {}", kFieldsAttribute, count, kMaxFields),
                     "make the file anew with the verb that wrote it");
  std::size_t parts = 0;
  for (int k = 0; k < count; ++k) {
    const std::string prefix = FieldPrefix(k);
    const ExrKind kind = FieldKind(prefix);
    PosedLightField posed;
    posed.field = ReadField(reader, kind);  // first, for it says what is missing
    const int part = reader.find_part(PartName(kind, 0, 0));
    posed.name = reader.GetString(part, kFieldNameAttribute);
    posed.luminaire_from_field = ReadPose(reader, part);
    parts += static_cast<std::size_t>(posed.field.geometry.grid.count());
    fields.push_back(std::move(posed));
  }
  if (parts != reader.parts().size())
    throw InputError(file,
                     fmt::format("has {} parts where its {} light fields have {}",
                                 reader.parts().size(), count, parts),
                     "make the file anew with the verb that wrote it");
  RequireOneLuminaire(file, fields);
  return fields;
}

}  // namespace luxfield::lightfield
