// luxfield export: what its verb files share.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/cli/program.h"
#include "luxfield/formats/export_check.h"
#include "luxfield/formats/ray_formats.h"
#include "luxfield/lightfield/posed_light_field.h"
#include "luxfield/web/lamp_volume_fit.h"

namespace luxfield::cli {

struct ExportOptions {
  std::string field, output, format;
  bool check = false;
  std::uint64_t seed = 1;
  // Rays.
  std::optional<std::uint64_t> rays;
  // Intensities.
  std::string sigma;  // none: empty
  std::optional<double> distance_m, plane_step_deg, angle_step_deg;
  // Pictures; metres in the luminaire's frame. --distance is that of the eye where none is named.
  std::string view = "perspective";
  std::vector<double> eye, look_at, up, extent_m;
  std::vector<int> size;
  std::optional<double> fov_deg;
  std::optional<int> samples;
};

struct ExportFormat {
  enum class Kind { kRays, kIntensities, kPicture, kPage, kBridge };
  std::string_view name;  // of --format and --to
  Kind kind;
  std::vector<std::string_view> endings;  // that its file may have
  std::optional<formats::RayFormat> rays = {};
};

using Fields = std::vector<lightfield::PosedLightField>;

inline constexpr std::uint64_t kDefaultRays = 1000000;
inline constexpr int kDefaultSamples = 4;

core::Json ExportRays(const ExportOptions& options, const ExportFormat& format,
                      const Fields& fields);
core::Json ExportIntensities(const ExportOptions& options, const ExportFormat& format,
                             const Fields& fields);
core::Json ExportPicture(const ExportOptions& options, const ExportFormat& format,
                         const Fields& fields);

core::Json ExportPage(const ExportOptions& options, const ExportFormat& format,
                      const Fields& fields);
core::Json ExportBridge(const ExportOptions& options, const ExportFormat& format,
                        const Fields& fields);

// The field of a lamp that has one, in the luminaire's own frame. Throws InputError naming the file of
// others.
const lightfield::LightField& OnlyField(const ExportOptions& options, const Fields& fields,
                                        const char* what);

// A page's or a glTF file's volume, as read back, at the receivers that its error was measured at.
formats::ExportCheck CheckVolume(const web::FittedVolume& read, const lightfield::LightField& field,
                                 const web::FitOptions& fit);
// Prints how far it is off, and the rows of --json.
core::Json ReportZones(const web::FittedVolume& fitted);

// Prints the checks and returns their rows of --json. Throws an Error of exit code 1 where one does
// not hold.
core::Json ReportChecks(const ExportOptions& options, const ExportFormat& format,
                        const std::vector<formats::ExportCheck>& checks);

std::string UnitOf(const Fields& fields);  // "lm"

}  // namespace luxfield::cli
