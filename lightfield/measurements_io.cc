// *.meas.exr, to the byte in docs/formats/measurements.md.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/exr_rows.h"
#include "luxfield/lightfield/exr_geometry.h"
#include "luxfield/lightfield/file_pieces.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::lightfield {
namespace {

constexpr std::uint32_t kKnownFlags =
    kOffSensor | kSaturated | kTooDark | kDefect | kPartlyDefect | kBelowBlack;

std::string IrradianceChannel(const std::string& colour) { return "E." + colour; }
std::string UndetectedChannel(const std::string& colour) { return "undetected." + colour; }
std::string SigmaChannel(const std::string& colour) { return "sigma." + colour; }

constexpr const char* kDisplacementU = "luxfield:displacement_u_m";
constexpr const char* kDisplacementV = "luxfield:displacement_v_m";

// Both attributes or none; at most one spacing.
Vec2 ReadDisplacement(const core::ExrReader& reader, int part, double spacing_m) {
  const auto& attributes = reader.parts()[part].attributes;
  if (!attributes.contains(kDisplacementU) && !attributes.contains(kDisplacementV)) return {};
  const Vec2 displacement{reader.GetDouble(part, kDisplacementU),
                          reader.GetDouble(part, kDisplacementV)};
  if (!(std::abs(displacement.x) <= spacing_m && std::abs(displacement.y) <= spacing_m))
    throw InputError(
        reader.path().string(),
        fmt::format("part '{}' is displaced by ({}, {}) m, more than the spacing {} m",
                    reader.parts()[part].name, displacement.x, displacement.y, spacing_m),
        "merge the session again");
  return displacement;
}

core::ExrAttributes DisplacementAttributes(const Measurement& position) {
  if (position.displacement_m.x == 0 && position.displacement_m.y == 0) return {};
  return {{kDisplacementU, position.displacement_m.x}, {kDisplacementV, position.displacement_m.y}};
}

// Planes of one position must have the geometry's size: a mistake of the caller.
void RequireSizes(const Measurement& position, const LuminaireGeometry& geometry) {
  const std::size_t plane = geometry.plane_size(), all = plane * geometry.channels;
  if (position.irradiance.size() != all || position.sigma.size() != all ||
      position.count.size() != plane || position.mask.size() != plane)
    throw std::logic_error("measurements: a plane's size differs from the lattice");
}

// Irradiance as in the file: what is no number is NaN; estimates of what is not detected stand
// apart.
struct Reported {
  std::vector<float> number, undetected;

  Reported(const Measurement& position, std::size_t plane)
      : number(position.irradiance), undetected(number.size(), 0.0f) {
    for (std::size_t k = 0; k < number.size(); ++k) {
      const std::uint32_t mask = position.mask[k % plane];
      const bool unknown = mask & kUnknownMask;
      const bool dark = mask & kTooDark && !IsDetected(number[k], position.sigma[k]);
      if (!unknown && !dark) continue;
      if (!unknown) undetected[k] = number[k];
      number[k] = std::numeric_limits<float>::quiet_NaN();
    }
  }
};

// The pixels of a part, in the order of Channels.
std::vector<core::ExrPixels> Pixels(const Measurement& position, const Reported& reported,
                                    const LuminaireGeometry& geometry) {
  const std::size_t plane = geometry.plane_size();
  std::vector<core::ExrPixels> pixels;
  for (int channel = 0; channel < geometry.channels; ++channel) {
    pixels.emplace_back(std::span(reported.number).subspan(channel * plane, plane));
    pixels.emplace_back(std::span(reported.undetected).subspan(channel * plane, plane));
    pixels.emplace_back(std::span(position.sigma).subspan(channel * plane, plane));
  }
  pixels.emplace_back(std::span(position.count));
  pixels.emplace_back(std::span(position.mask));
  return pixels;
}

// The channels of a part, without pixels.
std::vector<core::ExrChannelView> Channels(const LuminaireGeometry& geometry) {
  std::vector<core::ExrChannelView> channels;
  for (const std::string& colour : ChannelNames(geometry.channels)) {
    channels.push_back({IrradianceChannel(colour), std::span<const float>()});
    channels.push_back({UndetectedChannel(colour), std::span<const float>()});
    channels.push_back({SigmaChannel(colour), std::span<const float>()});
  }
  channels.push_back({"count", std::span<const float>()});
  channels.push_back({"mask", std::span<const std::uint32_t>()});
  return channels;
}

// Estimates to where the file holds no number and says why; unknown values become 0.
void JoinEstimates(std::span<const float> undetected, Measurement& position) {
  const std::size_t plane = position.mask.size();
  for (std::size_t k = 0; k < position.irradiance.size(); ++k) {
    const std::uint32_t mask = position.mask[k % plane];
    if (!std::isnan(position.irradiance[k]) || !(mask & (kUnknownMask | kTooDark))) continue;
    position.irradiance[k] = mask & kUnknownMask ? 0.0f : undetected[k];
  }
}

// Pixels of a part: all of them, or some rows.
struct PartSource {
  core::ExrReader& reader;
  core::ExrRowReader* rows = nullptr;  // null: all
  int first = 0, count = 0;

  void Read(int part, std::span<const core::ExrTarget> targets) {
    if (rows)
      rows->Read(part, targets, first, count);
    else
      reader.Read(part, targets);
  }
};

// `geometry` is that of what is read.
Measurement ReadPosition(PartSource& source, int part, const LuminaireGeometry& geometry) {
  core::ExrReader& reader = source.reader;
  const std::size_t plane = geometry.plane_size();
  Measurement position;
  position.irradiance.resize(plane * geometry.channels);
  position.sigma.resize(plane * geometry.channels);
  position.count.resize(plane);
  position.mask.resize(plane);
  std::vector<float> undetected(position.irradiance.size());
  const auto colours = ChannelNames(geometry.channels);
  std::vector<core::ExrTarget> targets;
  const auto add = [&](const std::string& name, std::vector<float>& planes, int channel) {
    targets.push_back({name, std::span(planes).subspan(channel * plane, plane)});
  };
  for (int channel = 0; channel < geometry.channels; ++channel) {
    add(IrradianceChannel(colours[channel]), position.irradiance, channel);
    add(UndetectedChannel(colours[channel]), undetected, channel);
    add(SigmaChannel(colours[channel]), position.sigma, channel);
  }
  add("count", position.count, 0);
  targets.push_back({"mask", std::span(position.mask)});
  source.Read(part, targets);
  position.displacement_m = ReadDisplacement(reader, part, geometry.grid.spacing_m);
  for (const std::uint32_t flags : position.mask)
    if (flags & ~kKnownFlags)
      throw InputError(reader.path().string(),
                       fmt::format("part '{}', channel 'mask' holds unknown flags {:#x}",
                                   reader.parts()[part].name, flags),
                       "read it with the luxfield that wrote it");
  JoinEstimates(undetected, position);
  for (const auto& [name, pixels] : targets) {
    const auto* values = std::get_if<std::span<float>>(&pixels);
    const bool may_be_negative = name.starts_with("E.") || name.starts_with("undetected.");
    if (values) RequireFinite(reader, reader.parts()[part].name, name, *values, may_be_negative);
  }
  return position;
}

// Positions first to last - 1; pixels(m): of position m, valid until the next call.
void Write(const std::filesystem::path& path, const Measurements& header, int first, int last,
           core::ExrCompression compression,
           const std::function<std::vector<core::ExrPixels>(int m)>& pixels) {
  const LuminaireGeometry& geometry = header.geometry;
  geometry.Validate(path.string());
  if (header.positions.size() != static_cast<std::size_t>(geometry.grid.count()))
    throw std::logic_error("measurements: number of positions differs from the basis grid");
  std::vector<core::ExrPartView> parts;
  for (int j = 0; j < geometry.grid.height; ++j)
    for (int i = 0; i < geometry.grid.width; ++i)
      parts.push_back({PartName(kMeasurementsKind, i, j), geometry.lattice.width,
                       geometry.lattice.height, Channels(geometry),
                       DisplacementAttributes(header.positions[geometry.grid.index(i, j)])});
  core::ExrAttributes& attributes = parts.front().attributes;
  attributes.merge(GeometryAttributes(kMeasurementsKind, geometry, header.provenance));
  attributes["luxfield:filter"] =
      std::string(header.filter == FilterKind::kBasis ? "basis" : "dual");
  attributes["luxfield:filter_scale"] = header.filter_scale;
  core::WriteExr(path, std::span(parts).subspan(first, last - first), compression,
                 [&](int part) { return pixels(first + part); });
}

}  // namespace

void WriteMeasurements(const std::filesystem::path& path, const Measurements& measurements) {
  for (const Measurement& position : measurements.positions)
    RequireSizes(position, measurements.geometry);
  std::optional<Reported> reported;
  Write(path, measurements, 0, measurements.geometry.grid.count(), core::ExrCompression::kNone,
        [&](int m) {
          const Measurement& position = measurements.positions[m];
          reported.emplace(position, measurements.geometry.plane_size());
          return Pixels(position, *reported, measurements.geometry);
        });
}

void WriteMeasurements(const std::filesystem::path& path, const Measurements& header,
                       const std::function<Measurement(int)>& next) {
  WriteMeasurementPositions(path, header, 0, header.geometry.grid.count(), next);
}

void WriteMeasurementPositions(const std::filesystem::path& path, const Measurements& header,
                               int first, int last, const std::function<Measurement(int)>& next,
                               core::ExrCompression compression) {
  Measurement position;
  std::optional<Reported> reported;
  Write(path, header, first, last, compression, [&](int m) {
    position = {};  // is written, and makes room
    reported.reset();
    position = next(m);
    RequireSizes(position, header.geometry);
    reported.emplace(position, header.geometry.plane_size());
    return Pixels(position, *reported, header.geometry);
  });
}

namespace {

Measurements Read(PartSource source) {
  core::ExrReader& reader = source.reader;
  const std::filesystem::path& path = reader.path();
  ExrGeometry header = ReadGeometry(reader, kMeasurementsKind);
  Lattice& lattice = header.geometry.lattice;
  if (source.rows) {
    if (source.first < 0 || source.count < 1 || source.first + source.count > lattice.height)
      throw InputError(path.string(),
                       fmt::format("has {} rows, and not those from {} to {}", lattice.height,
                                   source.first, source.first + source.count - 1),
                       "ask for rows that it has");
    lattice.t1_m = lattice.t_of_row(source.first);
    lattice.height = source.count;
  }
  Measurements measurements;
  measurements.geometry = header.geometry;
  measurements.provenance = std::move(header.provenance);
  const int first = header.parts.front();
  const std::string filter = reader.GetString(first, "luxfield:filter");
  if (filter != "basis" && filter != "dual")
    throw InputError(path.string(),
                     fmt::format("luxfield:filter = '{}' is neither basis nor dual", filter),
                     "make the file anew with the verb that wrote it");
  measurements.filter = filter == "basis" ? FilterKind::kBasis : FilterKind::kDual;
  measurements.filter_scale = reader.GetDouble(first, "luxfield:filter_scale");
  if (!(measurements.filter_scale > 0 && std::isfinite(measurements.filter_scale)))
    throw InputError(
        path.string(),
        fmt::format("luxfield:filter_scale = {} must be above 0", measurements.filter_scale),
        "make the file anew with the verb that wrote it");
  measurements.positions.reserve(header.parts.size());
  for (const int part : header.parts)
    measurements.positions.push_back(ReadPosition(source, part, measurements.geometry));
  return measurements;
}

}  // namespace

Measurements ReadMeasurements(const std::filesystem::path& path) {
  core::ExrReader reader(path);
  return Read({reader});
}

LuminaireGeometry ReadMeasurementGeometry(const std::filesystem::path& path) {
  return ReadGeometry(core::ExrReader(path), kMeasurementsKind).geometry;
}

Measurements ReadMeasurementRows(const std::filesystem::path& path, int first, int count) {
  core::ExrReader reader(path);
  core::ExrRowReader rows(reader);
  return Read({reader, &rows, first, count});
}

}  // namespace luxfield::lightfield
