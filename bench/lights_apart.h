// A scene lit light by light by samples of two strategies (render/estimators/mis.h), on
// a resident G-buffer: what benches and pictures of the balance between strategies are made from.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/render/lit_scene.h"
#include "luxfield/scene/scene.h"

namespace luxfield::bench {

struct StrategySetting {
  render::Strategies strategies = render::Strategies::kLobe;
  int samples_per_light = 256;  // per pixel
  float light_share = 0.5f;     // of kFixed
  int pilot = 64;
};

class LightsApart {
 public:
  // Every luminaire, area light and environment of the scene, which must have one. Throws
  // InputError, DeviceError.
  LightsApart(const render::Device& device, const scene::Scene& scene, bool shadows);

  const std::vector<std::string>& names() const { return names_; }  // of the lights
  int width() const { return gbuffer_.width; }
  int height() const { return gbuffer_.height; }
  // Pixels that hit something, row by row.
  const std::vector<std::size_t>& hit() const { return hit_; }

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
  std::vector<Part> LightParts(const StrategySetting& setting, std::uint64_t seed);

  // The environment's samples that follow the map, by face (environment/cube_map.h), as shares:
  // 6 channels; empty if there is no environment.
  core::Image FaceShares();

 private:
  void LightOne(std::size_t light, const StrategySetting& setting, std::uint64_t seed,
                const render::Buffer* light_share);
  // Of a share for every pixel that hit something.
  render::Buffer Upload(const core::Image& light_share) const;
  // What `lighting_` holds, times the light's scale.
  core::Image Radiance(double scale) const;

  render::LitScene scene_;
  bool shadows_;
  std::vector<std::string> names_;
  std::vector<render::PlacedLight> lights_;
  render::GBuffer gbuffer_;
  render::Lighting lighting_;
  std::vector<cl_float4> albedo_;
  std::vector<std::size_t> hit_;
};

}  // namespace luxfield::bench
