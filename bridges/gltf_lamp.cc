#include "luxfield/bridges/gltf_lamp.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/printable.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/version.h"
#include "luxfield/web/lamp_volume_json.h"

namespace luxfield::bridges {
namespace {

using lightfield::LightField;
using lightfield::Vec3;

constexpr const char* kExtension = "LUXFIELD_light_field";
constexpr std::uint32_t kMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;

// The file's one buffer: pieces that begin at multiples of four bytes.
class Buffer {
 public:
  // The number of its view.
  std::size_t Add(std::string_view piece) {
    views_.push_back({{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", piece.size()}});
    bytes_ += piece;
    bytes_.append((4 - bytes_.size() % 4) % 4, '\0');
    return views_.size() - 1;
  }
  const std::string& bytes() const { return bytes_; }
  const core::Json& views() const { return views_; }

 private:
  std::string bytes_;
  core::Json views_ = core::Json::array();
};

void Append(std::string& out, std::uint32_t number) {
  for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(number >> shift & 0xff);
}

std::string Glb(const core::Json& json, const std::string& binary) {
  std::string text = json.dump();
  text.append((4 - text.size() % 4) % 4, ' ');
  std::string file;
  Append(file, kMagic);
  Append(file, 2);
  Append(file, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
  Append(file, static_cast<std::uint32_t>(text.size()));
  Append(file, kJsonChunk);
  file += text;
  Append(file, static_cast<std::uint32_t>(binary.size()));
  Append(file, kBinaryChunk);
  return file + binary;
}

struct Spot {
  Vec3 direction;  // of the luminaire's frame
  double inner = 0, outer = 0, intensity_cd = 0;
};

// Of the far field, by the midpoint rule between its angles.
Spot SpotOf(const formats::Photometry& table, double flux) {
  struct Part {
    Vec3 direction;
    double flux;
  };
  std::vector<Part> parts;
  constexpr int kPlanes = 72, kAngles = 180;
  Vec3 mean;
  for (int a = 0; a < kAngles; ++a) {
    const double gamma_deg = (a + 0.5) * 180.0 / kAngles;
    const double solid_angle = std::sin(gamma_deg * std::numbers::pi / 180);
    for (int plane = 0; plane < kPlanes; ++plane) {
      const Vec3 direction =
          formats::Direction(formats::PhotometryType::kC, plane * 360.0 / kPlanes, gamma_deg);
      const double part = std::max(0.0, formats::Intensity(table, direction)) * solid_angle;
      parts.push_back({direction, part});
      mean = mean + part * direction;
    }
  }
  Spot spot;
  spot.direction = lightfield::Normalized(mean);
  std::sort(parts.begin(), parts.end(), [&](const Part& a, const Part& b) {
    return Dot(a.direction, spot.direction) > Dot(b.direction, spot.direction);
  });
  double total = 0, sum = 0;
  for (const Part& part : parts) total += part.flux;
  for (const Part& part : parts) {
    sum += part.flux;
    const double angle = std::acos(std::clamp(Dot(part.direction, spot.direction), -1.0, 1.0));
    if (sum <= 0.5 * total) spot.inner = angle;
    if (sum <= 0.95 * total) spot.outer = angle;
  }
  spot.outer = std::clamp(spot.outer, 0.01, std::numbers::pi / 2);  // glTF allows no more
  spot.inner = std::clamp(spot.inner, 0.0, 0.99 * spot.outer);
  const double inner = std::cos(spot.inner), outer = std::cos(spot.outer);
  spot.intensity_cd = flux / (2 * std::numbers::pi * (1 - inner + (inner - outer) / 3));
  return spot;
}

// Luminaire to node.
Vec3 OfNode(Vec3 d) { return {d.x, -d.y, -d.z}; }

// Quaternion (x, y, z, w) that turns -z to a unit vector.
std::array<double, 4> TurnFromMinusZ(Vec3 to) {
  const Vec3 from{0, 0, -1};
  const double w = 1 + Dot(from, to);
  if (w < 1e-9) return {1, 0, 0, 0};
  const Vec3 axis = lightfield::Cross(from, to);
  const double length = std::sqrt(Dot(axis, axis) + w * w);
  return {axis.x / length, axis.y / length, axis.z / length, w / length};
}

// Linear R G B of the light, the largest 1.
std::array<double, 3> ColourOf(const std::array<double, 3>& flux) {
  const double largest = std::max({flux[0], flux[1], flux[2]});
  std::array<double, 3> colour;
  for (int k = 0; k < 3; ++k) colour[k] = std::clamp(flux[k] / largest, 0.0, 1.0);
  return colour;
}

core::Json LightFieldJson(const web::FittedVolume& fitted, Buffer& buffer) {
  core::Json light = web::VolumeJson(fitted);
  for (std::size_t k = 0; k < fitted.packed.size(); ++k) {
    const auto& packed = fitted.packed[k];
    light["tables"][k]["bufferView"] =
        buffer.Add({reinterpret_cast<const char*>(packed.data()), packed.size()});
  }
  return light;
}

}  // namespace

GltfLamp WriteGltfLamp(const std::filesystem::path& path, const LightField& field,
                       const std::string& source, const web::FitOptions& options) {
  if (field.geometry.unit != lightfield::FluxUnit::kLumen)
    throw InputError(source,
                     fmt::format("is in {}, and lights of glTF are in lm and cd",
                                 lightfield::FluxUnitName(field.geometry.unit)),
                     "choose another format, as .json for Blender");
  GltfLamp written;
  written.fitted = web::FitLampVolume(field, options, source);
  const auto flux = lightfield::TotalFlux(field);
  const std::vector<lightfield::PosedLightField> lamp = {{"", {}, field}};
  const formats::Photometry far_field =
      formats::SampleFarField(formats::LuminanceOf(lamp), {}, {}, source).table;
  const Spot spot = SpotOf(far_field, core::Luminance(flux));
  const auto colour = ColourOf(flux);
  const std::string name = core::OnOneLine(path.stem().string());

  Buffer buffer;
  const core::Json light_field = LightFieldJson(written.fitted, buffer);
  const std::size_t ies =
      buffer.Add(formats::FormatLm63(far_field, formats::Lm63Version::k2002, source));
  const core::Json punctual{
      {"type", "spot"},
      {"name", name},
      {"color", colour},
      // glTF's light has I times colour in each channel.
      {"intensity", spot.intensity_cd / core::Luminance(colour)},
      {"spot", {{"innerConeAngle", spot.inner}, {"outerConeAngle", spot.outer}}}};
  const core::Json profile{
      {"name", name}, {"bufferView", ies}, {"mimeType", "application/x-ies-lm-63"}};
  core::Json json;
  json["asset"] = {{"version", "2.0"}, {"generator", "luxfield " LUXFIELD_VERSION}};
  json["extensionsUsed"] = {"EXT_lights_ies", "KHR_lights_punctual", kExtension};
  json["extensions"]["EXT_lights_ies"]["lights"] = core::Json::array({profile});
  json["extensions"]["KHR_lights_punctual"]["lights"] = core::Json::array({punctual});
  json["extensions"][kExtension]["lights"] = core::Json::array({light_field});
  json["buffers"] = core::Json::array({{{"byteLength", buffer.bytes().size()}}});
  json["bufferViews"] = buffer.views();
  core::Json lamp_node{{"name", name}, {"children", {1}}};
  lamp_node["extensions"]["EXT_lights_ies"] = {
      {"light", 0}, {"multiplier", 1 / core::Luminance(colour)}, {"color", colour}};
  lamp_node["extensions"][kExtension] = {{"light", 0}};
  core::Json spot_node{{"name", name + " as a spot light"},
                       {"rotation", TurnFromMinusZ(OfNode(spot.direction))}};
  spot_node["extensions"]["KHR_lights_punctual"] = {{"light", 0}};
  json["nodes"] = {lamp_node, spot_node};
  json["scenes"] = core::Json::array({{{"nodes", {0}}}});
  json["scene"] = 0;
  const std::string file = Glb(json, buffer.bytes());
  written.bytes = file.size();
  core::WriteFileAtomically(path, file);
  return written;
}

web::FittedVolume ReadGltfLamp(const std::filesystem::path& path) {
  const std::string file = path.string(), bytes = core::ReadFile(core::ReadableAt(path));
  const auto fail = [&](const char* problem) -> void {
    throw InputError(file, problem, "export it again with 'luxfield export'");
  };
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    if (at + 4 > bytes.size()) fail("is cut short");
    for (std::size_t k = 0; k < 4; ++k)
      value |= std::uint32_t(static_cast<unsigned char>(bytes[at + k])) << 8 * k;
    return std::size_t{value};
  };
  if (number(0) != kMagic || number(16) != kJsonChunk) fail("is no binary glTF file");
  const std::size_t json_bytes = number(12), binary = 20 + json_bytes + 8;
  if (number(8) != bytes.size() || binary > bytes.size()) fail("is cut short");
  const core::Json json = core::ParseJson(std::string_view(bytes).substr(20, json_bytes), file);
  const auto codes = [&](const core::Json& table) {
    const core::Json& view = json.at("bufferViews").at(table.at("bufferView").get<std::size_t>());
    const std::size_t offset = view.at("byteOffset"), length = view.at("byteLength");
    if (offset > bytes.size() - binary || length > bytes.size() - binary - offset)
      fail("is cut short");
    const std::string_view piece = std::string_view(bytes).substr(binary + offset, length);
    return std::vector<std::uint8_t>(piece.begin(), piece.end());
  };
  try {
    return web::VolumeFromJson(json.at("extensions").at(kExtension).at("lights").at(0), codes,
                               file);
  } catch (const core::Json::exception&) {
    fail("holds no light field");
  }
  throw std::logic_error("unreachable");
}

}  // namespace luxfield::bridges
