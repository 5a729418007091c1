#include "luxfield/render/accuracy/lights_accuracy.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/choose_setting.h"
#include "luxfield/render/accuracy/light_samples.h"
#include "luxfield/render/accuracy/picture_noise.h"

namespace luxfield::render {
namespace {

constexpr double kPilotPixels = 3072;
constexpr int kPilotPasses = 4;
constexpr int kPilotSamples[] = {8, 32};  // of a pass and light
// What samples take of a pilot's time at least, whatever the clock says: none of them is free.
constexpr double kLeastShare = 0.1;
constexpr int kPassNumbers = 1 << 16;  // Renderer's
constexpr int kMaxRounds = 12;
// Of a time asked for: the first round's, and what is not worth another one.
constexpr double kFirstShare = 0.2, kLittle = 0.15;
constexpr double kLeastRound = 0.25;  // what a further round is worth of the picture so far
constexpr double kHardlyLess = 0.8;   // of a round's time: none that is worth a shorter one

// What pilots tell of some of the lights.
struct Pilot {
  std::vector<LightLaw> laws;     // of all lights; of those that are not lit: no variance, no time
  std::vector<double> luminance;  // of each light, mean over the pixels
  double shown = 0;               // mean luminance of what is seen without light: sky, emission
  double margin = 1;              // PictureNoise::Margin
};

// A way to light the luminaires, with what is expected of it.
struct Way {
  Setting setting;
  std::vector<LightLaw> laws;
  std::vector<double> samples;  // of each light
  double mean_luminance = 0, margin = 1;
  double approximation = 0;  // relative RMSE of the picture that no sample takes away
};

class LightByLight : public AccurateRendering {
 public:
  LightByLight(LitScene& scene, const AccuracyRequest& request)
      : scene_(scene),
        request_(request),
        picture_(request.picture),
        luminaires_(scene.luminaires().size()),
        lights_(scene.Lights().size()) {
    if (picture_.width == 0) picture_.width = scene.camera().width;
    if (picture_.height == 0) picture_.height = scene.camera().height;
    if (request.rel_error) picture_.approximation_error = ApproximationError(request);
    picture_.lights_apart = true;
  }

  void TakeRound() override {
    if (!way_) Choose();
    std::vector<double> samples = way_->samples;
    const bool whole = !Shorten(samples);
    picture_.first_pass = result_.rounds;
    picture_.light_samples.assign(samples.begin(), samples.end());
    Frame frame = Renderer(scene_, picture_).Render();
    const std::vector<LightTotals> lights = frame.lights;
    Add(std::move(frame), samples);
    whole_rounds_ += whole;
    const PictureNoise noise =
        NoiseOf(result_.frame, std::max(1, result_.chosen.samples_per_pixel - 1));
    variance_ = noise.mean_variance;
    result_.estimated_error = std::hypot(noise.RelativeError(), way_->approximation);
    if (request_.time_s) {
      result_.met = true;
      done_ = result_.rounds > 1 || !RestOfTime(*way_, result_.frame.times);
      return;
    }
    const double allowed = Allowed(*way_, noise.Margin(), noise.mean_luminance);
    result_.met = variance_ <= allowed;
    done_ = result_.met || whole_rounds_ > kMaxRounds ||
            result_.chosen.samples_per_pixel >= kMaxSamples;
    if (!done_) WantMore(*way_, samples, lights, kAim * kAim * allowed);
  }

 private:
  bool Shadowed() const { return picture_.shadows != Shadows::kNone; }

  std::vector<Way> Ways() {
    // In place of the pilots' own.
    core::Progress progress("pilots", EstimatorList().size() + 1);
    progress.Advance(1, "lights");
    const bool one_way = luminaires_ == 0 || picture_.knobs.strategies.everywhere;
    const Pilot others = TakePilot(one_way ? 0 : luminaires_, lights_);
    std::vector<Way> ways;
    if (one_way) {
      const bool strategies = picture_.knobs.strategies.everywhere || scene_.has_strategies();
      return {WayOf(strategies ? "two strategies" : "environment", others, others, 0)};
    }
    for (const auto& traits : EstimatorList()) {
      progress.Advance(1, traits.name);
      if (!MayBeChosen(traits, scene_, request_)) continue;
      // Its table is built for the view: a choice for those who name it.
      if (traits.needs.volume && request_.estimators.empty()) continue;
      picture_.estimator = traits.name;
      ways.push_back(
          WayOf(traits.name, TakePilot(0, luminaires_), others,
                traits.error_is_asked ? picture_.approximation_error : traits.rel_error));
    }
    return ways;
  }

  // Of the lights from `first` to before `end`.
  Pilot TakePilot(std::size_t first, std::size_t end) {
    RenderOptions options = picture_;
    const double pixels = static_cast<double>(picture_.width) * picture_.height,
                 shrink = std::min(1.0, std::sqrt(kPilotPixels / pixels));
    options.width = std::max(1, static_cast<int>(std::lround(shrink * picture_.width)));
    options.height = std::max(1, static_cast<int>(std::lround(shrink * picture_.height)));
    options.antialias = 1;
    const auto render = [&](int samples, int passes) {
      options.passes = passes;
      options.first_pass = kPassNumbers - 2 * passes;  // numbers that no round has
      options.light_samples.assign(lights_, 0);
      std::fill(options.light_samples.begin() + static_cast<std::ptrdiff_t>(first),
                options.light_samples.begin() + static_cast<std::ptrdiff_t>(end), passes * samples);
      return Renderer(scene_, options).Render();
    };
    // The first one also warms the kernels up.
    const Frame few = render(kPilotSamples[0], kPilotPasses), one = render(kPilotSamples[0], 1),
                many = render(kPilotSamples[1], kPilotPasses);
    const double scale = pixels / (static_cast<double>(options.width) * options.height);
    const PictureNoise noise = NoiseOf(many, kPilotPasses - 1);
    Pilot pilot;
    pilot.margin = noise.Margin();
    pilot.shown = noise.mean_luminance;
    for (std::size_t l = 0; l < lights_; ++l) {
      LightLaw law;
      law.points = picture_.antialias;
      law.least = 2 * picture_.antialias;
      law.variance.Add(kPilotSamples[0], kPilotPasses * few.lights[l].mean_variance);
      law.variance.Add(kPilotSamples[1], kPilotPasses * many.lights[l].mean_variance);
      const double few_s = scale * one.times.light_s[l],
                   many_s = scale * many.times.light_s[l] / kPilotPasses;
      law.sample_s = std::max(kLeastShare * many_s / kPilotSamples[1],
                              (many_s - few_s) / (kPilotSamples[1] - kPilotSamples[0]));
      law.fixed_s = picture_.antialias * std::max(0.0, many_s - kPilotSamples[1] * law.sample_s);
      pilot.laws.push_back(law);
      pilot.luminance.push_back(many.lights[l].mean_luminance);
      pilot.shown -= many.lights[l].mean_luminance;
    }
    return pilot;
  }

  Way WayOf(const std::string& name, const Pilot& luminaires, const Pilot& others,
            double approximation) const {
    Way way;
    way.setting.estimator = name;
    way.margin = std::max(luminaires.margin, others.margin);
    double of_luminaires = 0;
    way.mean_luminance = others.shown;
    for (std::size_t l = 0; l < lights_; ++l) {
      const Pilot& pilot = l < luminaires_ ? luminaires : others;
      way.laws.push_back(pilot.laws[l]);
      way.mean_luminance += pilot.luminance[l];
      if (l < luminaires_) of_luminaires += pilot.luminance[l];
    }
    if (way.mean_luminance > 0)
      way.approximation = approximation * std::min(1.0, of_luminaires / way.mean_luminance);
    way.samples = request_.rel_error
                      ? SamplesForVariance(
                            way.laws, kAim * kAim * Allowed(way, way.margin, way.mean_luminance))
                      : SamplesForSeconds(way.laws, *request_.time_s);
    for (const double n : way.samples) way.setting.samples_per_pixel += static_cast<int>(n);
    way.setting.predicted_s = SecondsOf(way.laws, way.samples);
    if (way.mean_luminance > 0)
      way.setting.predicted_error = std::hypot(
          std::sqrt(VarianceOf(way.laws, way.samples)) / way.mean_luminance, way.approximation);
    return way;
  }

  // Variance of a picture that keeps the error asked for.
  double Allowed(const Way& way, double margin, double mean_luminance) const {
    return std::pow(NoiseShare(*request_.rel_error, way.approximation) * mean_luminance, 2) /
           margin;
  }

  void Choose() {
    const core::Stopwatch stopwatch;
    std::vector<Way> ways = Ways();
    std::stable_sort(ways.begin(), ways.end(), [&](const Way& a, const Way& b) {
      return IsBetter(request_, a.setting, b.setting);
    });
    result_.choosing_s = stopwatch.WallSeconds();
    for (const Way& way : ways) result_.considered.push_back(way.setting);
    way_ = std::move(ways.front());
    result_.chosen = way_->setting;
    result_.chosen.samples_per_pixel = 0;
    picture_.estimator = luminaires_ > 0 && !picture_.knobs.strategies.everywhere
                             ? way_->setting.estimator
                             : request_.picture.estimator;
    if (request_.time_s) FirstInTime(*way_);
  }

  // Those of a round that does not take too long, if they are fewer; whether they are.
  bool Shorten(std::vector<double>& samples) const {
    if (!request_.round_s) return false;
    const double most_s =
                     std::max(*request_.round_s, kLongestRound * result_.frame.times.lighting_s),
                 whole_s = SecondsOf(way_->laws, samples);
    if (whole_s <= most_s) return false;
    std::vector<double> fewer = SamplesForSeconds(way_->laws, most_s);
    if (SecondsOf(way_->laws, fewer) > kHardlyLess * whole_s) return false;
    samples = std::move(fewer);
    return true;
  }

  void Add(Frame frame, const std::vector<double>& samples) {
    const int more = static_cast<int>(std::accumulate(samples.begin(), samples.end(), 0.0));
    if (++result_.rounds == 1) {
      result_.frame = std::move(frame);
    } else {
      // Weighed by what is known of the noise without the frame's own samples; where there is none,
      // as in the dark, by the samples.
      const double expected = VarianceOf(way_->laws, samples);
      const bool noisy = variance_ > 0 && expected > 0;
      result_.frame =
          MeanFrame(result_.frame, noisy ? 1 / variance_ : result_.chosen.samples_per_pixel, frame,
                    noisy ? 1 / expected : more);
    }
    result_.chosen.samples_per_pixel += more;
  }

  // The clock is not as quick, or as slow, as in the pilots: part of the time is taken first where
  // another round costs little.
  void FirstInTime(Way& way) const {
    double fixed_s = 0;
    for (const LightLaw& law : way.laws) fixed_s += law.fixed_s;
    if (fixed_s < kLittle * *request_.time_s)
      way.samples = SamplesForSeconds(way.laws, kFirstShare * *request_.time_s);
  }

  // What is left after the first round, at its pace. False if nothing fits in.
  bool RestOfTime(Way& way, const RenderTimes& taken) const {
    const double left_s = *request_.time_s - taken.lighting_s;
    if (left_s < kLittle * *request_.time_s) return false;
    for (std::size_t l = 0; l < lights_; ++l) {
      LightLaw& law = way.laws[l];
      const double predicted_s = law.Seconds(way.samples[l]),
                   pace = predicted_s > 0 ? taken.light_s[l] / predicted_s : 1;
      law.fixed_s *= pace;
      law.sample_s *= pace;
    }
    way.samples = SamplesForSeconds(way.laws, left_s);
    return SecondsOf(way.laws, way.samples) <= left_s;
  }

  // A round that brings the picture down to the aim: variances of independent frames, weighed by
  // their inverses, add as 1 / V = 1 / V_1 + 1 / V_2. `lights` is what the last round showed.
  void WantMore(Way& way, const std::vector<double>& taken, const std::vector<LightTotals>& lights,
                double aim) const {
    for (std::size_t l = 0; l < lights_; ++l) {
      LightLaw& law = way.laws[l];
      const double samples = taken[l] / law.points, shown = lights[l].mean_variance * law.points;
      if (law.variance.points.empty()) law.variance.Add(samples, shown);
      law.variance.Anchor(samples, shown);
    }
    const double further = 1 / (1 / aim - 1 / variance_);
    way.samples = SamplesForVariance(way.laws, std::min(further, variance_ / kLeastRound));
  }

  LitScene& scene_;
  const AccuracyRequest request_;
  RenderOptions picture_;
  std::size_t luminaires_, lights_;
  std::optional<Way> way_;  // that was chosen, in the first round
  double variance_ = 0;     // of the picture so far
  int whole_rounds_ = 0;    // that aimed at what is asked for
};

}  // namespace

std::unique_ptr<AccurateRendering> BeginRenderingLights(LitScene& scene,
                                                        const AccuracyRequest& request) {
  return std::make_unique<LightByLight>(scene, request);
}

}  // namespace luxfield::render
