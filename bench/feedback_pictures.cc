#include "luxfield/bench/feedback_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "luxfield/core/colour.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/measures.h"
#include "luxfield/render/film/film.h"
#include "luxfield/render/lights_apart.h"

namespace luxfield::bench {
namespace {

using render::LightsApart;
using render::StrategySetting;

constexpr std::uint64_t kSeed = 17, kReferenceSeed = 0x666565646261;  // nobody counts up to it
constexpr int kFaces = 6;
const char* const kFaceNames[kFaces] = {"+x", "-x", "+y", "-y", "+z", "-z"};
// Hues that stay apart when they are mixed.
const core::Rgb kFaceColours[kFaces] = {{0.9, 0.2, 0.2},  {0.1, 0.75, 0.8}, {0.3, 0.75, 0.2},
                                        {0.75, 0.3, 0.8}, {0.3, 0.4, 0.95}, {0.95, 0.8, 0.2}};

// The thesis' colours: red follows the light, green the BRDF, yellow half and half.
core::Rgb ShareColour(double share) {
  return {std::min(1.0, 2 * share), std::min(1.0, 2 * (1 - share)), 0};
}

// Blue below the middle, white in it, red above.
core::Rgb SignedColour(double position) {
  const double x = 2 * position - 1, rest = 1 - std::abs(x);
  return x < 0 ? core::Rgb{rest, rest, 1} : core::Rgb{1, rest, rest};
}

// Over seeds, of the pixels that hit something.
struct Statistics {
  core::Image variance, lab;
};

Statistics OverSeeds(LightsApart& scene, const StrategySetting& setting, int seeds,
                     const core::Image& reference) {
  const int pixels = static_cast<int>(scene.hit().size());
  Statistics statistics{core::Image(pixels, 1, 1), core::Image(pixels, 1, 1)};
  std::vector<double> mean(pixels, 0.0), squares(pixels, 0.0);
  for (int seed = 0; seed < seeds; ++seed) {
    const core::Image radiance = scene.Light(setting, kSeed + seed).radiance,
                      luminance = core::LuminanceImage(radiance),
                      lab = core::LabDifference(radiance, reference);
    for (int k = 0; k < pixels; ++k) {
      const double difference = luminance.data[k] - mean[k];
      mean[k] += difference / (seed + 1);
      squares[k] += difference * (luminance.data[k] - mean[k]);
      statistics.lab.data[k] += lab.data[k] / static_cast<float>(seeds);
    }
  }
  for (int k = 0; k < pixels; ++k)
    statistics.variance.data[k] = static_cast<float>(squares[k] / (seeds - 1));
  return statistics;
}

}  // namespace

Feedback MakeFeedback(const render::Device& device, const scene::Scene& scene,
                      const FeedbackOptions& options) {
  using render::Strategies;
  constexpr float kMissed = std::numeric_limits<float>::quiet_NaN();
  render::LitScene lit(device, scene);
  LightsApart lights(lit, options.shadows);
  const StrategySetting newton{Strategies::kNewton, options.samples_per_light, 0.5f, options.pilot},
      balance{Strategies::kBalance, options.samples_per_light, 0.5f, options.pilot};
  Feedback feedback;
  feedback.width = lights.width();
  feedback.height = lights.height();
  feedback.lights = lights.names();

  const core::Image reference =
      lights.Light({Strategies::kNewton, options.reference_samples}, kReferenceSeed).radiance;
  feedback.radiance = lights.Spread(reference, 0);

  const std::vector<LightsApart::Part> parts = lights.LightParts(newton, kSeed);
  for (const LightsApart::Part& part : parts)
    feedback.light_shares.push_back(lights.Spread(part.light_share, kMissed));
  feedback.light_share = lights.Spread(render::MeanLightShare(parts), kMissed);

  const Statistics with_newton = OverSeeds(lights, newton, options.seeds, reference),
                   with_balance = OverSeeds(lights, balance, options.seeds, reference);
  core::Image variance(reference.width, 1, 1), lab = variance;
  for (std::size_t k = 0; k < variance.data.size(); ++k) {
    const float a = with_balance.variance.data[k], b = with_newton.variance.data[k];
    variance.data[k] = a + b > 0 ? (a - b) / (a + b) : 0;
    lab.data[k] = with_balance.lab.data[k] - with_newton.lab.data[k];
  }
  feedback.variance_gain = lights.Spread(variance, kMissed);
  feedback.lab_gain = lights.Spread(lab, kMissed);
  const core::Image faces = lights.FaceShares();
  if (!faces.data.empty()) feedback.face_shares = lights.Spread(faces, kMissed);
  return feedback;
}

std::vector<std::filesystem::path> WriteFeedback(const Feedback& feedback,
                                                 const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::vector<std::filesystem::path> files{folder / "feedback.exr"};
  core::ExrPartView part;
  part.width = feedback.width;
  part.height = feedback.height;
  const auto add = [&](const std::string& layer, const core::Image& image, int channel,
                       const std::string& name) {
    part.channels.push_back({layer + name, image.plane(channel)});
  };
  for (int c = 0; c < 3; ++c) add("", feedback.radiance, c, std::string(1, "RGB"[c]));
  add("light_share.", feedback.light_share, 0, "Y");
  for (std::size_t k = 0; k < feedback.lights.size(); ++k)
    add(fmt::format("light_share_{}.", k + 1), feedback.light_shares[k], 0, "Y");
  add("variance_gain.", feedback.variance_gain, 0, "Y");
  add("lab_gain.", feedback.lab_gain, 0, "Y");
  if (!feedback.face_shares.data.empty())
    for (int face = 0; face < kFaces; ++face)
      add("faces.", feedback.face_shares, face, kFaceNames[face]);
  part.attributes = {{"luxfield:kind", std::string("feedback")}, {"luxfield:version", 1}};
  for (std::size_t k = 0; k < feedback.lights.size(); ++k)
    part.attributes[fmt::format("luxfield:light_{}", k + 1)] = feedback.lights[k];
  core::WriteExr(files.back(), std::span(&part, 1));

  const auto scale = [&](const std::string& name, const core::Image& image,
                         const std::string& quantity, const std::string& unit,
                         const render::ColourScale& colours) {
    files.push_back(folder / (name + ".png"));
    render::WriteColourScale(files.back(), image, quantity, unit, colours);
  };
  const render::ColourScale shares{0, 1, &ShareColour};
  scale("light-share", feedback.light_share, "light samples", "share, all lights", shares);
  for (std::size_t k = 0; k < feedback.lights.size(); ++k)
    scale(fmt::format("light-share-{}", k + 1), feedback.light_shares[k], "light samples",
          feedback.lights[k].substr(0, 16), shares);
  scale("variance-gain", feedback.variance_gain, "variance gain", "(b - n) / (b + n)",
        {-1, 1, &SignedColour});
  float largest = 0;
  for (const float value : feedback.lab_gain.data)
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  const double lab_end = largest > 0 ? std::min(double{largest}, 4.0) : 1;
  scale("lab-gain", feedback.lab_gain, "Lab gain", "balance - newton",
        {-lab_end, lab_end, &SignedColour});
  if (!feedback.face_shares.data.empty()) {
    core::Image mixed(feedback.width, feedback.height, 3);
    std::vector<render::ColourKey> keys;
    for (int face = 0; face < kFaces; ++face) {
      keys.push_back({kFaceNames[face], kFaceColours[face]});
      for (int c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < mixed.plane_size(); ++k)
          if (const float share = feedback.face_shares.plane(face)[k]; share > 0)
            mixed.plane(c)[k] += share * static_cast<float>(kFaceColours[face][c]);
    }
    files.push_back(folder / "faces.png");
    render::WriteColourKeys(files.back(), mixed, "map samples", keys);
  }
  return files;
}

}  // namespace luxfield::bench
