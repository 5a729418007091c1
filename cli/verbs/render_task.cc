#include "luxfield/cli/verbs/render_task.h"

#include <fmt/format.h>

#include <set>
#include <utility>

#include "luxfield/cli/verbs/render_sequence.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"
#include "luxfield/environment/environment_sequence.h"
#include "luxfield/scene/geometry_hash.h"
#include "luxfield/shard/piece_label.h"

namespace luxfield::cli {
namespace {

// The names of a frame's files that the options ask for, in the order of a piece's.
std::vector<std::string*> NamesIn(RenderVerbOptions& options) {
  std::vector<std::string*> names;
  for (std::string* name :
       {&options.output, &options.png.png, &options.radiance_map, &options.irradiance_map})
    if (!name->empty()) names.push_back(name);
  return names;
}

void RequireOneDevice(std::span<const shard::Piece> pieces) {
  const auto device_of = [](const shard::Piece& piece) {
    return core::Field<std::string>(piece.figures, "device", piece.files[0].string());
  };
  for (const shard::Piece& piece : pieces)
    if (device_of(piece) != device_of(pieces[0]))
      throw InputError(piece.files[0].string(),
                       fmt::format("was lit by {} and {} by {}", device_of(piece),
                                   pieces[0].files[0].string(), device_of(pieces[0])),
                       "do all shards on devices of one kind, and this one again");
}

}  // namespace

RenderTask::RenderTask(RenderSetUp set_up, int threads)
    : set_up_(std::move(set_up)),
      threads_(threads),
      frames_(static_cast<int>(FrameCount(set_up_))) {
  if (frames_ == 0)
    throw InputError(set_up_.options.scene, "makes one picture, and a job is cut into frames",
                     "give options.sequence, an environment of several frames, or run the verb");
}

std::vector<std::filesystem::path> RenderTask::Inputs() const {
  std::set<std::filesystem::path> files{set_up_.options.scene};
  if (!set_up_.options.sequence.empty()) files.insert(set_up_.options.sequence);
  for (const scene::Luminaire& luminaire : set_up_.scene.luminaires)
    for (const auto& file : {luminaire.light_field, luminaire.tables})
      if (!file.empty()) files.insert(file);
  for (const scene::ClassicalLight& light : set_up_.scene.classical_lights)
    files.insert(light.distribution);
  if (const auto& environment = set_up_.scene.environment) {
    if (std::filesystem::is_regular_file(environment->file)) files.insert(environment->file);
    if (environment::IsEnvironmentSequence(environment->file))
      for (const auto& frame : environment::ListEnvironmentFrames(environment->file))
        files.insert(frame);
  }
  return {files.begin(), files.end()};
}

core::Json RenderTask::Whole() const {
  return {{"geometry_sha256", scene::Sha256Of(set_up_.scene.geometry)}, {"frames", frames_}};
}

std::vector<std::string> RenderTask::Endings(int first, int last) const {
  std::vector<std::string> endings;
  for (int n = first; n < last; ++n) {
    endings.push_back(fmt::format(".{:04}.exr", n));
    if (!set_up_.options.png.png.empty()) endings.push_back(fmt::format(".{:04}.png", n));
    if (!set_up_.options.radiance_map.empty())
      endings.push_back(fmt::format(".{:04}.radiance.png", n));
    if (!set_up_.options.irradiance_map.empty())
      endings.push_back(fmt::format(".{:04}.irradiance.png", n));
  }
  return endings;
}

core::Json RenderTask::Run(const core::Json& whole, int first, int last,
                           std::span<const std::filesystem::path> files) const {
  const render::Device device = render::Device::Open(set_up_.options.device, threads_);
  RenderedSequence sequence(device, set_up_);
  const std::string& scene = set_up_.options.scene;
  if (core::Field<std::string>(whole, "geometry_sha256", scene) != sequence.geometry_sha256() ||
      core::Field<int>(whole, "frames", scene) != frames_)
    throw InputError(scene, "its meshes, textures or frames have changed since the job was planned",
                     "put them back, or plan the job anew in another folder");
  auto file = files.begin();
  for (int n = first; n < last; ++n) {
    RenderVerbOptions options = set_up_.options;
    for (std::string* name : NamesIn(options)) *name = (file++)->string();
    WritePictures(sequence.Render(n), options);
  }
  return {{"device", device.info().name}};
}

void RenderTask::Join(const core::Json&, std::span<const shard::Piece> pieces) const {
  RequireOneDevice(pieces);
  int n = 0;
  for (const shard::Piece& piece : pieces)
    for (auto file = piece.files.begin(); file != piece.files.end(); ++n) {
      RenderVerbOptions options = OfFrame(set_up_.options, n);
      for (const std::string* name : NamesIn(options)) {
        const std::filesystem::path from = *file++;
        core::WriteAtomically(*name, [&](const std::filesystem::path& temporary) {
          std::filesystem::copy_file(from, temporary,
                                     std::filesystem::copy_options::overwrite_existing);
          shard::RemoveLabel(temporary);
        });
      }
      core::PutOutputsInPlace();
    }
}

std::vector<std::filesystem::path> RenderTask::Outputs() const {
  std::vector<std::filesystem::path> outputs;
  for (int n = 0; n < frames_; ++n) {
    RenderVerbOptions options = OfFrame(set_up_.options, n);
    for (const std::string* name : NamesIn(options)) outputs.emplace_back(*name);
  }
  return outputs;
}

}  // namespace luxfield::cli
