#include "luxfield/bench/lights_apart.h"

#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/stopwatch.h"

namespace luxfield::bench {

LightsApart::LightsApart(const render::Device& device, const scene::Scene& scene, bool shadows)
    : scene_(device, scene), shadows_(shadows) {
  for (const auto& luminaire : scene.luminaires) names_.push_back(luminaire.name);
  for (const auto& light : scene.area_lights) names_.push_back(light.name);
  if (scene.environment) names_.push_back("environment");
  if (names_.empty())
    throw InputError(scene.file.string(), "holds no light", "add a [[light]] or an [environment]");
  scene_.Require({.cells = true});
  lights_ = scene_.Lights();
  gbuffer_ =
      render::GBuffer(device, scene.camera.width, scene.camera.height, scene_.geometry().glossy);
  render::PrimaryVisibility(device)
      .Render(scene_.geometry(), scene.camera, 0, {0.5, 0.5}, gbuffer_)
      .Wait();
  lighting_ = render::Lighting(device, gbuffer_);
  albedo_ = gbuffer_.albedo.Download<cl_float4>();
  const auto position = gbuffer_.position.Download<cl_float4>();
  for (std::size_t k = 0; k < position.size(); ++k)
    if (position[k].s[3] != 0) hit_.push_back(k);
}

void LightsApart::LightOne(std::size_t light, const StrategySetting& setting, std::uint64_t seed,
                           const render::Buffer* light_share) {
  render::EstimatorOptions options;
  options.samples_per_pixel = setting.samples_per_light;
  options.seed = seed;
  options.stream = static_cast<std::uint32_t>(light);
  options.knobs.strategies.strategies = setting.strategies;
  options.knobs.strategies.light_share = setting.light_share;
  options.knobs.strategies.pilot = setting.pilot;
  const render::RayScene* rays = shadows_ ? scene_.geometry().rays.get() : nullptr;
  lighting_.light_share = light_share;
  scene_.mis().Light({gbuffer_, {.rays = rays}}, lights_[light].source, options, lighting_);
}

core::Image LightsApart::Radiance(double scale) const {
  const bool glossy = gbuffer_.glossy();
  const auto light = (glossy ? lighting_.reflected : lighting_.irradiance).Download<cl_float4>();
  core::Image image(static_cast<int>(hit_.size()), 1, 3);
  for (std::size_t k = 0; k < hit_.size(); ++k)
    for (int c = 0; c < 3; ++c) {
      const double shown = glossy ? 1.0 : double{albedo_[hit_[k]].s[c]} * std::numbers::inv_pi;
      image.plane(c)[k] = static_cast<float>(scale * shown * double{light[hit_[k]].s[c]});
    }
  return image;
}

render::Buffer LightsApart::Upload(const core::Image& light_share) const {
  std::vector<float> shares(gbuffer_.pixel_count(), 0.5f);
  for (std::size_t k = 0; k < hit_.size(); ++k) shares[hit_[k]] = light_share.data[k];
  return render::Buffer::From(scene_.device(), shares);
}

LightsApart::Picture LightsApart::Light(const StrategySetting& setting, std::uint64_t seed,
                                        std::span<const core::Image> light_shares) {
  Picture picture;
  picture.radiance = core::Image(static_cast<int>(hit_.size()), 1, 3);
  for (std::size_t light = 0; light < names_.size(); ++light) {
    lighting_.Clear();
    const render::Buffer shares =
        light_shares.empty() ? render::Buffer() : Upload(light_shares[light]);
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
  const render::Buffer shares(scene_.device(), gbuffer_.pixel_count() * sizeof(float));
  for (std::size_t light = 0; light < names_.size(); ++light) {
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
  const auto shares =
      render::EnvironmentFaceShares(scene_.device(), gbuffer_, scene_.environment()->light);
  core::Image image(static_cast<int>(hit_.size()), 1, 6);
  for (std::size_t k = 0; k < hit_.size(); ++k)
    for (int face = 0; face < 6; ++face) image.plane(face)[k] = shares[6 * hit_[k] + face];
  return image;
}

}  // namespace luxfield::bench
