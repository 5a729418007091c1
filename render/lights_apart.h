// A scene lit light by light by samples of two strategies (render/estimators/mis.h), on
// a resident G-buffer: what pictures and benches of the balance between strategies are made from.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/core/image.h"
#include "luxfield/render/lit_scene.h"

namespace luxfield::render {

struct StrategySetting {
  Strategies strategies = Strategies::kLobe;
  int samples_per_light = 256;  // per pixel
  float light_share = 0.5f;     // of kFixed
  int pilot = 64;
};

class LightsApart {
 public:
  // Every luminaire, area light and environment of a scene that outlives this, as its camera sees it.
  // Throws InputError where there is none, DeviceError.
  LightsApart(LitScene& scene, bool shadows);

  const std::vector<std::string>& names() const { return scene_.light_names(); }
  int width() const { return gbuffer_.width; }
  int height() const { return gbuffer_.height; }
  // Pixels that hit something, row by row.
  const std::vector<std::size_t>& hit() const { return hit_; }
  // Where: world, metres.
  const std::vector<lightfield::Vec3>& points() const { return points_; }
  // Values of the pixels that hit something, put where they belong, and `missed` elsewhere.
  core::Image Spread(const core::Image& values, float missed) const;

  struct Picture {
    // RGB, of the pixels that hit something: width hit().size(), height 1.
    core::Image radiance;
    std::vector<core::Image> parts;  // of each light
    double wall_s = 0, core_s = 0;   // lighting alone
  };
  // Of Strategies::kGiven, `light_shares` are alpha_l of each light, as Part's.
  Picture Light(const StrategySetting& setting, std::uint64_t seed,
                std::span<const core::Image> light_shares = {});

  struct Part {
    core::Image radiance;     // of one light, as Picture's
    core::Image light_share;  // alpha_l, 1 channel
  };
  // Throws Interrupted.
  std::vector<Part> LightParts(const StrategySetting& setting, std::uint64_t seed);

  // The environment's samples that follow the map, by face (environment/cube_map.h), as shares:
  // 6 channels; empty if there is no environment.
  core::Image FaceShares();

 private:
  void LightOne(std::size_t light, const StrategySetting& setting, std::uint64_t seed,
                const Buffer* light_share);
  // Of a share for every pixel that hit something.
  Buffer Upload(const core::Image& light_share) const;
  // What `lighting_` holds, each channel times the light's scale.
  core::Image Radiance(const core::Rgb& scale) const;

  LitScene& scene_;
  bool shadows_;
  std::vector<PlacedLight> lights_;
  GBuffer gbuffer_;
  Lighting lighting_;
  std::vector<cl_float4> albedo_;
  std::vector<std::size_t> hit_;
  std::vector<lightfield::Vec3> points_;
};

// Mean of alpha_l over the lights, weighed by the luminance that each brings to the pixel; 1/2 where
// none does. Of the pixels that hit something, as Part's.
core::Image MeanLightShare(std::span<const LightsApart::Part> parts);

}  // namespace luxfield::render
