// Fuzz targets: bytes that claim to be ray files. They end in an InputError or in rays whose
// numbers are finite, as many as the file's summary says, which are written and read back.
#pragma once

#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "luxfield/core/error.h"
#include "luxfield/formats/ray_formats.h"
#include "luxfield/formats/tm25_layout.h"

namespace luxfield::fuzz {

// A file of this process, in memory where the system has such a folder.
inline std::filesystem::path ScratchFile(const std::string& ending) {
  static const std::filesystem::path folder = std::filesystem::exists("/dev/shm")
                                                  ? std::filesystem::path("/dev/shm")
                                                  : std::filesystem::temp_directory_path();
  return folder / ("luxfield_fuzz_" + std::to_string(getpid()) + ending);
}

// Gone at the end, whatever is thrown.
struct ScratchGuard {
  std::filesystem::path path;
  ~ScratchGuard() {
    std::error_code error;
    std::filesystem::remove(path, error);
  }
};

inline void RequireRays(const formats::RayFile& file) {
  for (const formats::Ray& ray : file.rays)
    if (!std::isfinite(ray.flux) || ray.flux < 0 ||
        !std::isfinite(lightfield::Length(ray.position_m)) ||
        std::abs(lightfield::Length(ray.direction) - 1) > 2e-3)
      std::abort();
}

inline void RayFileOf(std::string_view bytes, const std::string& ending) {
  const ScratchGuard input{ScratchFile(ending)};
  std::ofstream(input.path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  try {
    const formats::RayFile file = formats::ReadRays(input.path);
    RequireRays(file);
    if (formats::SummariseRays(input.path).header.ray_count != file.rays.size()) std::abort();
    if (file.rays.empty()) return;
    const ScratchGuard output{ScratchFile(".again" + ending)};
    formats::RayFileHeader header = file.header;
    header.ray_count = file.rays.size();
    header.spectral_id = 0;
    header.additional_columns.clear();
    std::size_t at = 0;
    formats::WriteRays(output.path, *formats::RayFormatOf(input.path), header,
                       file.flux_is_luminous, false, [&](formats::Ray& ray) {
                         if (at == file.rays.size()) return false;
                         ray = file.rays[at++];
                         ray.tristimulus.reset();
                         return true;
                       });
    const formats::RayFile again = formats::ReadRays(output.path);
    RequireRays(again);
    if (again.rays.size() != file.rays.size()) std::abort();
  } catch (const InputError&) {
  }
}

// Header and flags, and what follows the 36 000 bytes of texts, which are zero.
inline void Tm25File(std::string_view input) {
  namespace tm25 = formats::tm25;
  constexpr std::size_t kBefore = tm25::kHeaderBytes + tm25::kFlagBytes;
  std::string bytes(input.substr(0, kBefore));
  if (input.size() > kBefore)
    bytes.append(tm25::kTexts * tm25::kTextBytes, '\0').append(input.substr(kBefore));
  RayFileOf(bytes, ".tm25ray");
}

inline void ZemaxFile(std::string_view input) { RayFileOf(input, ".dat"); }
inline void LightToolsFile(std::string_view input) { RayFileOf(input, ".ltrf"); }
inline void LightToolsTextFile(std::string_view input) { RayFileOf(input, ".txt"); }
inline void SpeosFile(std::string_view input) { RayFileOf(input, ".ray"); }

}  // namespace luxfield::fuzz
