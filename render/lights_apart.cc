#include "luxfield/render/lights_apart.h"

#include <algorithm>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/measures.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"

namespace luxfield::render {

LightsApart::LightsApart(LitScene& scene, bool shadows)
    : scene_(scene), shadows_(shadows), lights_(scene.Lights()) {
  if (lights_.empty())
    throw InputError("the scene holds no light; add a [[light]] or an [environment]");
  scene_.Require({.cells = true});
  const scene::Camera& camera = scene_.camera();
  gbuffer_ = GBuffer(scene_.device(), camera.width, camera.height, scene_.geometry().glossy);
  PrimaryVisibility(scene_.device())
      .Render(scene_.geometry(), camera, 0, {0.5, 0.5}, gbuffer_)
      .Wait();
  lighting_ = Lighting(scene_.device(), gbuffer_);
  albedo_ = gbuffer_.albedo.Download<cl_float4>();
  const auto position = gbuffer_.position.Download<cl_float4>();
  for (std::size_t k = 0; k < position.size(); ++k) {
    if (position[k].s[3] == 0) continue;
    hit_.push_back(k);
    points_.push_back({position[k].s[0], position[k].s[1], position[k].s[2]});
  }
}

core::Image LightsApart::Spread(const core::Image& values, float missed) const {
  core::Image image(width(), height(), values.channels);
  std::fill(image.data.begin(), image.data.end(), missed);
  for (int c = 0; c < values.channels; ++c)
    for (std::size_t k = 0; k < hit_.size(); ++k) image.plane(c)[hit_[k]] = values.plane(c)[k];
  return image;
}

void LightsApart::LightOne(std::size_t light, const StrategySetting& setting, std::uint64_t seed,
                           const Buffer* light_share) {
  EstimatorOptions options;
  options.samples_per_pixel = setting.samples_per_light;
  options.seed = seed;
  options.stream = static_cast<std::uint32_t>(light);
  options.knobs.strategies.strategies = setting.strategies;
  options.knobs.strategies.light_share = setting.light_share;
  options.knobs.strategies.pilot = setting.pilot;
  const RayScene* rays = shadows_ ? scene_.geometry().rays.get() : nullptr;
  lighting_.light_share = light_share;
  scene_.mis().Light({gbuffer_, {.rays = rays}}, lights_[light].source, options, lighting_);
}

core::Image LightsApart::Radiance(const core::Rgb& scale) const {
  const bool glossy = gbuffer_.glossy();
  const auto light = (glossy ? lighting_.reflected : lighting_.irradiance).Download<cl_float4>();
  core::Image image(static_cast<int>(hit_.size()), 1, 3);
  for (std::size_t k = 0; k < hit_.size(); ++k)
    for (int c = 0; c < 3; ++c) {
      const double shown = glossy ? 1.0 : double{albedo_[hit_[k]].s[c]} * std::numbers::inv_pi;
      image.plane(c)[k] = static_cast<float>(scale[c] * shown * double{light[hit_[k]].s[c]});
    }
  return image;
}

Buffer LightsApart::Upload(const core::Image& light_share) const {
  std::vector<float> shares(gbuffer_.pixel_count(), 0.5f);
  for (std::size_t k = 0; k < hit_.size(); ++k) shares[hit_[k]] = light_share.data[k];
  return Buffer::From(scene_.device(), shares);
}

LightsApart::Picture LightsApart::Light(const StrategySetting& setting, std::uint64_t seed,
                                        std::span<const core::Image> light_shares) {
  Picture picture;
  picture.radiance = core::Image(static_cast<int>(hit_.size()), 1, 3);
  for (std::size_t light = 0; light < lights_.size(); ++light) {
    lighting_.Clear();
    const Buffer shares = light_shares.empty() ? Buffer() : Upload(light_shares[light]);
    scene_.device().Finish();
    const core::Stopwatch stopwatch;
    LightOne(light, setting, seed, shares ? &shares : nullptr);
    scene_.device().Finish();
    picture.wall_s += stopwatch.WallSeconds();
    picture.core_s += stopwatch.CoreSeconds();
    picture.parts.push_back(Radiance(lights_[light].scale));
    const core::Image& part = picture.parts.back();
    for (std::size_t k = 0; k < part.data.size(); ++k) picture.radiance.data[k] += part.data[k];
  }
  return picture;
}

std::vector<LightsApart::Part> LightsApart::LightParts(const StrategySetting& setting,
                                                       std::uint64_t seed) {
  std::vector<Part> parts;
  const Buffer shares(scene_.device(), gbuffer_.pixel_count() * sizeof(float));
  for (std::size_t light = 0; light < lights_.size(); ++light) {
    core::ThrowIfInterrupted();
    lighting_.Clear();
    LightOne(light, setting, seed, &shares);
    Part part{Radiance(lights_[light].scale), core::Image(static_cast<int>(hit_.size()), 1, 1)};
    const auto all = shares.Download<float>();
    for (std::size_t k = 0; k < hit_.size(); ++k) part.light_share.data[k] = all[hit_[k]];
    parts.push_back(std::move(part));
  }
  return parts;
}

core::Image LightsApart::FaceShares() {
  if (!scene_.environment()) return {};
  const auto shares = EnvironmentFaceShares(scene_.device(), gbuffer_, scene_.environment()->light);
  core::Image image(static_cast<int>(hit_.size()), 1, 6);
  for (std::size_t k = 0; k < hit_.size(); ++k)
    for (int face = 0; face < 6; ++face) image.plane(face)[k] = shares[6 * hit_[k] + face];
  return image;
}

core::Image MeanLightShare(std::span<const LightsApart::Part> parts) {
  core::Image mean(parts[0].light_share.width, 1, 1);
  core::Image weights = mean;
  for (const LightsApart::Part& part : parts) {
    const core::Image luminance = core::LuminanceImage(part.radiance);
    for (std::size_t k = 0; k < luminance.data.size(); ++k) {
      mean.data[k] += luminance.data[k] * part.light_share.data[k];
      weights.data[k] += luminance.data[k];
    }
  }
  for (std::size_t k = 0; k < mean.data.size(); ++k)
    mean.data[k] = weights.data[k] > 0 ? mean.data[k] / weights.data[k] : 0.5f;
  return mean;
}

}  // namespace luxfield::render
