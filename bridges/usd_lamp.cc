#include "luxfield/bridges/usd_lamp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/version.h"
#include "luxfield/web/lamp_volume.h"

namespace luxfield::bridges {
namespace {

using formats::Photometry;
using lightfield::LightField;
using lightfield::Vec3;
using web::Rectangle;

// Of a profile, which tells by it that it belongs to a layer.
constexpr char kCatalogue[] = "luminance of the rectangle in the USD layer, cd/m^2";

// Luminance of the rectangle instead of the lamp's intensity.
Photometry LuminanceProfile(Photometry table, const Rectangle& face) {
  const double area = 4 * face.half.x * face.half.y;
  for (std::size_t plane = 0; plane < table.planes_deg.size(); ++plane)
    for (std::size_t angle = 0; angle < table.angles_deg.size(); ++angle) {
      const double cosine = std::cos(table.angles_deg[angle] * std::numbers::pi / 180);
      double& value = table.intensity_cd[plane * table.angles_deg.size() + angle];
      value = cosine > 1e-6 ? value / (area * cosine) : 0;
    }
  table.keywords.insert(table.keywords.begin(), {"LUMCAT", kCatalogue});
  return table;
}

// Of the rectangle at p, on a surface with normal n: midpoint rule.
double RectangleIlluminance(const Photometry& profile, const Rectangle& face, Vec3 p, Vec3 n) {
  constexpr int kParts = 24;
  double sum = 0;
  for (int b = 0; b < kParts; ++b)
    for (int a = 0; a < kParts; ++a) {
      const Vec3 u{face.middle.x + face.half.x * ((2 * a + 1.0) / kParts - 1),
                   face.middle.y + face.half.y * ((2 * b + 1.0) / kParts - 1), 0};
      const Vec3 to_p = p - u;
      const double r = Length(to_p);
      sum += Intensity(profile, to_p) * std::max(0.0, -Dot(to_p, n)) * to_p.z / (r * r * r * r);
    }
  return sum * 4 * face.half.x * face.half.y / (kParts * kParts);
}

// A name that USD allows: letters, digits and '_', no digit first.
std::string PrimName(const std::string& stem) {
  std::string name;
  for (const unsigned char c : stem) name += c < 128 && std::isalnum(c) ? char(c) : '_';
  return name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) ? "lamp_" + name : name;
}

std::string Layer(const std::string& stem, const std::string& profile, const LightField& field,
                  const Rectangle& face, const std::string& light_field) {
  const auto flux = lightfield::TotalFlux(field);
  const double luminance = core::Luminance(flux);
  return fmt::format(
      "#usda 1.0\n"
      "(\n"
      "    defaultPrim = \"{0}\"\n"
      "    doc = \"A measured lamp, by luxfield " LUXFIELD_VERSION
      "; it shines along +z of its prim.\"\n"
      "    metersPerUnit = 1\n"
      "    upAxis = \"Z\"\n"
      ")\n"
      "\n"
      "def Xform \"{0}\"\n"
      "{{\n"
      "    custom asset luxfield:lightField = @{1}@\n"
      "    custom double luxfield:fluxLm = {2:.9g}\n"
      "\n"
      "    def RectLight \"face\" (\n"
      "        prepend apiSchemas = [\"ShapingAPI\"]\n"
      "    )\n"
      "    {{\n"
      "        color3f inputs:color = ({3:.6g}, {4:.6g}, {5:.6g})\n"
      "        float inputs:intensity = 1\n"
      "        bool inputs:normalize = 0\n"
      "        float inputs:width = {6:.9g}\n"
      "        float inputs:height = {7:.9g}\n"
      "        asset inputs:shaping:ies:file = @./{8}@\n"
      "        bool inputs:shaping:ies:normalize = 0\n"
      "        float inputs:shaping:cone:angle = 90\n"
      "        float3 xformOp:rotateXYZ = (180, 0, 0)\n"
      "        double3 xformOp:translate = ({9:.9g}, {10:.9g}, 0)\n"
      "        uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:rotateXYZ\"]\n"
      "    }}\n"
      "}}\n",
      PrimName(stem), light_field, luminance, flux[0] / luminance, flux[1] / luminance,
      flux[2] / luminance, 2 * face.half.x, 2 * face.half.y, profile, face.middle.x, face.middle.y);
}

}  // namespace

UsdLamp WriteUsdLamp(const std::filesystem::path& path, const LightField& field,
                     const std::filesystem::path& source) {
  if (field.geometry.unit != lightfield::FluxUnit::kLumen)
    throw InputError(source.string(),
                     fmt::format("is in {}, and profiles of UsdLux are in cd",
                                 lightfield::FluxUnitName(field.geometry.unit)),
                     "choose another format, as .json for Blender");
  const Rectangle face = web::BoundsOfLight(field, source.string()).on_f;
  const std::vector<lightfield::PosedLightField> fields = {{"", {}, field}};
  const auto luminance = formats::LuminanceOf(fields);
  const Photometry far_field = formats::SampleFarField(luminance, {}, {}, source.string()).table;
  const Photometry profile = LuminanceProfile(far_field, face);
  const std::string stem = path.stem().string();
  UsdLamp written;
  written.files = {path, path.string() + ".ies"};
  core::RequireOwn(written.files[1], path, kCatalogue);
  written.deviations = DeviationsOf(
      luminance, [&](Vec3 p, Vec3 n) { return RectangleIlluminance(profile, face, p, n); });
  core::WriteFileAtomically(
      written.files[1],
      formats::FormatLm63(profile, formats::Lm63Version::k2002, written.files[1].string()));
  const auto folder = std::filesystem::absolute(path).parent_path();
  const auto named = std::filesystem::relative(source, folder).generic_string();
  core::WriteFileAtomically(path, Layer(stem, written.files[1].filename().string(), field, face,
                                        named.starts_with("../") ? named : "./" + named));
  return written;
}

}  // namespace luxfield::bridges
