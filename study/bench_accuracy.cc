#include "study/bench_accuracy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/error.h"
#include "scene/scene.h"
#include "study/accuracy.h"

namespace luxfield::study {
namespace {

constexpr int kSweep[] = {8, 16, 32, 64, 128, 256, 512, 1024};
constexpr int kReferencePass = 1 << 12;  // its passes are no picture's

struct Reference {
  core::Image radiance;
  double error = 0;  // relative RMSE of its luminance
};

bool TakesSamples(const render::EstimatorTraits& traits, bool shadows) {
  return !traits.noise_free || shadows;
}

std::vector<render::EstimatorTraits> Candidates(const render::LitScene& scene,
                                                const CostModel& costs, bool shadows) {
  std::vector<render::EstimatorTraits> candidates;
  for (const auto& traits : render::EstimatorList())
    if (costs.Knows(traits.name) &&
        (scene.geometry().glossy ? traits.any_brdf : !(traits.any_brdf && traits.noise_free)) &&
        (traits.unbiased || traits.noise_free) &&
        (TakesSamples(traits, shadows) ? !shadows || traits.traced_shadows : traits.rel_error > 0))
      candidates.push_back(traits);
  return candidates;
}

// `exact` where it has no noise, else two halves of an unbiased estimator.
Reference MakeReference(render::LitScene& scene, render::RenderOptions picture, int samples) {
  picture.first_pass = kReferencePass;
  if (picture.shadows == render::Shadows::kNone && !scene.geometry().glossy) {
    picture.estimator = "exact";
    return {render::Renderer(scene, picture).Render().radiance, 1e-6};
  }
  picture.estimator = "windowed";
  picture.samples_per_pixel = samples / 2;
  const auto first = render::Renderer(scene, picture).Render();
  picture.first_pass = kReferencePass + 1;
  const auto second = render::Renderer(scene, picture).Render();
  return {render::MeanFrame(first, 1, second, 1).radiance,
          0.5 * LuminanceError(first.radiance, second.radiance)};
}

struct Fixed {
  std::string estimator;
  double samples = 0, seconds = std::numeric_limits<double>::infinity();
};

// The time at which a setting's error falls to the target: log-log between neighbouring points of
// its sweep, by the last two beyond it.
std::optional<Fixed> CheapestWithin(const std::string& estimator, const std::vector<double>& spp,
                                    const std::vector<double>& errors,
                                    const std::vector<double>& seconds, double target) {
  if (errors.front() <= target) return Fixed{estimator, spp.front(), seconds.front()};
  for (std::size_t k = 1; k < errors.size(); ++k) {
    if (errors[k] > target && k + 1 < errors.size()) continue;
    const double slope = std::log(errors[k] / errors[k - 1]) / std::log(spp[k] / spp[k - 1]);
    if (!(slope < 0)) continue;
    const double ratio = std::pow(target / errors[k - 1], 1 / slope);  // of the samples
    const double per_sample_s = (seconds[k] - seconds[k - 1]) / (spp[k] - spp[k - 1]);
    const double samples = spp[k - 1] * ratio;
    return Fixed{estimator, samples,
                 seconds[k - 1] + std::max(0.0, per_sample_s) * (samples - spp[k - 1])};
  }
  return std::nullopt;
}

// Every candidate's errors and times over the sample counts.
class Sweep {
 public:
  Sweep(render::LitScene& scene, const CostModel& costs, const render::RenderOptions& picture,
        const Reference& reference) {
    const bool shadows = picture.shadows != render::Shadows::kNone;
    for (const auto& traits : Candidates(scene, costs, shadows)) {
      render::RenderOptions options = picture;
      options.estimator = traits.name;
      Series series{traits.name, {}, {}, {}};
      for (const int samples : kSweep) {
        options.samples_per_pixel = samples;
        render::Renderer renderer(scene, options);
        if (samples == kSweep[0]) renderer.Render();  // compiles and touches memory
        const auto frame = renderer.Render();
        series.spp.push_back(samples);
        series.seconds.push_back(frame.times.lighting_s);
        series.errors.push_back(LuminanceError(frame.radiance, reference.radiance));
        if (!TakesSamples(traits, shadows)) break;
      }
      series_.push_back(std::move(series));
    }
  }

  Fixed Best(double target) const {
    Fixed best;
    for (const auto& series : series_) {
      const auto fixed =
          CheapestWithin(series.estimator, series.spp, series.errors, series.seconds, target);
      if (fixed && fixed->seconds < best.seconds) best = *fixed;
    }
    return best;
  }

 private:
  struct Series {
    std::string estimator;
    std::vector<double> spp, errors, seconds;
  };
  std::vector<Series> series_;
};

}  // namespace

nlohmann::json BenchAccuracy(const BenchAccuracyOptions& options) {
  if (options.scenes.empty() || options.targets.empty() || options.seeds < 1)
    throw InputError("bench accuracy: give at least one scene, one target and one seed");
  const auto device = render::Device::Open(options.device, options.threads);
  const CostModel costs = Calibrate(device);
  nlohmann::json rows = nlohmann::json::array();
  for (const auto& path : options.scenes) {
    render::LitScene scene(device, scene::ReadScene(path));
    for (const bool shadows : options.shadows) {
      AccuracyRequest request;
      request.picture.shadows = shadows ? render::Shadows::kTraced : render::Shadows::kNone;
      request.picture.width = options.width;
      request.picture.height = options.height;
      const Reference reference = MakeReference(scene, request.picture, options.reference_samples);
      const Sweep sweep(scene, costs, request.picture, reference);
      for (const double target : options.targets) {
        const Fixed best = sweep.Best(target);
        for (int seed = 0; seed < options.seeds; ++seed) {
          request.rel_error = target;
          request.picture.seed = options.seed + static_cast<std::uint64_t>(seed);
          const auto result = RenderToAccuracy(scene, costs, request);
          const double against = LuminanceError(result.frame.radiance, reference.radiance);
          const double error =
              std::sqrt(std::max(0.0, against * against - reference.error * reference.error));
          const double seconds = result.frame.times.lighting_s;
          rows.push_back({{"scene", path.stem().string()},
                          {"shadows", shadows},
                          {"asked", target},
                          {"estimated", result.estimated_error},
                          {"true", error},
                          {"kept", error <= target},
                          {"met", result.met},
                          {"estimator", result.chosen.estimator},
                          {"spp", result.chosen.samples_per_pixel},
                          {"lighting_s", seconds},
                          {"best_fixed", best.estimator},
                          {"best_fixed_spp", best.samples},
                          {"best_fixed_s", best.seconds},
                          {"time_ratio", seconds / best.seconds},
                          {"reference_error", reference.error}});
        }
      }
    }
  }
  return rows;
}

}  // namespace luxfield::study
