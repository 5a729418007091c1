// TM-25 ray files (IES TM-25-13; layout in docs/formats/tm25.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lightfield/geometry.h"

namespace luxfield::lightfield {

struct Ray {
  Vec3 position_m;   // file unit is mm; converted
  Vec3 direction;    // unit
  double flux = 0;   // in the file's flux unit: radiant watts or lumens, see RayFile::flux_is_luminous
  std::optional<std::array<double, 3>> tristimulus;  // X Y Z in lm if the file carries them
};

struct RayFileHeader {
  std::int32_t version = 2013;
  std::int32_t creation_method = 0;           // 0 simulated, 1 measured
  std::optional<double> luminous_flux_lm;     // absent: unknown (NaN in the file)
  std::optional<double> radiant_flux_w;
  std::uint64_t ray_count = 0;
  std::string date_time;
  std::int32_t start_position = 0;
  std::int32_t spectral_id = 0;
  double wavelength_nm = 0;
  std::vector<std::string> texts;             // 9 blocks as UTF-8
  std::vector<std::string> additional_columns;
};

struct RayFile {
  RayFileHeader header;
  bool flux_is_luminous = false;
  std::vector<Ray> rays;
};

// Throws InputError naming file, field and value (wrong magic, version, flags that contradict each other, length that
// does not equal header + rays, non-finite rays, directions that are not unit within 1e-3 ...).
RayFile ReadTm25(const std::filesystem::path& path);
// Header only, also checked against the file's length: what `luxfield info` prints.
RayFileHeader ReadTm25Header(const std::filesystem::path& path);
void WriteTm25(const std::filesystem::path& path, const RayFile& file);

}  // namespace luxfield::lightfield
