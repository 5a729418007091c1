// The share of a luminaire's light that reaches a receiver past what shadow rays meet: with it
// estimators without noise get traced shadows (THEORY.md 7, per image). A ratio of two sums over
// the same samples of `cells`, consistent but not unbiased. Internal to estimators/.
#pragma once

#include <optional>
#include <string>

#include "render/estimators/window_sampler.h"

namespace luxfield::render {

class VisibleShare {
 public:
  // Per pixel float4: the share of each channel, and the variance of the luminance's share. Null:
  // everything is visible.
  struct Shares {
    Buffer irradiance;
    Buffer reflected;  // of the radiance towards the eye; null for a Lambertian G-buffer
  };

  explicit VisibleShare(const Device& device) : device_(device) {}

  // Enqueues what `estimator` asks for and counts light samples to `samples`; nothing without a
  // BVH. Throws what WindowSampler::Run throws.
  Shares Trace(const std::string& estimator, const GBuffer& gbuffer, const Visibility& visibility,
               const LuminaireOnDevice& luminaire, const scene::Pose& world_from_luminaire,
               const EstimatorOptions& options, const Buffer& samples);

 private:
  Device device_;
  std::optional<WindowSampler> sampler_;  // built when shadows are first asked for
};

}  // namespace luxfield::render
