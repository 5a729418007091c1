// luxfield merge SESSION -o X.meas.exr
#include <fmt/format.h>

#include <memory>

#include "cli/program.h"
#include "reconstruct/merge_session.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string session, output, estimator = "inverse-variance", lamp_level = "first-reference";
  std::string flat_field;
  std::vector<std::string> calibrations;
  bool skip_hashes = false;
};

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".meas.exr", "--output");
  const core::SessionReader session(options.session);
  reconstruct::MergeSessionOptions how;
  how.check_hashes = !options.skip_hashes;
  how.flat_field = options.flat_field;
  how.calibrations.assign(options.calibrations.begin(), options.calibrations.end());
  how.merge.estimator = options.estimator == "poisson" ? reconstruct::Estimator::kPoisson
                                                       : reconstruct::Estimator::kInverseVariance;
  how.lamp_level = options.lamp_level == "monitor" ? reconstruct::LampLevel::kMonitorUnity
                                                   : reconstruct::LampLevel::kFirstReference;
  reconstruct::MergeSessionSummary summary;
  reconstruct::MergeSessionToFile(session, options.output, how, &summary);
  fmt::print("{}: irradiance behind {} filters from {} frames\n", options.output,
             summary.positions, summary.frames);
  fmt::print("  lamp level            {:.5f} to {:.5f} of {} ({} reference frames), divided out\n",
             summary.least_lamp_factor, summary.largest_lamp_factor,
             options.lamp_level == "monitor" ? "the monitor's unity" : "its first reference",
             summary.reference_frames);
  fmt::print("  stage                 at most {:.2g} spacings off its plan by its own encoder\n",
             summary.largest_displacement);
  if (summary.flagged_frames)
    fmt::print("  flagged frames        {} (kept by capture although a check failed)\n",
               summary.flagged_frames);
  if (summary.missing_positions)
    fmt::print("  missing positions     {}: unknown, not zero\n", summary.missing_positions);
  return reconstruct::ToJson(summary);
}

}  // namespace

void AddMerge(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      "merge", "Merge the exposure brackets of a session into irradiance with error bars",
      [options] { return Run(*options); });
  verb.add_option("SESSION", options->session, "The session folder")->required();
  verb.add_option("-o,--output", options->output, "The .meas.exr to write")->required();
  verb.add_option("--estimator", options->estimator,
                  "inverse-variance: iterated, needs the camera's noise model; poisson: sums of "
                  "counts over sums of times")
      ->check(CLI::IsMember({"inverse-variance", "poisson"}));
  verb.add_option("--lamp-level", options->lamp_level,
                  "Which lamp the result belongs to: as it was at the session's first reference, "
                  "or at the level where "
                  "its monitor reads 1")
      ->check(CLI::IsMember({"first-reference", "monitor"}));
  verb.add_option(
      "--calibration", options->calibrations,
      "A .cal.json: a sensor's (`calibrate sensor`) in place of the gain, noise, black "
      "level, dark current, PRNU and saturation that the session states; the geometry's "
      "(`calibrate geometry`) in place of its delta, image_from_sensor and stage axes; "
      "or one of each");
  verb.add_option(
      "--flat-field", options->flat_field,
      "A .flat.exr (`calibrate flat-field`) in place of the vignetting that the session "
      "holds; its sigma takes the place of PRNU");
  verb.add_flag("--skip-hashes", options->skip_hashes,
                "Do not check every frame against the journal's SHA-256");
}

}  // namespace luxfield::cli
