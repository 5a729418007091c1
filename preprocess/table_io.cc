#include "luxfield/preprocess/table_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/parallel.h"
#include "luxfield/preprocess/table_parts.h"

namespace luxfield::preprocess {
namespace {

constexpr int kVersion = 1;
constexpr int kMaxGrid = 256;      // images along an axis
constexpr int kMaxExponent = 211;  // 62 bits above the smallest denormal float
constexpr int kMinExponent = -66;  // 62 bits above the largest float
const char* const kRemedy = "make the tables again with 'luxfield preprocess'";

std::string PartName(int m, int grid_width) {
  return fmt::format("S.{:02d}.{:02d}", m / grid_width, m % grid_width);
}

int GetBounded(const core::ExrReader& reader, int part, const std::string& name, int min, int max) {
  const int value = reader.GetInt(part, name);
  if (value < min || value > max)
    throw InputError(reader.path().string(),
                     fmt::format("attribute {} of part '{}' = {} must be {} to {}", name,
                                 reader.parts()[part].name, value, min, max),
                     kRemedy);
  return value;
}

int RequirePart(const core::ExrReader& reader, const std::string& name, int width, int height) {
  const int part = reader.find_part(name);
  if (part < 0)
    throw InputError(reader.path().string(), fmt::format("part '{}' is missing", name), kRemedy);
  const auto& found = reader.parts()[part];
  if (found.width != width || found.height != height)
    throw InputError(reader.path().string(),
                     fmt::format("part '{}' is {} x {}, expected {} x {}", name, found.width,
                                 found.height, width, height),
                     kRemedy);
  return part;
}

bool IsHexSha256(const std::string& text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

// Borders 0, every texel in [0, 2^63), the total below 2^63: then all rectangles are too.
bool IsSat(const std::uint64_t* sat, int width, int height) {
  const std::size_t stride = width + 1;
  for (int c = 0; c <= width; ++c)
    if (sat[c] != 0) return false;
  for (int r = 0; r < height; ++r) {
    const std::uint64_t *above = sat + r * stride, *row = above + stride;
    if (row[0] != 0) return false;
    std::uint64_t prefix = 0;
    for (int c = 0; c < width; ++c) {
      const std::uint64_t next = row[c + 1] - above[c + 1];
      if (next < prefix || next >> 63 || row[c + 1] >> 63) return false;
      prefix = next;
    }
  }
  return true;
}

}  // namespace

TableReferencePart::TableReferencePart(const Tables& tables,
                                       const std::vector<ReferencePosition>& reference)
    : width_(tables.grid_width + tables.basis_cells - 1),
      height_(tables.grid_height + tables.basis_cells - 1) {
  for (const ReferencePosition& position : reference) {
    s_.push_back(position.s_m);
    t_.push_back(position.t_m);
    images_.push_back(static_cast<std::uint32_t>(position.images));
  }
}

core::ExrPartView TableReferencePart::view() const {
  return {"reference",
          width_,
          height_,
          {{"images", std::span(images_)}, {"s", std::span(s_)}, {"t", std::span(t_)}},
          {}};
}

void WriteTableParts(const std::filesystem::path& path, const Tables& tables, int first, int last,
                     const std::function<std::span<const std::uint64_t>(int m)>& sat,
                     const std::function<std::vector<ReferencePosition>()>& reference) {
  const std::span<const std::uint32_t> later;
  std::vector<core::ExrPartView> parts;
  for (int m = first; m < last; ++m)
    parts.push_back({PartName(m, tables.grid_width),
                     tables.width + 1,
                     tables.height + 1,
                     {{"hi", later}, {"lo", later}},
                     {{"luxfield:exponent", tables.exponent[m]}}});
  if (first == 0) {
    auto& attributes = parts.front().attributes;
    attributes["luxfield:kind"] = std::string("tables");
    attributes["luxfield:version"] = kVersion;
    attributes["luxfield:light_field_sha256"] = tables.light_field_sha256;
    attributes["luxfield:grid_width"] = tables.grid_width;
    attributes["luxfield:grid_height"] = tables.grid_height;
    attributes["luxfield:basis_cells"] = tables.basis_cells;
  }
  if (reference) parts.push_back(TableReferencePart(tables, {}).view());
  std::vector<std::uint32_t> lo, hi;
  std::optional<TableReferencePart> behind;
  core::WriteExr(path, parts, core::ExrCompression::kNone, [&](int part) {
    std::vector<core::ExrPixels> pixels;
    if (first + part < last) {
      const std::span<const std::uint64_t> table = sat(first + part);
      lo.resize(table.size());
      hi.resize(table.size());
      core::ParallelFor(table.size(), 1 << 18, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
          lo[k] = static_cast<std::uint32_t>(table[k]);
          hi[k] = static_cast<std::uint32_t>(table[k] >> 32);
        }
      });
      pixels = {std::span<const std::uint32_t>(hi), std::span<const std::uint32_t>(lo)};
    } else {
      for (const auto& channel : behind.emplace(tables, reference()).view().channels)
        pixels.push_back(channel.pixels);
    }
    return pixels;
  });
}

void WriteTables(const std::filesystem::path& path, const Tables& tables) {
  WriteTableParts(
      path, tables, 0, tables.count(),
      [&](int m) { return std::span(tables.image(m), tables.sat_size()); },
      [&] { return tables.reference; });
}

Tables ReadTables(const std::filesystem::path& path) {
  core::ExrReader reader(path);
  const std::string file = path.string();
  if (!reader.parts()[0].attributes.contains("luxfield:kind") ||
      reader.GetString(0, "luxfield:kind") != "tables")
    throw InputError(file, "is not a table file (attribute luxfield:kind is not 'tables')",
                     "give a *.tab.exr");
  GetBounded(reader, 0, "luxfield:version", kVersion, kVersion);

  Tables tables;
  tables.grid_width = GetBounded(reader, 0, "luxfield:grid_width", 1, kMaxGrid);
  tables.grid_height = GetBounded(reader, 0, "luxfield:grid_height", 1, kMaxGrid);
  tables.basis_cells =
      GetBounded(reader, 0, "luxfield:basis_cells", 1, lightfield::Basis::kMaxCells);
  tables.light_field_sha256 = reader.GetString(0, "luxfield:light_field_sha256");
  if (!IsHexSha256(tables.light_field_sha256))
    throw InputError(
        file, "attribute luxfield:light_field_sha256 is not 64 lower-case hexadecimal digits",
        kRemedy);
  tables.width = reader.parts()[0].width - 1;
  tables.height = reader.parts()[0].height - 1;
  if (tables.width < 1 || tables.height < 1)
    throw InputError(file, fmt::format("part '{}' has no texels", reader.parts()[0].name), kRemedy);
  if (static_cast<int>(reader.parts().size()) != tables.count() + 1)
    throw InputError(file,
                     fmt::format("has {} parts, {} x {} images need {}", reader.parts().size(),
                                 tables.grid_width, tables.grid_height, tables.count() + 1),
                     kRemedy);
  std::vector<int> parts(tables.count());
  for (int m = 0; m < tables.count(); ++m)
    parts[m] =
        RequirePart(reader, PartName(m, tables.grid_width), tables.width + 1, tables.height + 1);
  const int cells_u = tables.grid_width + tables.basis_cells - 1,
            cells_v = tables.grid_height + tables.basis_cells - 1;
  const int reference_part = RequirePart(reader, "reference", cells_u, cells_v);
  // A deflated file holds at most about a thousand times its length: a header cannot ask for more
  // memory than that.
  if (static_cast<double>(tables.sat_size()) * tables.count() * 8 >
      1100.0 * static_cast<double>(std::filesystem::file_size(path)))
    throw InputError(file, "is too short for the images its header announces", kRemedy);

  tables.sat.resize(tables.sat_size() * tables.count());
  tables.exponent.resize(tables.count());
  for (int m = 0; m < tables.count(); ++m) {
    tables.exponent[m] =
        GetBounded(reader, parts[m], "luxfield:exponent", kMinExponent, kMaxExponent);
    const auto lo = reader.ReadUint(parts[m], "lo"), hi = reader.ReadUint(parts[m], "hi");
    std::uint64_t* sat = tables.sat.data() + tables.sat_size() * m;
    for (std::size_t k = 0; k < lo.size(); ++k) sat[k] = lo[k] | std::uint64_t{hi[k]} << 32;
    if (!IsSat(sat, tables.width, tables.height))
      throw InputError(file,
                       fmt::format("part '{}' is not the summed-area table of non-negative texels",
                                   PartName(m, tables.grid_width)),
                       kRemedy);
  }

  const auto s = reader.ReadFloat(reference_part, "s"), t = reader.ReadFloat(reference_part, "t");
  const auto images = reader.ReadUint(reference_part, "images");
  tables.reference.resize(s.size());
  const auto overlapping = static_cast<std::uint32_t>(tables.basis_cells * tables.basis_cells);
  for (std::size_t k = 0; k < s.size(); ++k) {
    if (!std::isfinite(s[k]) || !std::isfinite(t[k]) || images[k] > overlapping)
      throw InputError(
          file,
          fmt::format("part 'reference' is not finite, or counts too many images, in cell {}", k),
          kRemedy);
    tables.reference[k] = {s[k], t[k], static_cast<int>(images[k])};
  }
  return tables;
}

}  // namespace luxfield::preprocess
