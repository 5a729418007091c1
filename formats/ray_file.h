// TM-25 ray files (IES TM-25-13, binary version 2013; layout in docs/formats/tm25.md).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::formats {

struct Ray {
  lightfield::Vec3 position_m;  // file unit is mm; converted
  lightfield::Vec3 direction;   // unit to the file's precision (float32)
  double flux =
      0;  // in the file's flux unit: radiant watts or lumens, see RayFile::flux_is_luminous
  std::optional<std::array<double, 3>> tristimulus;  // X Y Z in lm if the file carries them
};

struct RayFileHeader {
  std::int32_t version = 2013;
  std::int32_t creation_method = 0;  // 0 simulated, 1 measured, -1 unknown (seen in vendor files)
  std::optional<double> luminous_flux_lm;  // absent: unknown (NaN or 0 in the file)
  std::optional<double> radiant_flux_w;
  std::uint64_t ray_count = 0;
  std::string date_time;            // as in the file, at most 28 bytes
  std::int32_t start_position = 0;  // 0 unknown .. 7
  std::int32_t spectral_id =
      0;                     // 0 none, 1 one wavelength, 2 per ray, 3 one table, 4 table per ray
  double wavelength_nm = 0;  // spectral_id 1 only, else 0
  std::vector<std::string> texts;               // 9 blocks as UTF-8
  std::vector<std::string> additional_columns;  // labels; the columns themselves are skipped
};

struct RayFile {
  RayFileHeader header;
  bool flux_is_luminous = false;  // a file that stores both fluxes per ray is read as luminous
  std::vector<Ray> rays;
};

// Reads in pieces; beside the rays themselves only kilobytes are held. Throws InputError naming
// file, field and value (wrong magic, version, flags that contradict each other, length that does
// not equal header + rays, non-finite rays, negative flux, directions that are not unit within 1e-3
// ...). Wavelengths, Stokes parameters, spectral tables and additional columns are validated where
// that is possible and skipped.
RayFile ReadTm25(const std::filesystem::path& path);

// What a reader hands rays to, one by one, in the file's order.
using RayTaker = std::function<void(const Ray& ray)>;

// The same without keeping rays: the file but for its rays, which `take` is given.
RayFile StreamTm25(const std::filesystem::path& path, const RayTaker& take);

// Header only, also checked against the file's length: what `luxfield info` prints.
RayFileHeader ReadTm25Header(const std::filesystem::path& path);

// What a writer takes rays from: fills the next one, false behind the last.
using RaySource = std::function<bool(Ray& ray)>;

// Writes header.ray_count rays of the source, a piece at a time; with `tristimulus` X and Z, which
// every ray then needs. Throws InputError for what the format cannot hold, among it another number
// of rays.
void WriteTm25(const std::filesystem::path& path, const RayFileHeader& header,
               bool flux_is_luminous, bool tristimulus, const RaySource& next);

// Writes position, direction and flux as float32 (and X, Z if every ray has a tristimulus value,
// which needs luminous flux); header.ray_count is taken from the rays. Unknown fluxes become NaN
// 0x7FC00001. Spectral tables and additional columns are not written: spectral_id must be 0 or 1.
// Throws InputError for what the format cannot hold.
void WriteTm25(const std::filesystem::path& path, const RayFile& file);

}  // namespace luxfield::formats
