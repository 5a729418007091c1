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

// Over the pixels that hit something.
double MeanOverHits(const Frame& frame, const core::Image& values) {
  double sum = 0, hits = 0;
  for (std::size_t i = 0; i < values.data.size(); ++i) {
    sum += values.data[i];
    hits += frame.coverage.data[i] > 0;
  }
  return hits > 0 ? sum / hits : 0;
}

// Of a chosen estimator that takes samples.
class Rounds {
 public:
  Rounds(LitScene& scene, RenderOptions options, const Candidate& chosen, AccurateFrame& result)
      : scene_(scene), options_(std::move(options)), chosen_(chosen), result_(result) {}

  // One round, by the pilots' law and density.
  void One() {
    options_.sample_density = chosen_.density.density;
    options_.samples_per_pixel = static_cast<int>(
        std::clamp<double>(chosen_.setting.samples_per_pixel, chosen_.least, double{kMaxSamples}));
    result_.frame = Renderer(scene_, options_).Render();
    const double samples = chosen_.density.mean * options_.samples_per_pixel;
    result_.rounds = 1;
    Count(1, samples, result_.frame.times);
    result_.chosen.samples_per_pixel = static_cast<int>(std::lround(samples));
    result_.estimated_error = std::hypot(
        NoiseOf(result_.frame, std::max(1, options_.samples_per_pixel - 1)).RelativeError(),
        chosen_.interpolation_error);
  }

  // Rounds that take what is lacking, until the variance that the picture shows at pixels which are
  // lit again is small enough. The candidate's pilot is a part of the picture.
  void UntilMet(double rel_error) {
    result_.frame = chosen_.begun->frame;
    taken_ = chosen_.begun->taken;
    law_ = chosen_.law;
    Count(chosen_.begun->lit, chosen_.begun->samples, result_.frame.times);
    TakeWhatIsLacking(chosen_.FirstAim(rel_error));
    for (;;) {
      const PictureNoise noise = Noise();
      const double allowed =
          std::pow(NoiseShare(rel_error, chosen_.interpolation_error) * noise.mean_luminance, 2) /
          noise.Margin();
      result_.met = noise.mean_variance <= allowed;
      if (result_.met || result_.rounds > kMaxRounds || MeanTaken() >= kMaxSamples) return;
      TakeWhatIsLacking(kAim * kAim * allowed);
    }
  }

 private:
  void TakeWhatIsLacking(double variance) {
    const FurtherRound round = PlanFurtherRound(result_.frame, taken_, law_, chosen_.Aim(variance));
    options_.first_pass = ++result_.rounds;  // the pilot's is 0
    options_.sample_density = round.density;
    options_.samples_per_pixel = round.samples_per_pixel;
    const Frame frame = Renderer(scene_, options_).Render();
    if (result_.rounds == 1) Count(round.lit, round.samples, frame.times);
    const core::Image added = SamplesOf(round);
    result_.frame = MeanFrame(result_.frame, taken_, frame, added);
    for (std::size_t i = 0; i < taken_.data.size(); ++i) taken_.data[i] += added.data[i];
    result_.chosen.samples_per_pixel =
        static_cast<int>(std::lround(MeanOverHits(result_.frame, result_.frame.samples)));
    result_.estimated_error = std::hypot(Noise().RelativeError(), chosen_.interpolation_error);
  }

  // What the cost model learns from.
  void Count(double lit, double samples, const RenderTimes& times) {
    const LightingWork& one = chosen_.work_of_one;
    LightingWork& work = result_.first_work;
    work.pixels += lit * one.pixels;
    work.images += lit * one.images;
    work.texels += lit * one.texels;
    work.samples += samples * one.samples;
    work.rays += samples * one.rays;
    result_.first_s += LightingSeconds(scene_.device(), times);
  }

  double MeanTaken() const { return MeanOverHits(result_.frame, taken_); }

  PictureNoise Noise() const {
    return NoiseOf(result_.frame, std::max(1, static_cast<int>(MeanTaken()) - 1));
  }

  LitScene& scene_;
  RenderOptions options_;
  const Candidate& chosen_;
  AccurateFrame& result_;
  core::Image taken_;  // samples of each pixel
  VarianceLaw law_;
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
  return !scene.environment() && !scene.has_strategies() &&
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
