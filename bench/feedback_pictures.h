// Pictures that show what choosing the share of light samples does (thesis chapter 5): the share
// per pixel and light, what it is worth against the balance heuristic, where an environment's
// samples go.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/render/device/device.h"
#include "luxfield/scene/scene.h"

namespace luxfield::bench {

struct FeedbackOptions {
  int samples_per_light = 256;  // per pixel
  int pilot = 64;
  bool shadows = true;
  int seeds = 8;  // pictures that variances and Lab errors are taken over, at least 2
  int reference_samples = 4096;  // per pixel and light
};

// Images are height x width; NaN where nothing was hit, 0 in `radiance`.
struct Feedback {
  int width = 0, height = 0;
  core::Image radiance;                   // RGB, the reference
  std::vector<std::string> lights;        // their names
  std::vector<core::Image> light_shares;  // alpha_l of each, 1 channel; 1/2 where it brings nothing
  // Mean of alpha_l over the lights, weighed by the luminance that each brings to the pixel.
  core::Image light_share;
  // (variance of the balance heuristic - that of newton) / their sum: 1 where newton has none, -1
  // where it has all.
  core::Image variance_gain;
  // Mean Lab error of the balance heuristic against the reference minus that of newton.
  core::Image lab_gain;
  core::Image face_shares;  // 6 channels, of an environment's samples by face; empty without one
};

// Throws InputError, DeviceError.
Feedback MakeFeedback(const render::Device& device, const scene::Scene& scene,
                      const FeedbackOptions& options = {});

// feedback.exr with all of it, docs/formats/render.md; and with legends light-share.png,
// light-share-N.png of each light, variance-gain.png, lab-gain.png and faces.png. Returns the
// files.
std::vector<std::filesystem::path> WriteFeedback(const Feedback& feedback,
                                                 const std::filesystem::path& folder);

}  // namespace luxfield::bench
