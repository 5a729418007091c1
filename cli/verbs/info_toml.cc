// luxfield info of a plan, a lab or a scene.
#include <fmt/format.h>

#include "luxfield/capture/plan/plan.h"
#include "luxfield/cli/info.h"
#include "luxfield/cli/verbs/info_geometry.h"
#include "luxfield/core/config.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/scene/scene.h"

namespace luxfield::cli {
namespace {

using core::Json;

std::string ModelName(scene::ClassicalModel model) {
  return model == scene::ClassicalModel::kPoint    ? "point"
         : model == scene::ClassicalModel::kLinear ? "linear"
                                                   : "area";
}

// Lights of photometric files, a line each; arrays as often as they stand.
Json ClassicalLights(const scene::Scene& scene) {
  Json lights = Json::array();
  for (const scene::ClassicalLight& light : scene.classical_lights) {
    const std::string model = ModelName(light.model), file = light.distribution.string();
    Json json = {{"name", light.name}, {"model", model}, {"distribution", file}};
    std::string size;
    if (light.size_m) {
      json["size_m"] = *light.size_m;
      size = fmt::format(", {:g} x {:g} m", (*light.size_m)[0], (*light.size_m)[1]);
    } else if (light.model != scene::ClassicalModel::kPoint) {
      size = ", as large as the file's opening";
    }
    fmt::print("  {:<12} '{}' by {}{}\n", model, light.name, file, size);
    lights.push_back(std::move(json));
  }
  return lights;
}

Json InfoScene(const std::string& path) {
  const scene::Scene scene = scene::ReadScene(path);
  std::size_t triangles = scene.geometry.triangles.size();
  fmt::print("{}: scene\n", path);
  fmt::print("  triangles    {}\n  luminaires   {}\n  camera       {} x {}\n", triangles,
             scene.luminaires.size(), scene.camera.width, scene.camera.height);
  Json classical_lights = ClassicalLights(scene);
  Json left_out = Json::array();
  for (const auto& [file, features] : scene.left_out) {
    for (const std::string& feature : features)
      fmt::print("  left out     {}: {}\n", file.string(), feature);
    left_out.push_back({{"file", file.string()}, {"features", features}});
  }
  return {{"kind", "scene"},
          {"triangles", triangles},
          {"luminaires", scene.luminaires.size()},
          {"classical_lights", std::move(classical_lights)},
          {"left_out", left_out}};
}

Json InfoPlan(const std::string& path) {
  const capture::Plan plan = capture::ReadPlan(path);
  fmt::print("{}: capture plan '{}', {} rig, {} filters\n", path, plan.name,
             rig::RigKindName(plan.rig), plan.dual ? "dual" : "basis");
  PrintGeometry(plan.geometry);
  fmt::print(
      "  exposures    {:.6g} to {:.6g} s in steps of {:.3g}; `luxfield plan` expands it for a "
      "lab\n",
      plan.exposure.min_s, plan.exposure.max_s, plan.exposure.ratio);
  Json json = GeometryJson(plan.geometry);
  json["kind"] = "plan";
  return json;
}

Json InfoLab(const std::string& path) {
  const hal::Devices devices = hal::MakeDevices(path);
  const auto camera = devices.camera->capabilities();
  fmt::print("{}: lab, {} rig, delta {:.6g} m; `luxfield devices {}` opens it\n", path,
             rig::RigKindName(devices.rig.kind), devices.rig.delta_m, path);
  fmt::print("  camera       {}, {} x {}, {} bit\n", devices.camera->identity(), camera.width,
             camera.height, camera.bits);
  fmt::print("  filter       {}, spacing {:.6g} mm\n", devices.rig.basis.name(),
             1e3 * devices.rig.spacing_m);
  return {{"kind", "lab"}, {"delta_m", devices.rig.delta_m}, {"spacing_m", devices.rig.spacing_m}};
}

}  // namespace

// Plans, labs and scenes share an extension; their first table tells.
core::Json InfoToml(const std::string& path) {
  const core::Config config = core::Config::FromFile(path);
  if (config.Has("plan")) return InfoPlan(path);
  if (config.Has("lab")) return InfoLab(path);
  return InfoScene(path);
}

void AddInfo(Program& program) { AddInfo(program, InfoToml); }

}  // namespace luxfield::cli
