#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/formats/ray_file.h"
#include "luxfield/formats/tm25_layout.h"

namespace luxfield::formats {
namespace {

template <typename T>
void Put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof(T));
}

// Malformed UTF-8 becomes U+FFFD, one per byte.
std::vector<char32_t> CodePoints(std::string_view text) {
  std::vector<char32_t> points;
  while (!text.empty()) {
    const auto lead = static_cast<unsigned char>(text.front());
    const std::size_t length = lead < 0x80   ? 1
                               : lead < 0xC0 ? 0
                               : lead < 0xE0 ? 2
                               : lead < 0xF0 ? 3
                                             : 4;
    bool good = length > 0 && lead < 0xF8 && length <= text.size();
    char32_t point = length == 1 ? lead : lead & (0x7Fu >> length);
    for (std::size_t k = 1; good && k < length; ++k) {
      const auto byte = static_cast<unsigned char>(text[k]);
      good = (byte & 0xC0) == 0x80;
      point = (point << 6) | (byte & 0x3F);
    }
    points.push_back(good ? point : 0xFFFD);
    text.remove_prefix(good ? length : 1);
  }
  return points;
}

// Checks what the format cannot hold and builds everything before the rays.
std::string FixedPart(const std::string& name, const RayFileHeader& header, bool luminous,
                      bool tristimulus) {
  if (header.spectral_id != 0 && header.spectral_id != 1)
    throw InputError(name,
                     fmt::format("spectral data identifier = {} needs data that is not kept",
                                 header.spectral_id),
                     "write it with 0 or 1");
  if (tristimulus && (!luminous || header.spectral_id != 0))
    throw InputError(name, "tristimulus values need luminous flux and no spectrum",
                     "leave them out");
  if (header.date_time.size() > tm25::kDateBytes)
    throw InputError(name,
                     fmt::format("date and time '{}' is longer than {} bytes", header.date_time,
                                 tm25::kDateBytes),
                     "use ISO 8601");

  std::string bytes(tm25::kFixedBytes, '\0');
  bytes.replace(0, 4, "TM25");
  const auto flux = [](const std::optional<double>& value) {
    return value ? static_cast<float>(*value) : std::bit_cast<float>(tm25::kUnknownBits);
  };
  Put(bytes, tm25::kAtVersion, tm25::kVersion);
  Put(bytes, tm25::kAtCreation, header.creation_method);
  Put(bytes, tm25::kAtLuminous, flux(header.luminous_flux_lm));
  Put(bytes, tm25::kAtRadiant, flux(header.radiant_flux_w));
  Put(bytes, tm25::kAtRays, header.ray_count);
  std::copy(header.date_time.begin(), header.date_time.end(), bytes.begin() + tm25::kAtDate);
  Put(bytes, tm25::kAtStart, header.start_position);
  Put(bytes, tm25::kAtSpectral, header.spectral_id);
  Put(bytes, tm25::kAtWavelength,
      flux(header.spectral_id == 1 ? std::optional(header.wavelength_nm) : std::nullopt));
  Put(bytes, tm25::kAtMinimum, tm25::kUnknownBits);
  Put(bytes, tm25::kAtMaximum, tm25::kUnknownBits);

  const auto set = [&](tm25::Flag flag, bool value) {
    Put(bytes, tm25::kHeaderBytes + 4 * std::size_t{flag}, std::int32_t{value});
  };
  set(tm25::kPosition, true);
  set(tm25::kDirection, true);
  set(tm25::kRadiant, !luminous);
  set(tm25::kLuminous, luminous);
  set(tm25::kTristimulus, tristimulus);

  if (header.texts.size() > tm25::kTexts)
    throw InputError(name, fmt::format("{} texts do not fit the format's {}", header.texts.size(),
                                       tm25::kTexts));
  for (std::size_t text = 0; text < header.texts.size(); ++text) {
    const auto points = CodePoints(header.texts[text]);
    if (points.size() * 4 > tm25::kTextBytes)
      throw InputError(name, fmt::format("text {} has {} characters", text + 1, points.size()),
                       fmt::format("shorten it to {}", tm25::kTextBytes / 4));
    const std::size_t at = tm25::kHeaderBytes + tm25::kFlagBytes + text * tm25::kTextBytes;
    for (std::size_t k = 0; k < points.size(); ++k) Put(bytes, at + 4 * k, points[k]);
  }
  return bytes;
}

void RequireRepresentable(const std::string& name, const Ray& ray, std::uint64_t index) {
  const lightfield::Vec3 mm = 1e3 * ray.position_m;
  const double largest = std::numeric_limits<float>::max();
  for (const double value : {mm.x, mm.y, mm.z, ray.flux})
    if (!(std::abs(value) <= largest))
      throw InputError(name, fmt::format("ray {} holds {}, which no float can hold", index, value),
                       "leave it out");
  if (!(std::abs(lightfield::Length(ray.direction) - 1) <= tm25::kUnitTolerance) || ray.flux < 0)
    throw InputError(name,
                     fmt::format("ray {} has a direction of length {} and flux {}", index,
                                 lightfield::Length(ray.direction), ray.flux),
                     "normalise directions and leave negative flux out");
}

}  // namespace

void WriteTm25(const std::filesystem::path& path, const RayFileHeader& header,
               bool flux_is_luminous, bool tristimulus, const RaySource& next) {
  const std::string name = path.string();
  const std::string fixed = FixedPart(name, header, flux_is_luminous, tristimulus);
  core::WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream stream(temporary, std::ios::binary);
    stream.write(fixed.data(), static_cast<std::streamsize>(fixed.size()));
    std::vector<float> row;
    std::uint64_t count = 0;
    for (Ray ray; next(ray); ++count) {
      RequireRepresentable(name, ray, count);
      if (tristimulus && !ray.tristimulus)
        throw InputError(name, fmt::format("ray {} has no tristimulus values", count));
      const lightfield::Vec3 mm = 1e3 * ray.position_m, k = ray.direction;
      row.clear();
      for (const double value : {mm.x, mm.y, mm.z, k.x, k.y, k.z, ray.flux})
        row.push_back(static_cast<float>(value));
      if (tristimulus) {
        row.push_back(static_cast<float>((*ray.tristimulus)[0]));
        row.push_back(static_cast<float>((*ray.tristimulus)[2]));
      }
      stream.write(reinterpret_cast<const char*>(row.data()),
                   static_cast<std::streamsize>(row.size() * sizeof(float)));
    }
    if (count != header.ray_count)
      throw InputError(name, fmt::format("{} rays where {} were told", count, header.ray_count));
    stream.close();
    if (!stream)
      throw DeviceError(fmt::format("{}: cannot write; free space or choose another folder", name));
  });
}

void WriteTm25(const std::filesystem::path& path, const RayFile& file) {
  const bool tristimulus =
      !file.rays.empty() && std::all_of(file.rays.begin(), file.rays.end(),
                                        [](const Ray& ray) { return ray.tristimulus.has_value(); });
  RayFileHeader header = file.header;
  header.ray_count = file.rays.size();
  std::size_t at = 0;
  WriteTm25(path, header, file.flux_is_luminous, tristimulus, [&](Ray& ray) {
    if (at == file.rays.size()) return false;
    ray = file.rays[at++];
    return true;
  });
}

}  // namespace luxfield::formats
