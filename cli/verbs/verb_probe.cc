// luxfield probe PROBE.toml -o X.exr
#include <fmt/format.h>

#include <memory>
#include <numbers>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/core/colour.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/probe.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/rim_picture.h"
#include "luxfield/render/film/film.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string description, output, rim_picture;
  int face_size = 0;
  bool no_fill = false;
};

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".exr", "--output");
  if (!options.rim_picture.empty()) RequireExtension(options.rim_picture, ".png", "--rim-picture");
  const auto description = reconstruct::ReadProbeDescription(options.description);
  const auto picture = reconstruct::MergeProbe(description);
  const auto found = reconstruct::FindRim(picture, description);
  // Drawn before it is refused: the user shall see what was taken for the rim.
  if (!options.rim_picture.empty())
    render::WritePng(options.rim_picture, reconstruct::DrawRim(picture.radiance, found));
  const auto probe =
      reconstruct::MakeProbe(picture, description, found, {options.face_size, !options.no_fill});
  reconstruct::WriteProbe(options.output, probe, description);

  const auto& rim = probe.rim;
  const core::Rgb up = environment::Irradiance(probe.radiance, {0, 0, 1});
  const core::Rgb mean = environment::MeanRadiance(probe.radiance);
  constexpr double kSphere = 4 * std::numbers::pi;
  fmt::print("{}: cube map of 6 x {} x {} from {}\n", options.output, probe.radiance.face_size,
             probe.radiance.face_size,
             description.merged ? "a merged picture"
                                : fmt::format("{} exposures", description.exposures.size()));
  fmt::print(
      "  rim          centre ({:.3f} +- {:.3f}, {:.3f} +- {:.3f}), radius {:.3f} +- {:.3f} "
      "pixels; seen on {} of {} rays, on {} within {:.2g} pixels of it, residual {:.3f}; edges "
      "along {:.0f} % of it, along {:.0f} % of other circles ({:.1f} standard deviations)\n",
      rim.circle.x, rim.sigma.x, rim.circle.y, rim.sigma.y, rim.circle.radius, rim.sigma.radius,
      rim.used, rim.rays, rim.on_rim, reconstruct::RimTolerance(rim.circle), rim.residual_px,
      100 * rim.evidence.share, 100 * rim.evidence.by_chance, rim.evidence.standing);
  if (picture.lower_bounds > 0)
    fmt::print("  saturated    {} pixels of the photograph hold lower bounds\n",
               picture.lower_bounds);
  fmt::print("  shown        {:.3f} sr by {} pixels, {:.2f} % of the sphere; {:.2f} % filled\n",
             probe.seen_sr, probe.used_pixels, 100 * probe.seen_sr / kSphere,
             100 * probe.filled_sr / kSphere);
  fmt::print("  radiance     mean luminance {:.6g} {}; irradiance facing up {:.6g}\n",
             core::Luminance(mean), description.unit, core::Luminance(up));
  if (probe.clamped_share > 0)
    fmt::print("  negative     texels set to 0 add {:.2g} of the energy\n", probe.clamped_share);
  return {{"face_size", probe.radiance.face_size},
          {"rim_px", {rim.circle.x, rim.circle.y, rim.circle.radius}},
          {"rim_sigma_px", {rim.sigma.x, rim.sigma.y, rim.sigma.radius}},
          {"rays", rim.rays},
          {"used_rays", rim.used},
          {"rim_share", rim.evidence.share},
          {"rim_share_by_chance", rim.evidence.by_chance},
          {"rim_standing", rim.evidence.standing},
          {"lower_bound_pixels", picture.lower_bounds},
          {"seen_sr", probe.seen_sr},
          {"filled_sr", probe.filled_sr},
          {"clamped_share", probe.clamped_share},
          {"mean_radiance", mean},
          {"irradiance_up", up}};
}

}  // namespace

void AddProbe(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("probe", [options] { return Run(*options); });
  verb.add_option("PROBE", options->description, "The probe.toml (docs/formats/probe.md)")
      ->required();
  verb.add_option("-o,--output", options->output, "The .exr to write")
      ->required()
      ->check(OutputFile());
  verb.add_option("--rim-picture", options->rim_picture,
                  "A .png of the photograph with what was taken for the rim")
      ->check(OutputFile());
  verb.add_option("--face-size", options->face_size,
                  "Texels along a side of a cube face, 0 for half of the rim's radius in pixels")
      ->check(CLI::Range(0, 16384));
  verb.add_flag("--no-fill", options->no_fill, "Leave black what a ball does not show");
}

}  // namespace luxfield::cli
