// luxfield merge SESSION -o X.meas.exr, merge IMAGES... -o X.exr --calibration X.cal.json
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "luxfield/cli/memory_option.h"
#include "luxfield/cli/merge_pictures.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/verbs/verb_merge.h"
#include "luxfield/reconstruct/merge/merge_memory.h"
#include "luxfield/reconstruct/merge/merge_session_json.h"

namespace luxfield::cli {
namespace {

core::Json MergeSessionFolder(const MergeOptions& options) {
  RequireExtension(options.output, ".meas.exr", "--output");
  const session::SessionReader session(options.inputs[0]);
  const reconstruct::MergeSessionOptions how = HowToMerge(options);
  if (const auto memory = MemoryLeft(options.memory))
    RequireMemory(session.folder().string(), "one of its positions and its brackets", *memory,
                  reconstruct::MergeBytes(session, how));
  reconstruct::MergeSessionSummary summary;
  reconstruct::MergeSessionToFile(session, options.output, how, &summary);
  fmt::print("{}: irradiance behind {} filters from {} frames\n", options.output, summary.positions,
             summary.frames);
  fmt::print("  lamp level            {:.5f} to {:.5f} of {} ({} reference frames), divided out\n",
             summary.least_lamp_factor, summary.largest_lamp_factor,
             options.lamp_level == "monitor" ? "the monitor's unity" : "its first reference",
             summary.reference_frames);
  fmt::print("  stage                 at most {:.2g} spacings off its plan by its own encoder\n",
             summary.largest_displacement);
  if (summary.tilt) fmt::print("  planes not parallel   {}\n", TextOf(*summary.tilt));
  for (const auto& rung : summary.exposures)
    fmt::print("  exposure {:>10.6g} s {}\n", rung.exposure_s,
               rung.known
                   ? fmt::format("estimated {:.7g} +- {:.2g} s", rung.ratio.value * rung.exposure_s,
                                 rung.ratio.sigma * rung.exposure_s)
                   : "shares no pixels with the others: taken as it is");
  if (summary.flagged_frames)
    fmt::print(
        "  flagged frames        {} (kept by capture although a check failed); {} frames whose "
        "level contradicts their bracket's left out, {} brackets with them\n",
        summary.flagged_frames, summary.frames_left_out, summary.brackets_left_out);
  if (summary.flagged_darks)
    fmt::print("  flagged darks         {}: left out\n", summary.flagged_darks);
  if (summary.missing_positions)
    fmt::print("  missing positions     {}: unknown, not zero\n", summary.missing_positions);
  return reconstruct::ToJson(summary);
}

// Whether any of the options was given that only the other kind of input has.
void RefuseOptions(const CLI::App& verb, const std::vector<std::string>& names, const char* kind) {
  for (const std::string& name : names)
    if (verb.count(name))
      throw InputError(fmt::format("{} is not for {}; leave it out", name, kind));
}

core::Json Run(const MergeOptions& options, const CLI::App& verb) {
  if (options.inputs.size() == 1 && !std::filesystem::is_regular_file(options.inputs[0])) {
    RefuseOptions(verb, {"--exposure"}, "a session");
    return MergeSessionFolder(options);
  }
  RefuseOptions(verb, {"--estimator", "--lamp-level", "--flat-field", "--skip-hashes", "--memory"},
                "pictures");
  if (options.calibrations.size() != 1)
    throw InputError(options.inputs.front().string(),
                     "is no session's folder, and pictures merge through their camera's response",
                     "give --calibration X.cal.json, one, from `luxfield calibrate response`");
  return MergePictures({options.inputs, options.exposures_s, options.calibrations[0],
                        options.output, options.estimate_exposures});
}

}  // namespace

reconstruct::MergeSessionOptions HowToMerge(const MergeOptions& options) {
  reconstruct::MergeSessionOptions how;
  how.check_hashes = !options.skip_hashes;
  how.flat_field = options.flat_field;
  how.calibrations = options.calibrations;
  how.estimate_exposures = options.estimate_exposures;
  how.merge.estimator = options.estimator == "poisson" ? reconstruct::Estimator::kPoisson
                                                       : reconstruct::Estimator::kInverseVariance;
  how.lamp_level = options.lamp_level == "monitor" ? reconstruct::LampLevel::kMonitorUnity
                                                   : reconstruct::LampLevel::kFirstReference;
  return how;
}

void AddMerge(Program& program) {
  auto options = std::make_shared<MergeOptions>();
  auto verb_itself = std::make_shared<CLI::App*>();
  CLI::App& verb =
      program.AddVerb("merge", [options, verb_itself] { return Run(*options, **verb_itself); });
  *verb_itself = &verb;
  AddMergeOptions(verb, options);
}

void AddMergeOptions(CLI::App& verb, const std::shared_ptr<MergeOptions>& options) {
  verb.add_option("INPUT", options->inputs,
                  "The session folder, or PNG, JPEG or TIFF pictures of one scene with different "
                  "exposure times")
      ->required()
      ->check(InputFile({core::FileKind::kLightFieldSession, core::FileKind::kSession,
                         core::FileKind::kPhotograph}));
  verb.add_option("-o,--output", options->output, "The .meas.exr to write; for pictures an .exr")
      ->required()
      ->check(OutputFile());
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
          "or one of each; and the glare's (`calibrate glare`), which is stated in the file and "
          "not "
          "subtracted; for pictures their camera's response (`calibrate response`)")
      ->check(InputCalibration());
  verb.add_option(
          "--flat-field", options->flat_field,
          "A .flat.exr (`calibrate flat-field`) in place of the vignetting that the session "
          "holds; its sigma takes the place of PRNU")
      ->check(InputFile({core::FileKind::kFlatField}));
  verb.add_option("--exposure", options->exposures_s,
                  "Of pictures: exposure times in seconds, one for each (default: their Exif)")
      ->delimiter(',');
  verb.add_flag("--estimate-exposures", options->estimate_exposures,
                "Find the exposure times (of pictures: their ratios) from the pixels they share");
  verb.add_flag("--skip-hashes", options->skip_hashes,
                "Do not check every frame against the journal's SHA-256");
  AddMemoryOption(verb, options->memory,
                  "a session whose positions do not fit one by one is refused");
}

}  // namespace luxfield::cli
