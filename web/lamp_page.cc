#include "luxfield/web/lamp_page.h"

#include <fmt/format.h>

#include <array>
#include <stdexcept>
#include <string_view>

#include "luxfield/core/colour.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/printable.h"
#include "luxfield/version.h"
#include "luxfield/web/lamp_volume_json.h"

namespace luxfield::web {

std::string_view EmbeddedSource(std::string_view path);  // generated

namespace {

std::string Escaped(const std::string& text) { return core::EscapedMarkup(core::Visible(text)); }

// In the order in which they use each other.
constexpr std::array<std::string_view, 7> kScripts = {
    "lib/volume.js",         "lib/light_shader.js", "page/mesh.js", "page/room.js",
    "page/mesh_renderer.js", "page/renderer.js",    "page/page.js"};

std::string_view Part(std::string_view path) {
  const std::string_view text = EmbeddedSource(path);
  if (text.empty()) throw std::logic_error(fmt::format("{} is not embedded", path));
  return text;
}

std::string Base64(const std::vector<std::uint8_t>& bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - k);
    const unsigned group = unsigned(bytes[k]) << 16 | (left > 1 ? unsigned(bytes[k + 1]) << 8 : 0) |
                           (left > 2 ? unsigned(bytes[k + 2]) : 0);
    for (std::size_t digit = 0; digit < 4; ++digit)
      text += digit <= left ? kDigits[group >> (18 - 6 * digit) & 63] : '=';
  }
  return text;
}

std::string Metres(double m) {
  return m < 1 ? fmt::format("{:.3g} cm", 100 * m) : fmt::format("{:.3g} m", m);
}

std::string ZoneRows(const FittedVolume& fitted) {
  std::string rows;
  for (const ErrorZone& zone : fitted.zones)
    rows +=
        fmt::format("<tr><td>{} to {}{}</td><td>{}</td><td>{}</td></tr>\n", Metres(zone.z_first_m),
                    Metres(zone.z_last_m), zone.on_image_plane ? ", about the image plane" : "",
                    PercentText(zone.stated_error), PercentText(zone.rel_rmse));
  return rows;
}

std::string ErrorText(const FittedVolume& fitted) {
  return fmt::format(
      "Readings were compared with the exact illuminance of the light field at {} receivers in "
      "each "
      "range of heights. The largest deviation that was found, times {:g}, is stated as the error "
      "of "
      "a reading, in shares of the reading or of {:.0f} % of the brightest at that height, "
      "whichever "
      "is more.",
      fitted.zones.front().receivers, kStatedMargin, 100 * kFloorShare);
}

std::string Facts(const lightfield::LightField& field, const FittedVolume& fitted) {
  const double flux = core::Luminance(lightfield::TotalFlux(field));
  std::string unit = lightfield::FluxUnitName(field.geometry.unit);
  if (field.geometry.unit == lightfield::FluxUnit::kRelative) unit = "(relative)";
  return Escaped(fmt::format("{:.4g} {} \u00b7 stated error {} from {} on, {} near the lamp", flux,
                             unit, PercentText(fitted.zones.back().stated_error),
                             Metres(fitted.zones.back().z_first_m),
                             PercentText(fitted.stated_error())));
}

std::string MadeBy(const PageFacts& facts) {
  std::string text = fmt::format("Made by luxfield {} of {}", LUXFIELD_VERSION, facts.file_name);
  if (!facts.sha256.empty()) text += fmt::format(", SHA-256 {}", facts.sha256);
  return Escaped(text + ". The page holds all it needs and asks nothing of any network.");
}

// GLSL as JavaScript's template literals, which it holds no special character of.
std::string Shaders() {
  std::string text = "const SHADERS = {\n";
  for (const std::string_view name :
       {"corners", "room", "body", "probe", "mesh_depth", "mesh_shadow"})
    text += fmt::format("{}: `{}`,\n", name, Part(fmt::format("page/{}.glsl", name)));
  return text + "};\n";
}

// A module of the library as a part of one script, in which there is nobody to export to.
std::string WithoutExports(std::string_view module) {
  constexpr std::string_view kExport = "\nexport ";
  std::string text;
  for (auto at = module.find(kExport); at != module.npos; at = module.find(kExport)) {
    text += module.substr(0, at + 1);
    module.remove_prefix(at + kExport.size());
  }
  return text += module;
}

std::string Script() {
  std::string script = Shaders();
  for (const std::string_view path : kScripts) script += WithoutExports(Part(path));
  return script;
}

// Fills in what stands between two @ in the template: each once, in order of the text.
std::string Filled(std::string_view text,
                   const std::map<std::string, std::string, std::less<>>& values) {
  std::string out;
  while (!text.empty()) {
    const auto begin = text.find('@');
    const auto end = begin == text.npos ? text.npos : text.find('@', begin + 1);
    if (end == text.npos) break;
    const auto value = values.find(text.substr(begin + 1, end - begin - 1));
    if (value == values.end()) {  // an @ that is none of ours
      out += text.substr(0, end);
      text.remove_prefix(end);
      continue;
    }
    out += text.substr(0, begin);
    out += value->second;
    text.remove_prefix(end + 1);
  }
  return out += text;
}

}  // namespace

std::string PercentText(double share) {
  return share < 0.1 ? fmt::format("{:.2g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

std::string PageJson(const FittedVolume& fitted) {
  core::Json json = VolumeJson(fitted);
  for (std::size_t k = 0; k < fitted.packed.size(); ++k)
    json["tables"][k]["codes"] = Base64(fitted.packed[k]);
  return json.dump();
}

std::string LampPage(const lightfield::LightField& field, const FittedVolume& fitted,
                     const PageFacts& facts) {
  return Filled(Part("page/page.html"), {{"GENERATOR", "luxfield " LUXFIELD_VERSION},
                                         {"TITLE", Escaped(facts.title)},
                                         {"FACTS", Facts(field, fitted)},
                                         {"ERROR", Escaped(ErrorText(fitted))},
                                         {"ZONES", ZoneRows(fitted)},
                                         {"MADE_BY", MadeBy(facts)},
                                         {"STYLE", std::string(Part("page/page.css"))},
                                         {"LAMP", PageJson(fitted)},
                                         {"SCRIPT", Script()}});
}

PageResult WriteLampPage(const std::filesystem::path& path, const lightfield::LightField& field,
                         const PageFacts& facts, const FitOptions& options) {
  PageResult result;
  result.fitted = FitLampVolume(field, options, facts.file_name);
  const std::string page = LampPage(field, result.fitted, facts);
  result.bytes = page.size();
  core::WriteFileAtomically(path, page);
  return result;
}

}  // namespace luxfield::web
