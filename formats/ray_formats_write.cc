#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/formats/ray_formats.h"
#include "luxfield/formats/ray_formats_layout.h"

namespace luxfield::formats {
namespace {

template <typename T>
void Put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof(T));
}

double FluxOf(const RayFileHeader& header, bool luminous) {
  return (luminous ? header.luminous_flux_lm : header.radiant_flux_w).value_or(0);
}

std::string ZemaxHeader(const std::string& name, const RayFileHeader& header, bool luminous) {
  if (header.ray_count > std::numeric_limits<std::uint32_t>::max())
    throw InputError(name, fmt::format("{} rays are more than Zemax counts", header.ray_count),
                     "write fewer, or TM-25");
  std::string bytes(zemax::kHeaderBytes, '\0');
  Put(bytes, 0, zemax::kMagic);
  Put(bytes, zemax::kAtRays, static_cast<std::uint32_t>(header.ray_count));
  const std::string text = header.texts.empty() ? std::string() : header.texts.front();
  std::copy_n(text.begin(), std::min(text.size(), zemax::kDescriptionBytes - 1),
              bytes.begin() + zemax::kAtDescription);
  const auto flux = static_cast<float>(FluxOf(header, luminous));
  Put(bytes, zemax::kAtSourceFlux, flux);
  Put(bytes, zemax::kAtRayFlux, flux);
  Put(bytes, zemax::kAtUnits, zemax::kMillimetres);
  for (std::size_t k = 0; k < 3; ++k) Put(bytes, zemax::kAtScale + 4 * k, 1.0f);
  Put(bytes, zemax::kAtRayFormat, zemax::kFluxOnly);
  Put(bytes, zemax::kAtFluxType, std::int32_t{luminous});
  return bytes;
}

std::string LightToolsHeader(const RayFileHeader& header, bool luminous) {
  std::string bytes(lighttools::kHeaderBytes, '\0');
  bytes.replace(0, 4, lighttools::kMagic);
  Put(bytes, lighttools::kAtMajor, lighttools::kMajor);
  Put(bytes, lighttools::kAtDataType, std::uint32_t{luminous});
  Put(bytes, lighttools::kAtUnits, lighttools::kMillimetres);
  Put(bytes, lighttools::kAtFlux, static_cast<float>(FluxOf(header, luminous)));
  return bytes;
}

std::string SpeosHeader(const RayFileHeader& header, bool luminous) {
  const double flux = FluxOf(header, luminous);
  std::string bytes(speos::kHeaderBytes, '\0');
  Put(bytes, 0, static_cast<float>(luminous ? flux / speos::kLumensPerWatt : flux));
  for (std::size_t k = 1; k < 6; ++k) Put(bytes, 4 * k, speos::kFiller);
  Put(bytes, speos::kAtLumens, static_cast<float>(luminous ? flux : flux * speos::kLumensPerWatt));
  return bytes;
}

// Text: seven numbers a line, as LightTools writes it.
std::string LightToolsTextHeader(const RayFileHeader& header, bool luminous) {
  return fmt::format(
      "# Ray Data Export File\r\nlt_rdf_version: 2.0\r\ndataname: {}\r\nlt_datatype: {}\r\n"
      "lt_far_field_data: no\r\nlt_color_info: none\r\nlt_length_units: millimeters\r\n"
      "lt_data_origin: 0 0 0\r\nlt_radiant_flux: {:.9g}\r\nlt_startofdata\r\n",
      header.texts.empty() || header.texts.front().empty() ? "rays" : header.texts.front(),
      luminous ? "luminous_flux" : "radiant_power", FluxOf(header, luminous));
}

void RequireHeld(const std::string& name, const Ray& ray, std::uint64_t index) {
  const auto held = [](double value) {
    return std::abs(value) <= double{std::numeric_limits<float>::max()};
  };
  const lightfield::Vec3 mm = 1e3 * ray.position_m;
  if (!held(mm.x) || !held(mm.y) || !held(mm.z) || !held(ray.flux) || ray.flux < 0 ||
      !(std::abs(lightfield::Length(ray.direction) - 1) <= kUnitTolerance))
    throw InputError(name,
                     fmt::format("ray {} is none that the format holds (flux {})", index, ray.flux),
                     "leave it out");
}

// Appends a ray as the format has it; `mean_flux` is what Speos's energies are relative to.
void AddRay(std::string& bytes, RayFormat format, const Ray& ray, double mean_flux) {
  const lightfield::Vec3 mm = 1e3 * ray.position_m, d = ray.direction;
  if (format == RayFormat::kLightToolsText) {
    bytes += fmt::format("{:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g}\r\n", mm.x, mm.y, mm.z,
                         d.x, d.y, d.z, ray.flux);
    return;
  }
  const bool speos = format == RayFormat::kSpeos;
  const double last = speos ? speos::kWavelength_nm : ray.flux;
  float row[8] = {float(mm.x), float(mm.y),
                  float(mm.z), float(d.x),
                  float(d.y),  float(d.z),
                  float(last), float(speos && mean_flux > 0 ? ray.flux / mean_flux : 0)};
  bytes.append(reinterpret_cast<const char*>(row), (speos ? 8 : 7) * sizeof(float));
}

}  // namespace

void WriteRays(const std::filesystem::path& path, RayFormat format, const RayFileHeader& header,
               bool flux_is_luminous, bool tristimulus, const RaySource& next) {
  if (format == RayFormat::kTm25) {
    WriteTm25(path, header, flux_is_luminous, tristimulus, next);
    return;
  }
  const std::string name = path.string();
  std::string bytes =
      format == RayFormat::kZemax            ? ZemaxHeader(name, header, flux_is_luminous)
      : format == RayFormat::kLightTools     ? LightToolsHeader(header, flux_is_luminous)
      : format == RayFormat::kLightToolsText ? LightToolsTextHeader(header, flux_is_luminous)
                                             : SpeosHeader(header, flux_is_luminous);
  const double mean_flux =
      header.ray_count > 0 ? FluxOf(header, flux_is_luminous) / double(header.ray_count) : 0;
  core::WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    constexpr std::size_t kPiece = 1 << 16;
    std::ofstream stream(temporary, std::ios::binary);
    const auto flush = [&] {
      stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
      bytes.clear();
    };
    std::uint64_t count = 0;
    for (Ray ray; next(ray); ++count) {
      RequireHeld(name, ray, count);
      AddRay(bytes, format, ray, mean_flux);
      if (bytes.size() > kPiece) flush();
    }
    if (count != header.ray_count)
      throw InputError(name, fmt::format("{} rays where {} were told", count, header.ray_count));
    if (format == RayFormat::kLightTools) bytes += lighttools::kEnd;
    if (format == RayFormat::kLightToolsText) bytes += "lt_endofdata\r\n";
    flush();
    stream.close();
    if (!stream)
      throw DeviceError(fmt::format("{}: cannot write; free space or choose another folder", name));
  });
}

}  // namespace luxfield::formats
