#include "study/passes_accuracy.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/stopwatch.h"
#include "study/picture_noise.h"

namespace luxfield::study {
namespace {

constexpr double kPilotPixels = 3072;
constexpr int kPilotPasses = 4;
constexpr int kPilotSamples[] = {8, 32};  // of a pass and light
constexpr int kPassNumbers = 1 << 16;     // Renderer's
constexpr int kMaxRounds = 12;
constexpr double kMaxSamples = 1 << 20;
constexpr double kAim = 0.93;  // of the target

int LightsOf(const render::LitScene& scene) {
  return static_cast<int>(scene.area_lights().size()) + (scene.environment() ? 1 : 0);
}

// What the picture's samples cost and scatter, by a smaller one.
struct Pilot {
  double pixels = 0, seconds_per_sample = 0;
  PictureNoise noise;
  VarianceLaw law;
};
Pilot TakePilot(render::LitScene& scene, const render::RenderOptions& picture, double pixels) {
  Pilot pilot;
  const double shrink = std::min(1.0, std::sqrt(kPilotPixels / pixels));
  const int lights = LightsOf(scene);
  for (const int samples : kPilotSamples) {
    render::RenderOptions options = picture;
    options.passes = kPilotPasses;
    options.first_pass = kPassNumbers - 2 * kPilotPasses;  // numbers that no round has
    options.samples_per_pixel = kPilotPasses * samples * lights;
    options.width = std::max(1, static_cast<int>(std::lround(shrink * picture.width)));
    options.height = std::max(1, static_cast<int>(std::lround(shrink * picture.height)));
    options.antialias = 1;
    const render::Frame frame = render::Renderer(scene, options).Render();
    // The last one counts; the first compiles.
    pilot.pixels = static_cast<double>(options.width) * options.height;
    pilot.seconds_per_sample = frame.times.lighting_s / options.samples_per_pixel;
    pilot.noise = NoiseOf(frame, kPilotPasses - 1);
    pilot.law.Add(samples * lights, kPilotPasses * pilot.noise.mean_variance);
  }
  return pilot;
}

// The fewest samples of a round that bring the mean of it and of `taken` samples of variance v down
// to the aim.
double SamplesFor(const VarianceLaw& law, double aim, double taken, double v) {
  double samples = std::max(2.0, 0.25 * taken);
  const auto merged = [&] {
    return (taken * taken * v + samples * samples * law.Of(samples)) /
           ((taken + samples) * (taken + samples));
  };
  while (merged() > aim && samples < kMaxSamples) samples *= 1.05;
  return samples;
}

}  // namespace

AccurateFrame RenderPassesToAccuracy(render::LitScene& scene, const AccuracyRequest& request) {
  if (scene.environment() &&
      request.picture.knobs.environment.sets != render::SampleSets::kScrambled)
    throw InputError(
        "errors of shared and interleaved samples are alike from pixel to pixel, so that no error "
        "or time can be asked of them; take environment-sets=scrambled or name the samples");
  AccurateFrame result;
  const core::Stopwatch stopwatch;
  render::RenderOptions picture = request.picture;
  if (picture.width == 0) picture.width = scene.camera().width;
  if (picture.height == 0) picture.height = scene.camera().height;
  const double pixels = static_cast<double>(picture.width) * picture.height;
  const Pilot pilot = TakePilot(scene, picture, pixels);
  const double s_per_sample = pilot.seconds_per_sample * pixels / pilot.pixels;
  const auto allowed = [&](const PictureNoise& noise) {
    return std::pow(*request.rel_error * noise.mean_luminance, 2) / noise.Margin();
  };
  // Two samples at least for every light and surface point of a round.
  const double least = 2.0 * LightsOf(scene) * picture.antialias;
  const auto counted = [&](double samples) {
    return std::floor(std::clamp(samples, least, std::max(least, kMaxSamples)));
  };
  VarianceLaw law = pilot.law;
  double wanted =
      counted(request.rel_error ? SamplesFor(law, kAim * kAim * allowed(pilot.noise), 0, 0)
                                : *request.time_s / s_per_sample);
  result.choosing_s = stopwatch.WallSeconds();
  result.chosen.estimator = scene.area_lights().empty() ? "environment" : "two strategies";
  result.chosen.predicted_s = wanted * s_per_sample;
  result.chosen.predicted_error =
      std::sqrt(law.Of(wanted)) / std::max(pilot.noise.mean_luminance, 1e-30);

  double taken = 0;
  for (int round = 0;; ++round) {
    picture.first_pass = round;
    picture.samples_per_pixel = static_cast<int>(wanted);
    render::Frame frame = render::Renderer(scene, picture).Render();
    law.Anchor(wanted, NoiseOf(frame, 1).mean_variance);
    result.frame =
        round == 0 ? std::move(frame) : render::MeanFrame(result.frame, taken, frame, wanted);
    taken += wanted;
    const PictureNoise noise = NoiseOf(result.frame, std::max(1, static_cast<int>(taken) - 1));
    result.estimated_error = noise.RelativeError();
    result.met = !request.rel_error || noise.mean_variance <= allowed(noise);
    if (result.met || round == kMaxRounds || taken >= kMaxSamples) break;
    wanted = counted(SamplesFor(law, kAim * kAim * allowed(noise), taken, noise.mean_variance));
  }
  result.chosen.samples_per_pixel = static_cast<int>(taken);
  result.considered = {result.chosen};
  return result;
}

}  // namespace luxfield::study
