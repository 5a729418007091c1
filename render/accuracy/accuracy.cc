#include "luxfield/render/accuracy/accuracy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/measures.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/choose_setting.h"
#include "luxfield/render/accuracy/lights_accuracy.h"

namespace luxfield::render {
namespace {

constexpr int kMaxRounds = 12;

// Renders rounds until the variance that the picture shows at pixels which are lit again is small
// enough.
class Rounds {
 public:
  Rounds(LitScene& scene, RenderOptions options, const Candidate& chosen, AccurateFrame& result)
      : scene_(scene),
        options_(std::move(options)),
        chosen_(chosen),
        density_(chosen.density),
        law_(chosen.law),
        wanted_(chosen.setting.samples_per_pixel),
        result_(result) {}

  void One() { Add(Take()); }

  void UntilMet(double rel_error) {
    for (int round = 0;; ++round) {
      Add(Take());
      const PictureNoise noise = Noise();
      const double allowed =
          std::pow(NoiseShare(rel_error, chosen_.interpolation_error) * noise.mean_luminance, 2) /
          noise.Margin();
      result_.met = noise.mean_variance <= allowed;
      if (result_.met || round == kMaxRounds || taken_ >= kMaxSamples) return;
      const double aim = kAim * kAim * allowed;
      wanted_ = FurtherSamples(
          law_, {taken_, noise.mean_variance, aim, chosen_.least, double{kMaxSamples}});
      WantAnew(aim);
    }
  }

 private:
  Frame Take() {
    options_.first_pass = pass_++;
    options_.sample_density = density_.density;
    options_.samples_per_pixel =
        static_cast<int>(std::clamp(wanted_, chosen_.least, double{kMaxSamples}));
    return Renderer(scene_, options_).Render();
  }

  // Merged by samples, which keeps the mean unbiased.
  void Add(Frame frame) {
    const int k = options_.samples_per_pixel;
    if (result_.first_s == 0) {
      result_.first_work = chosen_.work_of_one;
      result_.first_work.samples *= density_.mean * k;
      result_.first_work.rays *= density_.mean * k;
      result_.first_s = LightingSeconds(scene_.device(), frame.times);
    }
    law_.Anchor(k, NoiseOf(frame, 1).mean_variance);
    if (taken_ == 0) {
      AddTimes(result_.frame.times, frame.times);
      result_.frame = std::move(frame);
    } else {
      result_.frame = MeanFrame(result_.frame, taken_, frame, k);
    }
    taken_ += k;
    result_.chosen.samples_per_pixel = static_cast<int>(std::lround(density_.mean * taken_));
    result_.estimated_error = std::hypot(Noise().RelativeError(), chosen_.interpolation_error);
  }

  PictureNoise Noise() const {
    return NoiseOf(result_.frame, std::max(1, static_cast<int>(taken_) - 1));
  }

  // Samples dealt out by what the picture shows, where they take less time than more of the same:
  // pilots see few pixels, and pixels that they missed can hold nearly all of the noise. What is
  // there is dropped then, as samples must not depend on what they are averaged with.
  void WantAnew(double aim) {
    const SampleDensity density = DensityFrom(result_.frame, chosen_.LeastDensity(taken_));
    const double k = std::max(chosen_.least, density.variance * density.variance_of_one / aim);
    if (k * density.mean >= wanted_ * density_.mean) return;
    density_ = density;
    wanted_ = k;
    law_.Anchor(k, aim);
    taken_ = 0;
  }

  LitScene& scene_;
  RenderOptions options_;
  const Candidate& chosen_;
  SampleDensity density_;
  VarianceLaw law_;
  double wanted_;     // samples of the next round
  double taken_ = 0;  // of the picture, at density 1
  int pass_ = 0;
  AccurateFrame& result_;
};

}  // namespace

void AccuracyRequest::Validate() const {
  if (rel_error.has_value() == time_s.has_value())
    throw InputError("give either an error or a time to render within");
  if (rel_error && !(*rel_error >= 2e-5 && *rel_error <= 1))
    throw InputError(fmt::format("an error of {:g} % cannot be asked for; give 0.002 % to 100 %",
                                 100 * *rel_error));
  if (time_s && !(*time_s > 0 && *time_s <= 86400))
    throw InputError(
        fmt::format("a time of {:g} s cannot be asked for; give up to a day", *time_s));
  if (picture.shadows != Shadows::kNone && picture.shadows != Shadows::kTraced)
    throw InputError(
        "shadow maps do not state their error, so no estimator can be chosen by error or time; "
        "take traced shadows or none, or name an estimator and its samples");
  picture.Validate();
}

AccurateFrame RenderToAccuracy(LitScene& scene, const CostModel& costs,
                               const AccuracyRequest& request) {
  RequireServable(scene, request);
  if (!ReadsCostModel(scene, request)) return RenderLightsToAccuracy(scene, request);
  AccurateFrame result;
  const core::Stopwatch stopwatch;
  const std::vector<Candidate> candidates = ChooseSetting(scene, costs, request);
  result.choosing_s = stopwatch.WallSeconds();
  for (const auto& candidate : candidates) result.considered.push_back(candidate.setting);
  const Candidate& chosen = candidates.front();
  result.chosen = chosen.setting;

  RenderOptions options = request.picture;
  options.estimator = chosen.setting.estimator;
  if (request.rel_error) options.approximation_error = ApproximationError(request);
  if (!chosen.samples) {
    result.frame = Renderer(scene, options).Render();
    result.first_work = chosen.work_of_one;
    result.first_work.samples = result.first_work.rays = 0;
    result.first_s = LightingSeconds(scene.device(), result.frame.times);
    result.estimated_error = chosen.setting.predicted_error;
    result.met = !request.rel_error || result.estimated_error <= *request.rel_error;
    return result;
  }
  Rounds rounds(scene, options, chosen, result);
  if (request.rel_error)
    rounds.UntilMet(*request.rel_error);
  else
    rounds.One();
  result.met |= !request.rel_error;
  return result;
}

AccurateFrame RenderToAccuracy(LitScene& scene, const AccuracyRequest& request) {
  RequireServable(scene, request);
  if (!ReadsCostModel(scene, request)) return RenderToAccuracy(scene, {}, request);
  CostModel costs = CurrentCostModel(scene.device());
  AccurateFrame result = RenderToAccuracy(scene, costs, request);
  Refine(costs, result.chosen.estimator, result.first_work, result.first_s);
  KeepCostModel(scene.device(), costs);
  return result;
}

bool IsBetter(const AccuracyRequest& request, const Setting& a, const Setting& b) {
  const double time_s = request.time_s.value_or(0);
  // Predicted to take just the time asked for, but for rounding.
  const bool a_fits = a.predicted_s <= 1.001 * time_s, b_fits = b.predicted_s <= 1.001 * time_s;
  if (a_fits != b_fits) return a_fits;
  return a_fits ? a.predicted_error < b.predicted_error : a.predicted_s < b.predicted_s;
}

bool TakesSamples(const EstimatorTraits& traits, bool shadows) {
  return !traits.noise_free || shadows;
}

bool StatesItsError(const EstimatorTraits& traits, bool glossy, bool shadows) {
  if (glossy ? !traits.any_brdf : traits.any_brdf && traits.noise_free) return false;
  if (shadows && !traits.traced_shadows) return false;
  return TakesSamples(traits, shadows) ? traits.unbiased || traits.noise_free
                                       : traits.rel_error > 0;
}

bool MayBeChosen(const EstimatorTraits& traits, const LitScene& scene,
                 const AccuracyRequest& request) {
  const auto& names = request.estimators;
  return StatesItsError(traits, scene.geometry().glossy,
                        request.picture.shadows != Shadows::kNone) &&
         (names.empty() || std::find(names.begin(), names.end(), traits.name) != names.end());
}

bool ReadsCostModel(const LitScene& scene, const AccuracyRequest& request) {
  return !scene.environment() && scene.area_lights().empty() &&
         !request.picture.knobs.strategies.everywhere;
}

void RequireServable(const LitScene& scene, const AccuracyRequest& request) {
  request.Validate();
  if (scene.environment() && request.picture.knobs.environment.sets != SampleSets::kScrambled)
    throw InputError(
        "errors of shared and interleaved samples are alike from pixel to pixel, so that no error "
        "or time can be asked of them; take environment-sets=scrambled or name the samples");
  if (scene.luminaires().empty() || request.picture.knobs.strategies.everywhere) return;
  const auto estimators = EstimatorList();
  if (std::none_of(estimators.begin(), estimators.end(),
                   [&](const auto& traits) { return MayBeChosen(traits, scene, request); }))
    throw InputError(
        "no estimator that states its error can light this scene; name one with --estimator and "
        "its samples with --spp");
}

double LuminanceError(const core::Image& picture, const core::Image& reference) {
  return core::Compare(core::LuminanceImage(picture), core::LuminanceImage(reference)).rel_rmse;
}

}  // namespace luxfield::render
