#include "luxfield/bridges/lamp_atlas.h"

#include <fmt/format.h>

#include "luxfield/bridges/belongs_to.h"
#include "luxfield/bridges/lit_texels.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/printable.h"
#include "luxfield/version.h"

namespace luxfield::bridges {
namespace {

using lightfield::LightField;
using lightfield::PosedLightField;
using lightfield::RigidPose;
using lightfield::Vec3;

constexpr char kFormat[] = "luxfield lamp atlas";

// One channel of the field as the picture has it.
std::vector<float> Plane(const LightField& field, const LitTexels& lit, int channel) {
  const auto& g = field.geometry;
  const std::size_t width = static_cast<std::size_t>(lit.columns()) * g.grid.width;
  std::vector<float> plane(width * lit.rows() * g.grid.height);
  for (int j = 0; j < g.grid.height; ++j)
    for (int i = 0; i < g.grid.width; ++i) {
      const auto image = field.image(g.grid.index(i, j), channel);
      for (int row = 0; row < lit.rows(); ++row)
        for (int column = 0; column < lit.columns(); ++column)
          plane[(static_cast<std::size_t>(row) * g.grid.height + j) * width +
                static_cast<std::size_t>(column) * g.grid.width + i] =
              image[static_cast<std::size_t>(lit.first_row + row) * g.lattice.width +
                    lit.first_column + column];
    }
  return plane;
}

void WritePicture(const std::filesystem::path& path, const std::filesystem::path& json,
                  const LightField& field, const LitTexels& lit, const std::string& source) {
  constexpr int kLargest = 1 << 15;
  const auto& g = field.geometry;
  const long width = static_cast<long>(lit.columns()) * g.grid.width,
             height = static_cast<long>(lit.rows()) * g.grid.height;
  if (width > kLargest || height > kLargest)
    throw InputError(
        source,
        fmt::format("is a picture of {} x {} pixels, and textures have at most {} along "
                    "a side",
                    width, height, kLargest),
        "reconstruct it with larger texels");
  std::vector<std::vector<float>> planes;
  for (int channel = 0; channel < g.channels; ++channel)
    planes.push_back(Plane(field, lit, channel));
  core::ExrPartView part{"",
                         static_cast<int>(width),
                         static_cast<int>(height),
                         {},
                         {{kBelongsTo, json.filename().string()}}};
  constexpr const char* kNames[] = {"R", "G", "B"};
  for (int channel = 0; channel < 3; ++channel)
    part.channels.push_back(
        {kNames[channel],
         std::span<const float>(planes[static_cast<std::size_t>(g.channels == 3 ? channel : 0)])});
  core::RequireOwn(path, json, kBelongsTo);
  core::WriteExr(path, std::span(&part, 1));
}

core::Json FieldJson(const PosedLightField& posed, const LitTexels& lit,
                     const std::string& picture) {
  const auto& g = posed.field.geometry;
  const RigidPose& pose = posed.luminaire_from_field;
  const double t[] = {pose.translation_m.x, pose.translation_m.y, pose.translation_m.z};
  core::Json rows = core::Json::array();
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column)
      rows.push_back(pose.rotation[3 * row + column]);
    rows.push_back(t[row]);
  }
  core::Json cells = core::Json::array();
  for (int cell = 0; cell < g.grid.basis.cells; ++cell) cells.push_back(g.grid.basis.c[cell]);
  return {{"atlas", picture},
          {"luminaire_from_field", rows},
          {"delta_m", g.delta_m},
          {"channels", g.channels},
          {"basis", {{"name", g.grid.basis.name()}, {"cells", cells}}},
          {"grid",
           {{"width", g.grid.width},
            {"height", g.grid.height},
            {"u0_m", g.grid.u0_m},
            {"v0_m", g.grid.v0_m},
            {"spacing_m", g.grid.spacing_m}}},
          {"images",
           {{"columns", lit.columns()},
            {"rows", lit.rows()},
            {"s0_m", g.lattice.s_of_column(lit.first_column)},
            {"t1_m", g.lattice.t_of_row(lit.first_row)},
            {"ds_m", g.lattice.ds_m},
            {"dt_m", g.lattice.dt_m}}}};
}

// The rectangle of a field's filter plane, as Mitsuba places its own from -1 to 1.
std::string MitsubaShape(const PosedLightField& posed, std::size_t number,
                         const std::string& json) {
  const auto& grid = posed.field.geometry.grid;
  const auto& pose = posed.luminaire_from_field;
  const double half_u = 0.5 * (grid.width + grid.basis.cells - 1) * grid.spacing_m,
               half_v = 0.5 * (grid.height + grid.basis.cells - 1) * grid.spacing_m;
  const Vec3 along_u = pose.Direction({half_u, 0, 0}), along_v = pose.Direction({0, half_v, 0}),
             normal = pose.Direction({0, 0, 1}),
             middle = pose.Point({grid.u0_m + half_u, grid.v0_m + half_v, 0});
  return fmt::format(
      "  <shape type=\"rectangle\">\n"
      "    <transform name=\"to_world\">\n"
      "      <matrix value=\"{} {} {} {}  {} {} {} {}  {} {} {} {}  0 0 0 1\"/>\n"
      "    </transform>\n"
      "    <emitter type=\"luxfield\">\n"
      "      <string name=\"filename\" value=\"{}\"/>\n"
      "      <integer name=\"field\" value=\"{}\"/>\n"
      "    </emitter>\n"
      "  </shape>\n",
      along_u.x, along_v.x, normal.x, middle.x, along_u.y, along_v.y, normal.y, middle.y, along_u.z,
      along_v.z, normal.z, middle.z, json, number);
}

}  // namespace

std::vector<std::filesystem::path> WriteLampAtlas(const std::filesystem::path& json,
                                                  std::span<const PosedLightField> fields,
                                                  const std::string& source) {
  const std::string name = json.filename().string();
  std::vector<std::filesystem::path> files = {json};
  core::Json page{{"format", kFormat},
                  {"version", 1},
                  {"made_by", "luxfield " LUXFIELD_VERSION},
                  {"unit", lightfield::FluxUnitName(fields.front().field.geometry.unit)},
                  {"fields", core::Json::array()}};
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const LitTexels lit = SurveyOf(fields[k].field).lit;
    if (lit.rows() == 0)
      throw InputError(source, fmt::format("holds no light in field {}", k),
                       "choose another light field");
    const std::string picture =
        fields.size() == 1 ? name + ".exr" : fmt::format("{}.{}.exr", name, k);
    files.push_back(json.parent_path() / picture);
    WritePicture(files.back(), json, fields[k].field, lit, source);
    page["fields"].push_back(FieldJson(fields[k], lit, picture));
  }
  core::WriteFileAtomically(json, page.dump(1) + "\n");
  return files;
}

std::vector<std::filesystem::path> WriteMitsubaLamp(const std::filesystem::path& xml,
                                                    std::span<const PosedLightField> fields,
                                                    const std::string& source) {
  const std::filesystem::path json = xml.string() + ".json";
  core::RequireOwn(json, xml, kFormat);
  std::vector<std::filesystem::path> files = WriteLampAtlas(json, fields, source);
  std::string scene = "<!-- luxfield " LUXFIELD_VERSION
                      ": needs `import luxfield_mitsuba` before it is loaded -->\n"
                      "<scene version=\"3.0.0\">\n";
  for (std::size_t k = 0; k < fields.size(); ++k)
    scene += MitsubaShape(fields[k], k, core::EscapedMarkup(json.filename().string()));
  core::WriteFileAtomically(xml, scene + "</scene>\n");
  files.insert(files.begin(), xml);
  return files;
}

}  // namespace luxfield::bridges
