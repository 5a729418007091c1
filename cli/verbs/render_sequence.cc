#include "luxfield/cli/verbs/render_sequence.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "luxfield/core/bytes.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/environment/environment_sequence.h"
#include "luxfield/render/film/film.h"
#include "luxfield/scene/geometry_hash.h"
#include "luxfield/version.h"

namespace luxfield::cli {
namespace {

constexpr char kMadeOf[] = "made_of_sha256";

std::string Numbered(const std::string& name, std::size_t frame) {
  if (name.empty()) return name;
  const std::filesystem::path path(name);
  return (path.parent_path() /
          fmt::format("{}_{:04}{}", path.stem().string(), frame, path.extension().string()))
      .string();
}

std::size_t EnvironmentFrames(const scene::Scene& scene) {
  if (!scene.environment || !environment::IsEnvironmentSequence(scene.environment->file)) return 1;
  return environment::ListEnvironmentFrames(scene.environment->file).size();
}

// What options do to the files of a frame.
void AddOptions(const RenderVerbOptions& options, core::ByteWriter& all) {
  const render::RenderOptions& how = options.render;
  all(how.estimator, how.samples_per_pixel, how.light_groups, how.background, how.antialias,
      how.seed, options.shadows, how.ShadowMapSize(), how.approximation_error,
      how.max_samples_per_image, how.knobs.Text(), how.knobs.strategies.Text(),
      how.knobs.environment.Text());
  all(options.png.png.empty(), options.png.tone,
      fmt::format("{}", options.png.exposure.value_or(-1)), options.radiance_map.empty(),
      options.irradiance_map.empty(), options.scale);
}

void AddPlacement(const scene::Camera& camera, const std::vector<scene::PlacedLamp>& lamps,
                  core::ByteWriter& all) {
  for (const scene::Vec3& v : {camera.position, camera.right, camera.up, camera.forward})
    all(v.x, v.y, v.z);
  all(camera.vertical_fov_deg, camera.width, camera.height);
  for (const scene::PlacedLamp& lamp : lamps) {
    const scene::Pose& pose = lamp.world_from_luminaire;
    all(pose.linear, pose.translation.x, pose.translation.y, pose.translation.z, lamp.scale);
  }
}

}  // namespace

std::size_t FrameCount(const RenderSetUp& set_up) {
  const RenderVerbOptions& options = set_up.options;
  const std::size_t moving = set_up.placements.size(), shown = EnvironmentFrames(set_up.scene);
  if (moving == 0 && shown == 1) return 0;
  for (const auto& [option, value] :
       {std::pair{"--error", options.error}, std::pair{"--time", options.time},
        std::pair{"--reference", options.reference}, std::pair{"--memory", options.memory}})
    if (!value.empty())
      throw InputError(options.scene,
                       moving == 0 ? "its environment is a sequence of frames"
                                   : "is rendered as a sequence of frames",
                       fmt::format("drop {}, which is for one picture", option));
  return moving > 0 ? moving : shown;
}

RenderVerbOptions OfFrame(const RenderVerbOptions& options, std::size_t n) {
  RenderVerbOptions numbered = options;
  for (std::string* name :
       {&numbered.output, &numbered.png.png, &numbered.radiance_map, &numbered.irradiance_map})
    *name = Numbered(*name, n);
  return numbered;
}

RenderedSequence::RenderedSequence(const render::Device& device, RenderSetUp set_up)
    : options_(std::move(set_up.options)),
      placements_(std::move(set_up.placements)),
      geometry_sha256_(scene::Sha256Of(set_up.scene.geometry)),
      lit_(device, std::move(set_up.scene)),
      sequence_(lit_, {options_.render, options_.sequence, placements_}) {}

render::Frame RenderedSequence::Render(std::size_t n) {
  render::Frame frame = sequence_.Render(n);
  frame.provenance[kMadeOf] = MadeOf(n);
  return frame;
}

std::string RenderedSequence::MadeOf(std::size_t n) const {
  core::ByteWriter all;
  all(std::string(LUXFIELD_VERSION), geometry_sha256_, lit_.device().info().name);
  for (const auto& [name, value] : lit_.provenance())
    if (!name.starts_with("environment")) all(name, value);  // of the frame shown
  AddOptions(options_, all);
  if (!options_.sequence.empty()) all(core::Sha256OfFile(options_.sequence));
  if (placements_.empty())
    AddPlacement(lit_.camera(), {}, all);
  else
    AddPlacement(placements_.at(n).camera, placements_[n].lamps, all);
  if (const render::PlacedEnvironment* environment = lit_.environment())
    all(environment->sequence ? core::Sha256OfFile(environment->sequence->frames().at(n))
                              : lit_.provenance().at("environment sha256"));
  return core::Sha256(all.bytes());
}

bool RenderedSequence::IsThere(std::size_t n) const {
  const RenderVerbOptions names = OfFrame(options_, n);
  std::error_code ignored;
  for (const std::string& name :
       {names.output, names.png.png, names.radiance_map, names.irradiance_map})
    if (!name.empty() && !std::filesystem::is_regular_file(name, ignored)) return false;
  try {
    const lightfield::Provenance there = render::ReadFrame(names.output).provenance;
    const auto made_of = there.find(kMadeOf);
    return made_of != there.end() && made_of->second == MadeOf(n);
  } catch (const InputError&) {
    return false;  // damaged, or another file: it is made anew
  }
}

core::Json RenderSequence(const render::Device& device, RenderSetUp set_up) {
  const RenderVerbOptions options = set_up.options;
  RenderedSequence sequence(device, std::move(set_up));
  core::Progress progress("frames", sequence.frame_count());
  core::Json frames = core::Json::array();
  const core::Stopwatch stopwatch;
  std::size_t kept = 0;
  for (std::size_t n = 0; n < sequence.frame_count(); ++n) {
    const RenderVerbOptions numbered = OfFrame(options, n);
    if (options.resume && sequence.IsThere(n)) {
      ++kept;
      frames.push_back({{"kept", true}});
    } else {
      const render::Frame frame = sequence.Render(n);
      WritePictures(frame, numbered);
      core::PutOutputsInPlace();
      frames.push_back(Describe(frame, numbered, device.info().name));
    }
    progress.Advance();
  }
  const double fps = static_cast<double>(frames.size() - kept) / stopwatch.WallSeconds();
  fmt::print("{} frames{}, {:.3g} a second with reading, tables and files\n", frames.size(),
             kept > 0 ? fmt::format(", {} of them there already", kept) : "", fps);
  return {{"frames", frames}, {"kept", kept}, {"fps", fps}};
}

}  // namespace luxfield::cli
