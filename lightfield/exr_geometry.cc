#include "luxfield/lightfield/exr_geometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "luxfield/core/error.h"
#include "luxfield/core/simd.h"

namespace luxfield::lightfield {
namespace {

constexpr int kVersion = 1;
constexpr const char* kRemedy = "make the file anew with the verb that wrote it";
constexpr std::string_view kProvenancePrefix = "luxfield:provenance.";

// DEFLATE cannot shrink data more than 1032 times (RFC 1951: 258 bytes in 2 bits): a header that
// claims more pixels than that is lying, and is refused before its pixels are allocated.
constexpr double kMaxCompression = 1040;

BasisGrid ReadGrid(const core::ExrReader& reader, int part) {
  BasisGrid grid;
  grid.basis = ReadBasis(reader, part);
  grid.width = reader.GetInt(part, "luxfield:basis_width");
  grid.height = reader.GetInt(part, "luxfield:basis_height");
  grid.u0_m = reader.GetDouble(part, "luxfield:u0_m");
  grid.v0_m = reader.GetDouble(part, "luxfield:v0_m");
  grid.spacing_m = reader.GetDouble(part, "luxfield:spacing_m");
  return grid;
}

Lattice ReadLattice(const core::ExrReader& reader, int part) {
  Lattice lattice;
  lattice.width = reader.parts()[part].width;
  lattice.height = reader.parts()[part].height;
  lattice.s0_m = reader.GetDouble(part, "luxfield:s0_m");
  lattice.t1_m = reader.GetDouble(part, "luxfield:t1_m");
  lattice.ds_m = reader.GetDouble(part, "luxfield:ds_m");
  lattice.dt_m = reader.GetDouble(part, "luxfield:dt_m");
  return lattice;
}

FluxUnit ReadUnit(const core::ExrReader& reader, int part) {
  const std::string name = reader.GetString(part, "luxfield:unit");
  for (const FluxUnit unit : {FluxUnit::kWatt, FluxUnit::kLumen, FluxUnit::kRelative})
    if (name == FluxUnitName(unit)) return unit;
  throw InputError(reader.path().string(),
                   fmt::format("luxfield:unit = '{}' is none of W, lm, relative", name), kRemedy);
}

// The parts in the order of m, all present, of equal size, and no others.
std::vector<int> FindParts(const core::ExrReader& reader, const ExrKind& kind,
                           const LuminaireGeometry& geometry) {
  const std::string file = reader.path().string();
  const BasisGrid& grid = geometry.grid;
  if (kind.alone && static_cast<int>(reader.parts().size()) != grid.count())
    throw InputError(file,
                     fmt::format("has {} parts where luxfield:basis_width x basis_height = {} x {}",
                                 reader.parts().size(), grid.width, grid.height),
                     kRemedy);
  std::vector<int> parts;
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      const std::string name = PartName(kind, i, j);
      const int part = reader.find_part(name);
      if (part < 0) throw InputError(file, fmt::format("part '{}' is missing", name), kRemedy);
      const auto& found = reader.parts()[part];
      if (found.width != geometry.lattice.width || found.height != geometry.lattice.height)
        throw InputError(
            file,
            fmt::format("part '{}' is {} x {} pixels where the first is {} x {}", name, found.width,
                        found.height, geometry.lattice.width, geometry.lattice.height),
            kRemedy);
      parts.push_back(part);
    }
  return parts;
}

}  // namespace

std::string PartName(const ExrKind& kind, int i, int j) {
  return fmt::format("{}.{:02}.{:02}", kind.part_prefix, j, i);
}

std::span<const std::string> ChannelNames(int channels) {
  static const std::array<std::string, 1> kLuminance{"Y"};
  static const std::array<std::string, 3> kColour{"R", "G", "B"};
  if (channels == 1) return kLuminance;
  return kColour;
}

core::ExrAttributes BasisAttributes(const Basis& basis) {
  core::ExrAttributes attributes{{"luxfield:basis", basis.name()}};
  if (basis.kind == BasisKind::kQuadratic) attributes["luxfield:basis_a"] = basis.a;
  return attributes;
}

Basis ReadBasis(const core::ExrReader& reader, int part) {
  const std::string name = reader.GetString(part, "luxfield:basis");
  try {
    return name == "quadratic" ? Basis::FromName(name, reader.GetDouble(part, "luxfield:basis_a"))
                               : Basis::FromName(name);
  } catch (const InputError& error) {
    const std::string what = error.what();
    throw InputError(what.starts_with(reader.path().string())
                         ? what
                         : fmt::format("{}: luxfield:basis: {}", reader.path().string(), what));
  }
}

core::ExrAttributes ProvenanceAttributes(const Provenance& provenance) {
  core::ExrAttributes attributes;
  for (const auto& [name, value] : provenance)
    attributes[fmt::format("{}{}", kProvenancePrefix, name)] = value;
  return attributes;
}

Provenance ReadProvenance(const core::ExrReader& reader, int part) {
  Provenance provenance;
  for (const auto& [name, value] : reader.parts()[part].attributes)
    if (name.starts_with(kProvenancePrefix))
      if (const auto* text = std::get_if<std::string>(&value))
        provenance[name.substr(kProvenancePrefix.size())] = *text;
  return provenance;
}

core::ExrAttributes GeometryAttributes(const ExrKind& kind, const LuminaireGeometry& geometry,
                                       const Provenance& provenance) {
  const BasisGrid& grid = geometry.grid;
  const Lattice& lattice = geometry.lattice;
  core::ExrAttributes attributes{
      {"luxfield:kind", std::string(kind.name)},
      {"luxfield:version", kVersion},
      {"luxfield:unit", FluxUnitName(geometry.unit)},
      {"luxfield:delta_m", geometry.delta_m},
      {"luxfield:basis_width", grid.width},
      {"luxfield:basis_height", grid.height},
      {"luxfield:u0_m", grid.u0_m},
      {"luxfield:v0_m", grid.v0_m},
      {"luxfield:spacing_m", grid.spacing_m},
      {"luxfield:s0_m", lattice.s0_m},
      {"luxfield:t1_m", lattice.t1_m},
      {"luxfield:ds_m", lattice.ds_m},
      {"luxfield:dt_m", lattice.dt_m},
  };
  attributes.merge(BasisAttributes(grid.basis));
  attributes.merge(ProvenanceAttributes(provenance));
  return attributes;
}

ExrGeometry ReadGeometry(const core::ExrReader& reader, const ExrKind& kind) {
  const std::string file = reader.path().string();
  const std::string first_name = PartName(kind, 0, 0);
  const int first = reader.find_part(first_name);
  if (first < 0)
    throw InputError(file,
                     fmt::format("has no part '{}', so it is no {} file", first_name, kind.name),
                     "check that this is the kind of file the verb expects");
  const std::string kind_name = reader.GetString(first, "luxfield:kind");
  if (kind_name != kind.name)
    throw InputError(file, fmt::format("luxfield:kind = '{}' is not '{}'", kind_name, kind.name),
                     "check that this is the kind of file the verb expects");
  const int version = reader.GetInt(first, "luxfield:version");
  if (version != kVersion)
    throw InputError(file,
                     fmt::format("luxfield:version = {} where {} is understood", version, kVersion),
                     "read it with the luxfield that wrote it");

  ExrGeometry out;
  LuminaireGeometry& geometry = out.geometry;
  geometry.unit = ReadUnit(reader, first);
  geometry.delta_m = reader.GetDouble(first, "luxfield:delta_m");
  geometry.grid = ReadGrid(reader, first);
  geometry.lattice = ReadLattice(reader, first);
  geometry.channels = reader.has_channel(first, fmt::format("{}R", kind.channel_prefix)) ? 3 : 1;
  geometry.Validate(file);

  std::error_code error_code;
  const auto bytes = static_cast<double>(std::filesystem::file_size(reader.path(), error_code));
  const double claimed = sizeof(float) * static_cast<double>(geometry.value_count());
  if (error_code || claimed > kMaxCompression * bytes)
    throw InputError(file, fmt::format("claims {} bytes of pixels in a file of {}", claimed, bytes),
                     "the file is truncated or damaged: make it anew");

  out.parts = FindParts(reader, kind, geometry);
  out.provenance = ReadProvenance(reader, first);
  return out;
}

namespace {

// By their bits, which vectors look at together.
LUXFIELD_SIMD_CLONES bool AreFinite(std::span<const float> values, bool allow_negative) {
  constexpr std::uint32_t kInfinity = 0x7F800000u, kMinusZero = 0x80000000u;
  constexpr std::size_t kBlock = 256;
  const std::uint32_t most = allow_negative ? ~0u : kMinusZero;
  const auto is_bad = [most](float value) __attribute__((always_inline)) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return static_cast<std::uint32_t>((bits & kInfinity) == kInfinity) |
           static_cast<std::uint32_t>(bits > most);
  };
  std::uint32_t bad = 0;
  std::size_t k = 0;
  for (; k + kBlock <= values.size(); k += kBlock)
    for (std::size_t i = 0; i < kBlock; ++i) bad |= is_bad(values[k + i]);
  for (; k < values.size(); ++k) bad |= is_bad(values[k]);
  return bad == 0;
}

}  // namespace

void RequireFinite(const core::ExrReader& reader, const std::string& part,
                   const std::string& channel, std::span<const float> values, bool allow_negative) {
  if (AreFinite(values, allow_negative)) return;
  const auto bad = std::find_if(values.begin(), values.end(), [&](float value) {
    return !std::isfinite(value) || (!allow_negative && value < 0);
  });
  if (bad == values.end()) return;
  const int width = reader.parts()[reader.find_part(part)].width;
  const auto index = bad - values.begin();
  throw InputError(reader.path().string(),
                   fmt::format("part '{}', channel '{}' holds {} at row {}, column {}", part,
                               channel, *bad, index / width, index % width),
                   "the file is damaged or its maker is wrong: make it anew");
}

}  // namespace luxfield::lightfield
