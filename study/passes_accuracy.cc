#include "study/passes_accuracy.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/stopwatch.h"
#include "study/picture_noise.h"

namespace luxfield::study {
namespace {

constexpr double kPilotPixels = 3072;
constexpr int kPasses = 4;
constexpr int kPilotSamples[] = {8, 32};  // of a pass and light
constexpr int kPassNumbers = 1 << 16;     // Renderer's
constexpr int kMaxRounds = 12;
constexpr double kMaxSamples = 1 << 20;
constexpr double kAim = 0.93;  // of the target

int LightsOf(const render::LitScene& scene) {
  return static_cast<int>(scene.area_lights().size()) + (scene.environment() ? 1 : 0);
}

// Two samples at least for every light and surface point of a pass.
render::RenderOptions WithSamples(render::RenderOptions options, int lights, double per_pass,
                                  int first_pass) {
  options.passes = kPasses;
  options.first_pass = first_pass;
  options.samples_per_pixel =
      kPasses * std::max(2 * lights * options.antialias,
                         static_cast<int>(std::min(per_pass, kMaxSamples / kPasses)));
  return options;
}

// What a pass costs and scatters at the pilot's pixels.
struct Pilot {
  double pixels = 0, seconds_per_sample = 0;
  PictureNoise noise;
  VarianceLaw pass;
};
Pilot TakePilot(render::LitScene& scene, const render::RenderOptions& picture, double pixels) {
  Pilot pilot;
  const double shrink = std::min(1.0, std::sqrt(kPilotPixels / pixels));
  for (const int samples : kPilotSamples) {
    // Numbers that no pass of the picture has.
    const int lights = LightsOf(scene);
    render::RenderOptions options =
        WithSamples(picture, lights, samples * lights, kPassNumbers - 2 * kPasses);
    options.width = std::max(1, static_cast<int>(std::lround(shrink * picture.width)));
    options.height = std::max(1, static_cast<int>(std::lround(shrink * picture.height)));
    options.antialias = 1;
    const render::Frame frame = render::Renderer(scene, options).Render();
    // The last one counts; the first compiles.
    pilot.pixels = static_cast<double>(options.width) * options.height;
    pilot.seconds_per_sample = frame.times.lighting_s / options.samples_per_pixel;
    pilot.noise = NoiseOf(frame, kPasses - 1);
    pilot.pass.Add(samples * lights, kPasses * pilot.noise.mean_variance);
  }
  return pilot;
}

// Samples of a pass of which kPasses have no more than the variance.
double SamplesFor(const Pilot& pilot, double variance) {
  double samples = 2;
  while (pilot.pass.Of(samples) > kPasses * variance && samples < kMaxSamples / kPasses)
    samples *= 1.05;
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
  double wanted = request.rel_error
                      ? kPasses * SamplesFor(pilot, kAim * kAim * allowed(pilot.noise))
                      : *request.time_s / s_per_sample;
  result.choosing_s = stopwatch.WallSeconds();
  result.chosen.estimator = scene.area_lights().empty() ? "environment" : "two strategies";
  result.chosen.predicted_s = wanted * s_per_sample;
  result.chosen.predicted_error = std::sqrt(pilot.pass.Of(wanted / kPasses) / kPasses) /
                                  std::max(pilot.noise.mean_luminance, 1e-30);

  double taken = 0;
  for (int round = 0;; ++round) {
    const render::RenderOptions options =
        WithSamples(picture, LightsOf(scene), wanted / kPasses, round * kPasses);
    render::Frame frame = render::Renderer(scene, options).Render();
    if (round == 0)
      result.frame = std::move(frame);
    else
      result.frame = render::MeanFrame(result.frame, taken, frame, options.samples_per_pixel);
    taken += options.samples_per_pixel;
    const PictureNoise noise = NoiseOf(result.frame, (round + 1) * (kPasses - 1));
    result.estimated_error = noise.RelativeError();
    result.met = !request.rel_error || noise.mean_variance <= allowed(noise);
    if (result.met || round == kMaxRounds || taken >= kMaxSamples) break;
    // The variance of the mean falls as one over all samples.
    wanted = std::max(0.25 * taken, taken * (noise.mean_variance / (kAim * allowed(noise)) - 1));
  }
  result.chosen.samples_per_pixel = static_cast<int>(taken);
  result.considered = {result.chosen};
  return result;
}

}  // namespace luxfield::study
