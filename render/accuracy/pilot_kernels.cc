#include "luxfield/render/accuracy/pilot_kernels.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "luxfield/core/progress.h"
#include "luxfield/render/accuracy/accuracy.h"
#include "luxfield/render/accuracy/car2.h"
#include "luxfield/render/accuracy/lamp_tables.h"
#include "luxfield/render/device/program_cache.h"
#include "luxfield/render/scene/ray_scene.h"

namespace luxfield::render {
namespace {

constexpr int kWidth = 64, kHeight = 48, kSamples = 8;  // work-groups as pilots have them

GBuffer SomeReceivers(const Device& device, bool glossy) {
  GBuffer road = RoadGBuffer(device, kWidth, kHeight);
  if (!glossy) return road;
  GBuffer gbuffer(device, kWidth, kHeight, glossy);
  gbuffer.position = std::move(road.position);
  gbuffer.normal = std::move(road.normal);
  gbuffer.albedo.FillZero();
  gbuffer.gloss.FillZero();
  return gbuffer;
}

std::unique_ptr<RayScene> SomeRays(const Device& device) {
  scene::Geometry geometry;
  geometry.materials.emplace_back();
  scene::AppendBox(scene::Translation({0, -0.6, 2}) * scene::Scaling({0.1, 0.1, 0.1}), 0, geometry);
  return MakeRayScene(device, geometry);
}

}  // namespace

bool CompilesWhileRunning(const Device& device) { return KeepsKernelsItself(device.info()); }

std::optional<core::CacheKey> PilotKernelsKey(const Device& device, PilotSurfaces surfaces) {
  return core::KeyOfThisBuild(
      "programs", fmt::format("{}\npilots of {} surfaces", device.info().name,
                              surfaces == PilotSurfaces::kGlossy ? "glossy" : "Lambertian"));
}

void CompilePilotKernels(const Device& device, PilotSurfaces surfaces) {
  const bool glossy = surfaces == PilotSurfaces::kGlossy;
  const auto field = SyntheticCar2({3, 3, 64, 1});
  const GBuffer gbuffer = SomeReceivers(device, glossy);
  const auto rays = SomeRays(device);
  const LampTables tables = BuildLampTables(
      field, gbuffer, {.sat = true, .cells = true, .volume = !glossy}, /*volume_error=*/0.1);
  const LuminaireOnDevice luminaire(device, field, tables.view());
  Lighting lighting(device, gbuffer);
  EstimatorOptions options;
  options.samples_per_pixel = kSamples;
  std::vector<EstimatorTraits> estimators = EstimatorList();
  std::reverse(estimators.begin(), estimators.end());
  // Those that need cells share their kernel with the estimator that is tried first.
  std::stable_partition(estimators.begin(), estimators.end(),
                        [](const EstimatorTraits& traits) { return !traits.needs.cells; });
  for (const EstimatorTraits& traits : estimators) {
    if (traits.for_comparison || !StatesItsError(traits, glossy, /*shadows=*/true)) continue;
    core::ThrowIfInterrupted();
    lighting.Clear();
    MakeEstimator(traits.name, device)
        ->Light({gbuffer, {.rays = rays.get()}}, PosedLuminaire{luminaire}, options, lighting);
    device.Finish();
  }
}

}  // namespace luxfield::render
