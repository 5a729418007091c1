// Ray files of several programs by their content: TM-25, Zemax (.dat, .sdf), LightTools (binary and
// text) and Speos (.ray); layouts in docs/formats/ray-files.md.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "luxfield/formats/ray_file.h"

namespace luxfield::formats {

enum class RayFormat { kTm25, kZemax, kLightTools, kLightToolsText, kSpeos };

std::string RayFormatName(RayFormat format);  // "Zemax"

// None where the file is of none of them, or absent. Speos's has no mark: it is told by the ending
// .ray and a length of 28 + 32 n bytes.
std::optional<RayFormat> RayFormatOf(const std::filesystem::path& path);

// Any of them; beside the rays only kilobytes are held. Throws InputError naming file, field and
// value. Flux is luminous where the file says so; Speos's is, where all rays have one wavelength
// and its header states lumens. Wavelengths are checked and left out; spectral_id is 0 but of
// TM-25.
RayFile ReadRays(const std::filesystem::path& path);

// The same without keeping rays: the file but for its rays, which `take` is given as they are read.
// Speos's files, whose rays' energies count relative to their sum, are read twice.
RayFile StreamRays(const std::filesystem::path& path, const RayTaker& take);

// What a file says of itself and its number of rays, without reading them where that is possible.
struct RaySummary {
  RayFormat format = RayFormat::kTm25;
  RayFileHeader header;
  bool flux_is_luminous = false;
};
RaySummary SummariseRays(const std::filesystem::path& path);

// As WriteTm25 of a source. Zemax and LightTools hold flux in lm or W without wavelengths. Speos
// needs wavelengths: 555 nm for all rays, and its header both lumens and watts of that light.
void WriteRays(const std::filesystem::path& path, RayFormat format, const RayFileHeader& header,
               bool flux_is_luminous, bool tristimulus, const RaySource& next);

}  // namespace luxfield::formats
