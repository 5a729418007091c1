// *.lf.exr, to the byte in docs/formats/light-field.md.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/exr_geometry.h"
#include "luxfield/lightfield/file_pieces.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/light_field_file.h"
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

// Parts of a field whose pixels are left out.
std::vector<core::ExrPartView> PartsOf(const LuminaireGeometry& geometry,
                                       const Provenance& provenance) {
  std::vector<core::ExrPartView> parts;
  for (int j = 0; j < geometry.grid.height; ++j)
    for (int i = 0; i < geometry.grid.width; ++i) {
      auto& part = parts.emplace_back(core::ExrPartView{PartName(kLightFieldKind, i, j),
                                                        geometry.lattice.width,
                                                        geometry.lattice.height,
                                                        {},
                                                        {}});
      for (const std::string& name : ChannelNames(geometry.channels))
        part.channels.push_back({name, std::span<const float>()});
    }
  parts.front().attributes = GeometryAttributes(kLightFieldKind, geometry, provenance);
  return parts;
}

// Not a number: RequireWritable lets none of them pass.
constexpr float kLater = std::numeric_limits<float>::quiet_NaN();

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

// Part 0.C.00.00, or -1 if the file does not hold several fields.
int FirstOfSeveral(const core::ExrReader& reader) {
  const std::string prefix = FieldPrefix(0);
  return reader.find_part(PartName(FieldKind(prefix), 0, 0));
}

// `unit` and `name` of any of the fields.
template <typename Fields, typename Unit>
void RequireOneLuminaire(const std::string& file, const Fields& fields, const Unit& unit) {
  std::set<std::string> names;
  for (const auto& field : fields) {
    if (unit(field) != unit(fields.front()))
      throw InputError(file,
                       fmt::format("its light fields are in {} and in {}",
                                   FluxUnitName(unit(fields.front())), FluxUnitName(unit(field))),
                       "make one luminaire of fields of one unit");
    if (!names.insert(field.name).second)
      throw InputError(file, fmt::format("two of its light fields are named '{}'", field.name),
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

LightFieldBands::LightFieldBands(const std::filesystem::path& path, const LuminaireGeometry& whole,
                                 const Provenance& provenance)
    : path_(path), channels_(whole.channels), spool_(path, PartsOf(whole, provenance)) {
  whole.Validate(path.string());
}

void LightFieldBands::Add(LightField rows, const std::vector<bool>& later) {
  RequireWritable(path_, rows);
  const std::size_t chunk =
      static_cast<std::size_t>(rows.geometry.lattice.width) * core::ExrRowSpool::kRows;
  std::vector<bool> marked;
  for (std::size_t p = 0; p < later.size(); ++p) {
    if (p % chunk == 0) marked.push_back(false);
    if (!later[p]) continue;
    marked.back() = true;
    for (std::size_t k = p; k < rows.data.size(); k += later.size()) rows.data[k] = kLater;
  }
  spool_.Add(
      rows.geometry.lattice.height,
      [&](int m) {
        std::vector<core::ExrPixels> pixels;
        for (int channel = 0; channel < rows.geometry.channels; ++channel)
          pixels.emplace_back(std::as_const(rows).image(m, channel));
        return pixels;
      },
      marked);
}

void LightFieldBands::Write(const std::function<float(int channel)>& value) {
  const auto names = ChannelNames(channels_);
  spool_.Write([&](int, const std::string& name, std::span<float> row) {
    const auto channel = std::find(names.begin(), names.end(), name) - names.begin();
    for (float& c : row)
      if (std::isnan(c)) c = value(static_cast<int>(channel));
  });
}

void WriteLightFields(const std::filesystem::path& path, std::span<const PosedLightField> fields) {
  const std::string file = path.string();
  if (fields.empty() || fields.size() > kMaxFields)
    throw InputError(file,
                     fmt::format("{} light fields are not 1 to {}", fields.size(), kMaxFields),
                     "write at least one");
  if (fields.size() == 1 && fields[0].luminaire_from_field == RigidPose{})
    return WriteLightField(path, fields[0].field);
  RequireOneLuminaire(file, fields,
                      [](const PosedLightField& posed) { return posed.field.geometry.unit; });
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

struct LightFieldFile::Impl {
  core::ExrReader reader;
  std::vector<Field> fields;
  std::vector<std::vector<int>> parts{};  // of each field, in the order of m

  void Add(const ExrKind& kind) {
    ExrGeometry header = ReadGeometry(reader, kind);
    fields.push_back({"", {}, header.geometry, std::move(header.provenance)});
    parts.push_back(std::move(header.parts));
  }

  void AddSeveral(int first) {
    const std::string file = reader.path().string();
    const int count = reader.GetInt(first, kFieldsAttribute);
    if (count < 1 || count > kMaxFields)
      throw InputError(file,
                       fmt::format("{} = {} is not 1 to {}", kFieldsAttribute, count, kMaxFields),
                       "make the file anew with the verb that wrote it");
    std::size_t all = 0;
    for (int k = 0; k < count; ++k) {
      const std::string prefix = FieldPrefix(k);
      Add(FieldKind(prefix));  // first, for it says what is missing
      const int part = parts.back().front();
      fields.back().name = reader.GetString(part, kFieldNameAttribute);
      fields.back().luminaire_from_field = ReadPose(reader, part);
      all += parts.back().size();
    }
    if (all != reader.parts().size())
      throw InputError(file,
                       fmt::format("has {} parts where its {} light fields have {}",
                                   reader.parts().size(), count, all),
                       "make the file anew with the verb that wrote it");
    RequireOneLuminaire(file, fields, [](const Field& field) { return field.geometry.unit; });
  }
};

LightFieldFile::LightFieldFile(const std::filesystem::path& path)
    : impl_(new Impl{core::ExrReader(path), {}}) {
  const int first = FirstOfSeveral(impl_->reader);
  if (first < 0)
    impl_->Add(kLightFieldKind);
  else
    impl_->AddSeveral(first);
}

LightFieldFile::~LightFieldFile() = default;
LightFieldFile::LightFieldFile(LightFieldFile&&) noexcept = default;

const std::vector<LightFieldFile::Field>& LightFieldFile::fields() const { return impl_->fields; }

const LightFieldFile::Field& LightFieldFile::only() const {
  const Field& first = impl_->fields.front();
  if (impl_->fields.size() > 1 || !first.name.empty() ||
      !(first.luminaire_from_field == RigidPose{}))
    throw InputError(impl_->reader.path().string(),
                     "holds light fields in several directions where one is asked for",
                     "light a scene with it (`render`), or make a file of one field: "
                     "`luxfield import --faces one`");
  return first;
}

void LightFieldFile::ReadImage(std::size_t field, int m, std::span<float> planes) {
  const LuminaireGeometry& geometry = impl_->fields.at(field).geometry;
  const int part = impl_->parts[field].at(static_cast<std::size_t>(m));
  const auto names = ChannelNames(geometry.channels);
  const auto plane = [&](std::size_t channel) {
    return planes.subspan(channel * geometry.plane_size(), geometry.plane_size());
  };
  std::vector<core::ExrTarget> targets;
  for (std::size_t channel = 0; channel < names.size(); ++channel)
    targets.push_back({names[channel], plane(channel)});
  impl_->reader.Read(part, targets);
  for (std::size_t channel = 0; channel < names.size(); ++channel)
    RequireFinite(impl_->reader, impl_->reader.parts()[part].name, names[channel], plane(channel));
}

namespace {

LightField ReadField(LightFieldFile& file, std::size_t number) {
  const LightFieldFile::Field& from = file.fields()[number];
  LightField field(from.geometry);
  field.provenance = from.provenance;
  const std::size_t image = from.geometry.plane_size() * from.geometry.channels;
  for (int m = 0; m < from.geometry.grid.count(); ++m)
    file.ReadImage(number, m, std::span(field.data).subspan(m * image, image));
  return field;
}

}  // namespace

LightField ReadLightField(const std::filesystem::path& path) {
  LightFieldFile file(path);
  file.only();
  return ReadField(file, 0);
}

std::vector<PosedLightField> ReadLightFields(const std::filesystem::path& path) {
  LightFieldFile file(path);
  std::vector<PosedLightField> fields;
  for (std::size_t k = 0; k < file.fields().size(); ++k)
    fields.push_back(
        {file.fields()[k].name, file.fields()[k].luminaire_from_field, ReadField(file, k)});
  return fields;
}

}  // namespace luxfield::lightfield
