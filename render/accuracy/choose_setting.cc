#include "luxfield/render/accuracy/choose_setting.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"

namespace luxfield::render {
namespace {

constexpr int kPilotPixels = 3072;
constexpr int kPilotPasses = 4;
constexpr int kPilotSamples[2] = {8, 32};  // of a pass
// The pilot of the setting that is about to be taken is a part of the picture: a pixel of four.
constexpr int kBegunEvery = 2;  // rows and columns
constexpr int kBegunSamples = 8;
// Of the target, in the first round; the margin that its picture is expected to need.
constexpr double kFirstAim = 0.9, kFirstMargin = 1.2;
// Logarithm by which its pilot may overstate the variance: pixels that lack samples then get them in
// a further round, which the others are spared.
constexpr double kMostDoubt = 0.7;
constexpr int kLeastSamples = 2;  // of a surface point
// A pixel takes at least what costs this share of its fixed part: hardly any time, against rounds
// that estimates from a few samples make necessary.
constexpr double kNearlyFree = 0.3;
constexpr double kSteepest = 2;                // power of the samples by which variances may fall
constexpr double kVolumeChannel_core_s = 0.6;  // to build, measured on 25 to 99 images of 256^2
// The picture knows its scale by the pixels that are lit again twice (render/film/relit_pixels.h):
// about this over their number is the variance of its logarithm.
constexpr double kLogVarianceOfOneRelit = 6, kRelitShare = 0.125;
constexpr double kLeastRelit = 256, kMostRelit = 2048;
// Densities of even pilots, which every pixel needs some of.
constexpr double kLeastDensity = 0.125;
constexpr int kDensityRounds = 2;
constexpr int kPassNumbers = 1 << 16;
// Of the target, asked of volumes and gloss; less where noise comes on top.
constexpr double kApproximationShare = 0.5, kApproximationShareOfNoisy = 0.25;

// A picture of `pixels` at most, of the same shape.
struct Size {
  int width, height;
  Size Within(double pixels) const {
    const double shrink = std::min(1.0, std::sqrt(pixels / Pixels()));
    return {std::max(1, static_cast<int>(std::lround(width * shrink))),
            std::max(1, static_cast<int>(std::lround(height * shrink)))};
  }
  double Pixels() const { return static_cast<double>(width) * height; }
};

class Chooser {
 public:
  Chooser(LitScene& scene, const CostModel& costs, const AccuracyRequest& request)
      : scene_(scene), costs_(costs), request_(request) {
    const auto& camera = scene.camera();
    picture_ = {request.picture.width > 0 ? request.picture.width : camera.width,
                request.picture.height > 0 ? request.picture.height : camera.height};
    pilot_ = picture_.Within(kPilotPixels);
  }

  std::vector<Candidate> Choose() {
    // In place of the pilots' own.
    core::Progress progress("pilots", EstimatorList().size() + 1);
    std::vector<Candidate> candidates;
    for (const bool interpolating : {false, true})
      for (const auto& traits : EstimatorList()) {
        if (traits.needs.volume != interpolating) continue;
        progress.Advance(1, traits.name);
        if (!IsWanted(traits)) continue;
        if (interpolating && !IsWorthAVolume(traits, candidates)) continue;
        if (auto candidate = Measure(traits, candidates)) candidates.push_back(*candidate);
      }
    if (request_.rel_error)
      std::erase_if(candidates, [&](const Candidate& candidate) {
        return candidate.interpolation_error > kAim * *request_.rel_error;
      });
    if (candidates.empty())
      throw InputError(
          "no estimator that states its error can light this scene; name one with --estimator and "
          "its samples with --spp");
    Sort(candidates);
    while (request_.rel_error && Begin(candidates.front())) Sort(candidates);
    progress.Advance();
    return candidates;
  }

 private:
  bool Shadowed() const { return request_.picture.shadows != Shadows::kNone; }

  void Sort(std::vector<Candidate>& candidates) const {
    std::stable_sort(candidates.begin(), candidates.end(),
                     [&](const Candidate& a, const Candidate& b) {
                       return IsBetter(request_, a.setting, b.setting);
                     });
  }

  // Lights a share of the picture's pixels, which tells noise and time better. False if that was
  // done already, or if there is no noise.
  bool Begin(Candidate& candidate) {
    if (!candidate.samples || candidate.begun) return false;
    RenderOptions options = request_.picture;
    options.estimator = candidate.setting.estimator;
    options.approximation_error = ApproximationError(request_);
    options.sample_density = core::Image(picture_.width, picture_.height, 1);
    for (int row = 0; row < picture_.height; row += kBegunEvery)
      for (int column = 0; column < picture_.width; column += kBegunEvery)
        options.sample_density.at(0, row, column) = 1;
    options.samples_per_pixel = std::max(kBegunSamples, candidate.shown);
    BegunPicture begun{Renderer(scene_, options).Render(), options.sample_density};
    for (float& n : begun.taken.data) n *= static_cast<float>(options.samples_per_pixel);
    const double hits = SumOf(begun.frame.coverage);
    for (std::size_t i = 0; i < begun.taken.data.size() && hits > 0; ++i)
      begun.lit += begun.frame.coverage.data[i] > 0 && begun.taken.data[i] > 0 ? 1 / hits : 0;
    begun.samples = begun.lit * options.samples_per_pixel;
    candidate.begun = std::move(begun);
    LearnFromBegun(candidate);
    return true;
  }

  // Times, and samples of the first round.
  void LearnFromBegun(Candidate& candidate) const {
    const BegunPicture& begun = *candidate.begun;
    candidate.lit_s = Corrected(candidate, candidate.work_of_one, 0);
    candidate.sample_s =
        (Corrected(candidate, candidate.work_of_one, 1) - candidate.lit_s) / candidate.density.mean;
    const double spent_s = LightingSeconds(scene_.device(), begun.frame.times),
                 expected_s = candidate.RoundSeconds(begun.lit, begun.samples);
    if (expected_s > 0)
      for (double* factor : {&candidate.fixed_correction, &candidate.sample_correction,
                             &candidate.lit_s, &candidate.sample_s})
        *factor *= spent_s / expected_s;
    if (begun.lit > 0)
      candidate.mean_luminance = NoiseOf(begun.frame, 1).mean_luminance / begun.lit;
    const FurtherRound round =
        PlanFurtherRound(begun.frame, begun.taken, candidate.law,
                         candidate.Aim(candidate.FirstAim(*request_.rel_error)));
    candidate.setting.samples_per_pixel =
        static_cast<int>(std::lround(begun.samples + round.samples));
    candidate.setting.predicted_s =
        candidate.build_s + spent_s + candidate.RoundSeconds(round.lit, round.samples);
    candidate.setting.predicted_error =
        candidate.mean_luminance > 0
            ? std::hypot(std::sqrt(round.variance) / candidate.mean_luminance,
                         candidate.interpolation_error)
            : 0;  // of a black picture there is nothing to miss
  }

  // What lighting took; of a time asked for by the clock.
  double Spent(const RenderTimes& times) const {
    return request_.rel_error ? LightingSeconds(scene_.device(), times) : times.lighting_s;
  }

  // Samples go where a pilot finds the noise.
  void DealOut(Candidate& candidate, const Frame& pilot) const {
    const double even_scale = candidate.law.scale / candidate.density.variance;
    for (int i = 0; i < kDensityRounds; ++i) {
      candidate.density =
          DensityFrom(pilot, candidate.LeastDensity(candidate.setting.samples_per_pixel));
      candidate.law.scale = even_scale * candidate.density.variance;
      Predict(candidate);
    }
  }

  // What a pilot of several passes of k samples tells of the picture's noise. Its pixels' mean
  // variance is off the picture's by the draw of pixels, the factor between stated and true
  // variance by the scatter of the passes.
  void Learn(Candidate& candidate, const Size& size, int k, const Frame& pilot, int passes) const {
    const PictureNoise spread = NoiseOf(pilot, passes - 1);
    PictureNoise noise = NoiseOf(pilot, passes * std::max(1, k - 1), &Frame::stated_variance);
    candidate.mean_luminance = spread.mean_luminance;
    candidate.law.Anchor(k, spread.mean_variance * passes);
    if (noise.mean_variance > 0 && spread.mean_variance > 0) {
      noise.scale = spread.mean_variance / noise.mean_variance;
      noise.scale_log_variance =
          kLogVarianceOfOneRelit /
          std::clamp(kRelitShare * picture_.Pixels(), kLeastRelit, kMostRelit);
    }
    noise.degrees = std::max(1, k - 1);
    noise.effective_pixels *= picture_.Pixels() / size.Pixels();
    candidate.spread = std::sqrt((1 + 2.0 / (passes - 1)) / spread.effective_pixels +
                                 2.0 / noise.degrees / noise.effective_pixels);
    candidate.margin = noise.Margin();
  }

  // The volume of this view pays where it saves more than it takes to build; for a time asked for,
  // where nothing else is noise-free in it.
  bool IsWorthAVolume(const EstimatorTraits& volume, const std::vector<Candidate>& others) const {
    if (!request_.rel_error)
      return std::none_of(others.begin(), others.end(), [&](const Candidate& other) {
        return !other.samples && other.setting.predicted_s <= *request_.time_s;
      });
    int channels = 0;
    for (const auto& luminaire : scene_.luminaires())
      channels += luminaire.light_field->geometry().channels;
    const double build_s = kVolumeChannel_core_s * channels / core::Threads();
    return std::none_of(others.begin(), others.end(), [&](const Candidate& other) {
      const auto& setting = other.setting;
      return setting.predicted_error <= *request_.rel_error &&
             setting.predicted_s <
                 build_s + Seconds(volume.name, other.work_of_one, setting.samples_per_pixel);
    });
  }

  bool IsWanted(const EstimatorTraits& traits) const {
    return costs_.Knows(traits.name) && MayBeChosen(traits, scene_, request_);
  }

  RenderOptions PilotOptions(const std::string& estimator, const Size& size, int samples,
                             int passes) const {
    RenderOptions options = request_.picture;
    options.estimator = estimator;
    if (request_.rel_error) options.approximation_error = ApproximationError(request_);
    options.width = size.width;
    options.height = size.height;
    options.antialias = 1;
    options.passes = passes;
    options.relight = false;  // passes tell the noise, and one is timed
    options.samples_per_pixel = samples * passes;
    // Numbers that no pass of the picture has, nor pilots of another number of passes.
    options.first_pass = kPassNumbers - 2 * passes;
    return options;
  }

  Frame Pilot(const std::string& estimator, const Size& size, int samples, int passes) {
    return Renderer(scene_, PilotOptions(estimator, size, samples, passes)).Render();
  }

  LightingWork PictureWork(const Frame& pilot, int samples, double pixels) const {
    std::vector<cl_float4> positions(pilot.coverage.data.size());
    for (std::size_t i = 0; i < positions.size(); ++i)
      positions[i] = {{pilot.position.plane(0)[i], pilot.position.plane(1)[i],
                       pilot.position.plane(2)[i], pilot.coverage.data[i]}};
    const double scale = pixels / static_cast<double>(positions.size());
    LightingWork sum;
    for (const auto& luminaire : scene_.luminaires()) {
      const auto work = WorkOf(positions, luminaire.light_field->geometry(),
                               luminaire.world_from_luminaire, samples, Shadowed());
      sum.pixels += scale * work.pixels;
      sum.images += scale * work.images;
      sum.texels += scale * work.texels;
      // Samples are counted over all luminaires.
      sum.samples += scale * work.samples / static_cast<double>(scene_.luminaires().size());
      sum.rays += scale * work.rays / static_cast<double>(scene_.luminaires().size());
    }
    return sum;
  }

  // Empty where the first pilot shows that others are cheaper, whatever the second one says.
  std::optional<Candidate> Measure(const EstimatorTraits& traits,
                                   const std::vector<Candidate>& others) {
    Candidate candidate;
    candidate.setting.estimator = traits.name;
    candidate.samples = TakesSamples(traits, Shadowed());
    const double tables_before_s = scene_.tables_core_s();
    // The first pilot also warms the kernels up; those of one pass are timed.
    const Frame first =
        Pilot(traits.name, pilot_, kPilotSamples[0], candidate.samples ? kPilotPasses : 1);
    candidate.work_of_one = PictureWork(first, 1, picture_.Pixels() * request_.picture.antialias);
    candidate.interpolation_error =
        traits.error_is_asked ? PilotOptions(traits.name, pilot_, 1, 1).approximation_error
                              : traits.rel_error;
    if (traits.needs.volume) {
      // Tables for one picture count as its time, spread over the cores that build them.
      if (request_.rel_error)
        candidate.build_s = (scene_.tables_core_s() - tables_before_s) / core::Threads();
      candidate.interpolation_error = InterpolationError(traits.name);
    }
    const double few_s = Spent(Pilot(traits.name, pilot_, kPilotSamples[0], 1).times);
    if (!candidate.samples) {
      Time(candidate, first, {0, few_s}, {0, few_s});
      Predict(candidate);
      return candidate;
    }
    const double v = NoiseOf(first, kPilotPasses - 1).mean_variance * kPilotPasses;
    candidate.law.Add(kPilotSamples[0], v);
    candidate.law.Add(2 * kPilotSamples[0], v / std::pow(2, kSteepest));
    Learn(candidate, pilot_, kPilotSamples[0], first, kPilotPasses);
    Time(candidate, first, {kPilotSamples[0], few_s}, {kPilotSamples[0], few_s});
    Predict(candidate);
    DealOut(candidate, first);
    if (request_.rel_error && IsBeaten(candidate, others)) return std::nullopt;
    const Frame second = Pilot(traits.name, pilot_, kPilotSamples[1], kPilotPasses);
    candidate.law = {};
    candidate.density = {};
    candidate.law.Add(kPilotSamples[0], v);
    candidate.law.Add(kPilotSamples[1],
                      NoiseOf(second, kPilotPasses - 1).mean_variance * kPilotPasses);
    Learn(candidate, pilot_, kPilotSamples[1], second, kPilotPasses);
    Time(candidate, first, {kPilotSamples[0], few_s},
         {kPilotSamples[1], Spent(second.times) / kPilotPasses});
    Predict(candidate);
    DealOut(candidate, second);
    return candidate;
  }

  struct TimedPass {
    int samples = 0;
    double s = 0;
  };

  // Corrects the model by what passes of few and of many samples take, lit like `pilot`; by both
  // alike where they are one, or where the clock does not tell them apart.
  void Time(Candidate& candidate, const Frame& pilot, const TimedPass& few,
            const TimedPass& many) const {
    const auto model_s = [&](double samples) {
      return Seconds(candidate.setting.estimator, PictureWork(pilot, 1, pilot_.Pixels()), samples);
    };
    const double fixed_model_s = model_s(0), sample_model_s = model_s(1) - model_s(0);
    if (many.samples > few.samples) {
      const double sample_s = (many.s - few.s) / (many.samples - few.samples),
                   fixed_s = few.s - few.samples * sample_s;
      if (sample_s > 0 && fixed_s > 0 && fixed_model_s > 0 && sample_model_s > 0) {
        candidate.fixed_correction = fixed_s / fixed_model_s;
        candidate.sample_correction = sample_s / sample_model_s;
        return;
      }
    }
    if (const double all_s = model_s(many.samples); all_s > 0)
      candidate.fixed_correction = candidate.sample_correction = many.s / all_s;
  }

  static bool IsBeaten(const Candidate& candidate, const std::vector<Candidate>& others) {
    return std::any_of(others.begin(), others.end(), [&](const Candidate& other) {
      return other.setting.predicted_s < candidate.setting.predicted_s;
    });
  }

  // Against `exact`, at the pilot's pixels.
  double InterpolationError(const std::string& estimator) {
    RenderOptions options = PilotOptions(estimator, pilot_, 1, 1);
    options.shadows = Shadows::kNone;
    const auto interpolated = Renderer(scene_, options).Render();
    options.estimator = "exact";
    return LuminanceError(interpolated.radiance, Renderer(scene_, options).Render().radiance);
  }

  // By the cost model, of the work of one sample per pixel times `samples`.
  double Seconds(const std::string& estimator, LightingWork work, double samples) const {
    work.samples *= samples;
    work.rays *= samples;
    return costs_.Seconds(estimator, work);
  }

  // The same as pilots correct it.
  double Corrected(const Candidate& candidate, const LightingWork& work, double samples) const {
    const auto& estimator = candidate.setting.estimator;
    const double fixed_s = Seconds(estimator, work, 0);
    return candidate.fixed_correction * fixed_s +
           candidate.sample_correction *
               (Seconds(estimator, work, candidate.density.mean * samples) - fixed_s);
  }

  // That show a variance: of every surface point, and of luminaires that are not drawn from
  // (render/many_lights.h) of each.
  double LeastSamples(const std::string& estimator) const {
    const bool drawn = scene_.EstimatorNamed(estimator).traits().takes_tasks;
    return static_cast<double>(kLeastSamples) * request_.picture.antialias *
           (drawn ? 1.0 : static_cast<double>(scene_.luminaires().size()));
  }

  // Samples, time and error of the candidate's best setting.
  void Predict(Candidate& candidate) const {
    auto& setting = candidate.setting;
    const auto seconds = [&](double samples) {
      return candidate.build_s + Corrected(candidate, candidate.work_of_one, samples);
    };
    if (!candidate.samples) {
      setting.predicted_s = seconds(0);
      setting.predicted_error = candidate.interpolation_error;
      return;
    }
    const double fixed_s = seconds(0), per_sample_s = seconds(1) - fixed_s,
                 shown = LeastSamples(setting.estimator);
    double samples = kMaxSamples;
    candidate.least = shown;
    candidate.shown = static_cast<int>(shown);
    if (request_.rel_error) {
      if (per_sample_s > 0)
        candidate.least = std::clamp(kNearlyFree * (fixed_s - candidate.build_s) / per_sample_s,
                                     shown, double{kMaxSamples});
      samples = CheapestSamples(candidate, seconds);
    } else if (per_sample_s > 0) {
      samples = (*request_.time_s - fixed_s) / per_sample_s;
    }
    samples = std::clamp(samples, candidate.least, double{kMaxSamples});
    setting.predicted_s = seconds(samples);
    setting.samples_per_pixel = static_cast<int>(samples);
    setting.predicted_error =
        std::hypot(std::sqrt(candidate.RelativeVariance(setting.samples_per_pixel)),
                   candidate.interpolation_error);
  }

  // Samples of the first round whose time, with that of a second one as often as it is needed, is
  // least: the picture's variance is taken as log-normal about the law's.
  double CheapestSamples(const Candidate& candidate,
                         const std::function<double(double)>& seconds) const {
    const double allowed =
        std::pow(NoiseShare(*request_.rel_error, candidate.interpolation_error), 2) /
        candidate.margin;
    double best = kMaxSamples, best_s = std::numeric_limits<double>::infinity();
    for (double samples = candidate.least; samples < kMaxSamples; samples *= 1.05) {
      const double noise = candidate.RelativeVariance(samples);
      const double missing = noise > 0 ? 0.5 * std::erfc(std::log(allowed / noise) /
                                                         (std::numbers::sqrt2 * candidate.spread))
                                       : 0;
      const double expected_s =
          seconds(samples) + missing * seconds(std::max(candidate.least, samples / 4));
      if (missing < 0.5 && expected_s < best_s) {
        best = samples;
        best_s = expected_s;
      }
      if (missing < 1e-3) break;
    }
    return best;
  }

  LitScene& scene_;
  const CostModel& costs_;
  const AccuracyRequest& request_;
  Size picture_{}, pilot_{};
};

}  // namespace

// What is asked of estimators that approximate.
double ApproximationError(const AccuracyRequest& request) {
  return *request.rel_error * (request.picture.shadows == Shadows::kNone
                                   ? kApproximationShare
                                   : kApproximationShareOfNoisy);
}

// What an approximation leaves of an error for noise.
double NoiseShare(double rel_error, double approximation) {
  return std::sqrt(std::max(0.01 * rel_error * rel_error,
                            rel_error * rel_error - approximation * approximation));
}

double LightingSeconds(const Device& device, const RenderTimes& times) {
  const DeviceInfo& info = device.info();
  return info.is_cpu ? times.lighting_core_s / info.compute_units : times.lighting_s;
}

double Candidate::LeastDensity(double k) const { return std::clamp(least / k, kLeastDensity, 1.0); }

FurtherAim Candidate::Aim(double variance) const {
  return {.variance = variance, .unit = shown, .least = least, .most = kMaxSamples};
}

double Candidate::FirstAim(double rel_error) const {
  const double doubt = std::sqrt(begun->frame.scale_log_variance);
  return std::exp(std::min(kMostDoubt, doubt)) / kFirstMargin *
         std::pow(kFirstAim * NoiseShare(rel_error, interpolation_error) * mean_luminance, 2);
}

double Candidate::RelativeVariance(double k) const {
  return mean_luminance > 0 ? law.Of(k) / (mean_luminance * mean_luminance) : 0;
}

std::vector<Candidate> ChooseSetting(LitScene& scene, const CostModel& costs,
                                     const AccuracyRequest& request) {
  return Chooser(scene, costs, request).Choose();
}

}  // namespace luxfield::render
