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
// By what the variance that a round aims at grows until it does not take too long, and the share of
// its samples that is hardly fewer.
constexpr double kLargerAim = 4, kHardlyFewer = 0.8;

// Over the pixels that hit something.
double MeanOverHits(const Frame& frame, const core::Image& values) {
  double sum = 0, hits = 0;
  for (std::size_t i = 0; i < values.data.size(); ++i) {
    sum += values.data[i];
    hits += frame.coverage.data[i] > 0;
  }
  return hits > 0 ? sum / hits : 0;
}

// Of scenes of luminaires alone.
class LuminaireRendering : public AccurateRendering {
 public:
  LuminaireRendering(LitScene& scene, const AccuracyRequest& request, CostModel costs,
                     bool keeps_costs)
      : scene_(scene),
        request_(request),
        costs_(std::move(costs)),
        keeps_costs_(keeps_costs),
        options_(request.picture) {}

  void TakeRound() override {
    if (!chosen_) Choose();
    if (!chosen_->samples)
      TakeNoiseFree();
    else if (request_.rel_error)
      TakeWhatIsLacking();
    else
      TakeAllInTime();
    if (std::exchange(keeps_costs_, false)) {
      Refine(costs_, result_.chosen.estimator, result_.first_work, result_.first_s);
      KeepCostModel(scene_.device(), costs_);
    }
  }

 private:
  void Choose() {
    const core::Stopwatch stopwatch;
    std::vector<Candidate> candidates = ChooseSetting(scene_, costs_, request_);
    result_.choosing_s = stopwatch.WallSeconds();
    for (const auto& candidate : candidates) result_.considered.push_back(candidate.setting);
    chosen_ = std::move(candidates.front());
    result_.chosen = chosen_->setting;
    options_.estimator = chosen_->setting.estimator;
    if (!request_.rel_error) return;
    options_.approximation_error = ApproximationError(request_);
    if (!chosen_->begun) return;
    // The candidate's pilot is a part of the picture.
    result_.frame = chosen_->begun->frame;
    taken_ = chosen_->begun->taken;
    law_ = chosen_->law;
    Count(chosen_->begun->lit, chosen_->begun->samples, result_.frame.times);
  }

  void TakeNoiseFree() {
    result_.frame = Renderer(scene_, options_).Render();
    result_.first_work = chosen_->work_of_one;
    result_.first_work.samples = result_.first_work.rays = 0;
    result_.first_s = LightingSeconds(scene_.device(), result_.frame.times);
    result_.estimated_error = chosen_->setting.predicted_error;
    result_.met = !request_.rel_error || result_.estimated_error <= *request_.rel_error;
    done_ = true;
  }

  // By the pilots' law and density.
  void TakeAllInTime() {
    options_.sample_density = chosen_->density.density;
    options_.samples_per_pixel = static_cast<int>(std::clamp<double>(
        chosen_->setting.samples_per_pixel, chosen_->least, double{kMaxSamples}));
    result_.frame = Renderer(scene_, options_).Render();
    const double samples = chosen_->density.mean * options_.samples_per_pixel;
    result_.rounds = 1;
    Count(1, samples, result_.frame.times);
    result_.chosen.samples_per_pixel = static_cast<int>(std::lround(samples));
    result_.estimated_error = std::hypot(
        NoiseOf(result_.frame, std::max(1, options_.samples_per_pixel - 1)).RelativeError(),
        chosen_->interpolation_error);
    result_.met = done_ = true;
  }

  // Until the variance that the picture shows at pixels which are lit again is small enough.
  void TakeWhatIsLacking() {
    const double aim = result_.rounds == 0 ? chosen_->FirstAim(*request_.rel_error)
                                           : kAim * kAim * Allowed(Noise());
    FurtherRound round = Lacking(aim);
    if (!Shorten(aim, round)) ++whole_rounds_;
    Add(round);
    const PictureNoise noise = Noise();
    result_.estimated_error = std::hypot(noise.RelativeError(), chosen_->interpolation_error);
    result_.met = noise.mean_variance <= Allowed(noise);
    done_ = result_.met || whole_rounds_ > kMaxRounds || MeanTaken() >= kMaxSamples;
  }

  FurtherRound Lacking(double variance) const {
    return PlanFurtherRound(result_.frame, taken_, law_, chosen_->Aim(variance));
  }

  // Makes a round that takes too long one that aims at more noise, as far as this spares samples.
  // False if nothing was spared.
  bool Shorten(double aim, FurtherRound& round) const {
    if (!request_.round_s) return false;
    const double most_s = std::max(
        *request_.round_s, kLongestRound * LightingSeconds(scene_.device(), result_.frame.times));
    bool shorter = false;
    while (chosen_->RoundSeconds(round.lit, round.samples) > most_s) {
      aim *= kLargerAim;
      FurtherRound less = Lacking(aim);
      if (less.samples == 0 || less.samples > kHardlyFewer * round.samples) break;
      round = std::move(less);
      shorter = true;
    }
    return shorter;
  }

  void Add(const FurtherRound& round) {
    options_.first_pass = result_.rounds + 1;  // the pilot's is 0
    options_.sample_density = round.density;
    options_.samples_per_pixel = round.samples_per_pixel;
    const Frame frame = Renderer(scene_, options_).Render();
    if (++result_.rounds == 1) Count(round.lit, round.samples, frame.times);
    const core::Image added = SamplesOf(round);
    result_.frame = MeanFrame(result_.frame, taken_, frame, added);
    for (std::size_t i = 0; i < taken_.data.size(); ++i) taken_.data[i] += added.data[i];
    result_.chosen.samples_per_pixel =
        static_cast<int>(std::lround(MeanOverHits(result_.frame, result_.frame.samples)));
  }

  // What the cost model learns from.
  void Count(double lit, double samples, const RenderTimes& times) {
    const LightingWork& one = chosen_->work_of_one;
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

  // Variance of a picture that keeps the error.
  double Allowed(const PictureNoise& noise) const {
    return std::pow(
               NoiseShare(*request_.rel_error, chosen_->interpolation_error) * noise.mean_luminance,
               2) /
           noise.Margin();
  }

  LitScene& scene_;
  const AccuracyRequest request_;
  CostModel costs_;
  bool keeps_costs_;
  RenderOptions options_;
  std::optional<Candidate> chosen_;  // in the first round
  core::Image taken_;                // samples of each pixel
  VarianceLaw law_;
  int whole_rounds_ = 0;  // that aimed at the error asked for
};

std::unique_ptr<AccurateRendering> Begin(LitScene& scene, const AccuracyRequest& request,
                                         CostModel costs, bool keeps_costs) {
  RequireServable(scene, request);
  if (!ReadsCostModel(scene, request)) return BeginRenderingLights(scene, request);
  return std::make_unique<LuminaireRendering>(scene, request, std::move(costs), keeps_costs);
}

AccurateFrame AllRounds(AccurateRendering& rendering) {
  while (!rendering.done()) rendering.TakeRound();
  return rendering.TakeResult();
}

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

std::unique_ptr<AccurateRendering> BeginRendering(LitScene& scene, const CostModel& costs,
                                                  const AccuracyRequest& request) {
  return Begin(scene, request, costs, false);
}

std::unique_ptr<AccurateRendering> BeginRendering(LitScene& scene, const AccuracyRequest& request) {
  return Begin(scene, request,
               ReadsCostModel(scene, request) ? CurrentCostModel(scene.device()) : CostModel(),
               true);
}

AccurateFrame RenderToAccuracy(LitScene& scene, const CostModel& costs,
                               const AccuracyRequest& request) {
  return AllRounds(*BeginRendering(scene, costs, request));
}

AccurateFrame RenderToAccuracy(LitScene& scene, const AccuracyRequest& request) {
  return AllRounds(*BeginRendering(scene, request));
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
         (names.empty() ? !traits.for_comparison
                        : std::find(names.begin(), names.end(), traits.name) != names.end());
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
