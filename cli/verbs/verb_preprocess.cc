// luxfield preprocess X.lf.exr -o X.tab.exr
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "luxfield/cli/memory_option.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/verbs/verb_preprocess.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/parallel.h"
#include "luxfield/lightfield/light_field_file.h"
#include "luxfield/preprocess/reduction.h"
#include "luxfield/preprocess/table_files.h"

namespace luxfield::cli {
namespace {

constexpr char kReducedFrom[] = "reduced_from_sha256";  // in the provenance of a reduction

// X.lf.exr of X.tab.exr.
std::filesystem::path ReducedFile(const std::string& output) {
  return output.substr(0, output.size() - std::string(".tab.exr").size()) + ".lf.exr";
}

// Reduces the light field to what the scene's picture requires and writes it beside the tables.
core::Json Reduce(const PreprocessOptions& options, std::uint64_t seed,
                  lightfield::LightField& field) {
  const auto file = ReducedFile(options.output);
  std::error_code ignored;
  if (std::filesystem::equivalent(file, options.light_field, ignored))
    throw InputError(fmt::format(
        "{} would be overwritten by its own reduction; give -o another name", options.light_field));
  core::RequireOwn(file, options.output, kReducedFrom);
  const double max_error = ParseQuantity(options.max_error, "--max-error", {{"%", 0.01}});
  const scene::Scene scene = scene::ReadScene(options.scene);
  // The luminaires that show this file; all of them where none does, as for `render --light-field`.
  std::vector<scene::Pose> poses, all_poses;
  for (const auto& luminaire : scene.luminaires) {
    all_poses.push_back(luminaire.world_from_luminaire);
    if (std::filesystem::equivalent(luminaire.light_field, options.light_field, ignored))
      poses.push_back(luminaire.world_from_luminaire);
  }
  if (poses.empty()) poses = all_poses;
  if (poses.empty()) throw InputError(options.scene, "holds no luminaire", "add a [[luminaire]]");
  preprocess::SeenRectangle seen;
  std::vector<preprocess::Receiver> chosen_by, judged_by;
  for (const auto& pose : poses) {
    seen.Add(preprocess::SeenByTriangles(scene.geometry, field.geometry, pose));
    const auto add = [&](std::vector<preprocess::Receiver>& list, std::uint64_t stream) {
      const auto more = preprocess::PictureReceivers(scene, pose, options.receivers, stream);
      list.insert(list.end(), more.begin(), more.end());
    };
    add(chosen_by, 2 * seed);
    add(judged_by, 2 * seed + 1);
  }
  const auto reduction = preprocess::ReduceLightField(field, seen, chosen_by, judged_by, max_error);
  field = reduction.field;
  field.provenance[kReducedFrom] = core::Sha256OfFile(options.light_field);
  field.provenance["reduced_for_scene_sha256"] = core::Sha256OfFile(options.scene);
  field.provenance["reduced_max_rel_error"] = fmt::format("{}", max_error);
  lightfield::WriteLightField(file, field);

  core::Json rows = core::Json::array();
  fmt::print("{}: reduced for {}\n", file.string(), options.scene);
  fmt::print("  {:<10} {:<24} {:>7} {:>11} {:>10} {:>16} {:>9}\n", "step", "", "images", "texels",
             "memory", "texels/receiver", "error");
  for (const auto& step : reduction.steps) {
    fmt::print("  {:<10} {:<24} {:>7} {:>11} {:>10} {:>16.0f} {:>8.3g} %\n", step.name,
               step.setting, step.images, fmt::format("{} x {}", step.width, step.height),
               FormatBytes(step.bytes), step.texels_per_receiver, 100 * step.rel_error);
    rows.push_back({{"step", step.name},
                    {"setting", step.setting},
                    {"images", step.images},
                    {"width", step.width},
                    {"height", step.height},
                    {"memory_bytes", step.bytes},
                    {"texels_per_receiver", step.texels_per_receiver},
                    {"rel_rmse", step.rel_error}});
  }
  const double file_before = double(std::filesystem::file_size(options.light_field)),
               file_after = double(std::filesystem::file_size(core::ReadableAt(file)));
  const double saved =
      1 - reduction.core_s_per_receiver_after / reduction.core_s_per_receiver_before;
  fmt::print("  asked {:.3g} %; measured {:.3g} % over {} other receivers, bound {:.3g} %\n",
             100 * max_error, 100 * reduction.measured_error, judged_by.size(),
             100 * reduction.error_bound);
  fmt::print(
      "  file {} -> {}; closed form {:.3g} -> {:.3g} us per receiver ({:.0f} % saved); took {:.2f} "
      "core-s\n",
      FormatBytes(file_before), FormatBytes(file_after), 1e6 * reduction.core_s_per_receiver_before,
      1e6 * reduction.core_s_per_receiver_after, 100 * saved, reduction.core_s);
  return {{"file", file.string()},
          {"steps", rows},
          {"asked_rel_rmse", max_error},
          {"measured_rel_rmse", reduction.measured_error},
          {"bound_rel_rmse", reduction.error_bound},
          {"file_bytes_before", file_before},
          {"file_bytes_after", file_after},
          {"core_s_per_receiver_before", reduction.core_s_per_receiver_before},
          {"core_s_per_receiver_after", reduction.core_s_per_receiver_after},
          {"reduction_core_s", reduction.core_s}};
}

core::Json Run(const PreprocessOptions& options, std::uint64_t seed) {
  RequireExtension(options.output, ".tab.exr", "--output");
  const auto memory = MemoryLeft(options.memory);
  if (memory && !options.scene.empty())
    throw InputError(
        "--memory with --scene: a reduction holds the whole light field in memory; leave one of "
        "them "
        "out");
  core::Json reduction;
  preprocess::TableSource source{options.light_field, options.light_field, {}};
  if (!options.scene.empty()) {
    auto field = lightfield::ReadLightField(options.light_field);
    reduction = Reduce(options, seed, field);
    source.name = ReducedFile(options.output).string();
    source.light_field = core::ReadableAt(source.name);
  }
  source.sha256 = core::Sha256OfFile(source.light_field);
  const auto geometry = lightfield::LightFieldFile(source.light_field).only().geometry;
  source.images_at_once = core::Threads();
  if (memory)
    source.images_at_once =
        preprocess::TableImagesWithin(geometry, source.name, *memory, source.images_at_once);
  const auto points = preprocess::WriteTablesOf(source, options.output);
  const auto dark =
      std::count_if(points.begin(), points.end(), [](const auto& point) { return !point.lit; });
  const auto bytes = std::filesystem::file_size(core::ReadableAt(options.output));
  fmt::print("{}: {} summed-area tables of {} x {} texels, {}{}\n", options.output, points.size(),
             geometry.lattice.width, geometry.lattice.height, FormatBytes(double(bytes)),
             dark ? fmt::format("; {} images are all zero", dark) : "");
  core::Json json{{"images", points.size()}, {"all_zero_images", dark}, {"bytes", bytes}};
  if (!reduction.empty()) json["reduction"] = reduction;
  return json;
}

}  // namespace

void AddPreprocess(Program& program) {
  auto options = std::make_shared<PreprocessOptions>();
  CLI::App& verb = program.AddVerb("preprocess", [options, &program] {
    return Run(*options, program.common().seed.value_or(1));
  });
  AddPreprocessOptions(verb, options);
}

void AddPreprocessOptions(CLI::App& verb, const std::shared_ptr<PreprocessOptions>& options) {
  verb.add_option("LIGHT_FIELD", options->light_field, "The .lf.exr")
      ->required()
      ->check(InputFile({core::FileKind::kLightField}));
  verb.add_option("-o,--output", options->output, "The .tab.exr to write")
      ->required()
      ->check(OutputFile());
  verb.add_option("--scene", options->scene,
                  "A scene.toml: also write X.lf.exr beside X.tab.exr, reduced to what its picture "
                  "requires")
      ->check(InputFile({core::FileKind::kScene}));
  verb.add_option("--max-error", options->max_error,
                  "With --scene: largest relative RMSE of the picture's irradiance");
  verb.add_option("--receivers", options->receivers,
                  "With --scene: places of the picture that errors are taken over, per luminaire")
      ->check(CLI::Range(10, 1000000));
  AddMemoryOption(verb, options->memory, "fewer images at once, to the same file");
}

}  // namespace luxfield::cli
