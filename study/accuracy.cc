#include "study/accuracy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/measures.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/stopwatch.h"

namespace luxfield::study {
namespace {

constexpr int kPilotPixels = 3072;
constexpr int kPilotPasses = 4;
constexpr int kPilotSamples[2] = {8, 32};  // of a pass
// The fewest that show their variance: a pass gains more from stratification the larger it is, and
// has costs of its own.
constexpr int kPasses = 2;
constexpr double kExtrapolate = 2;  // that is needed beyond this many times the samples of the last
constexpr int kMaxRounds = 12;
constexpr int kMaxSamples = 1 << 20;
constexpr double kMinPower = 0.8, kMaxPower = 2;  // of the variance over the samples
constexpr double kVolumeChannel_core_s = 0.6;     // to build, measured on 25 to 99 images of 256^2
// Of the target, asked of volumes and gloss; less where noise comes on top.
constexpr double kApproximationShare = 0.5, kApproximationShareOfNoisy = 0.25;
constexpr double kAim = 0.93;  // of the target, so that one round is mostly enough

// Mean variance and mean luminance over the pixels, and how far the former may be off: variances v
// of `degrees` of freedom each, from the spread between passes.
struct Noise {
  double mean_luminance = 0, mean_variance = 0;
  double effective_pixels = 0;  // (sum v)^2 / sum v^2 of the true ones; E v^2 is 1 + 2 / degrees
                                // times theirs where noise is normal
  int degrees = 1;

  double RelativeError() const {
    return mean_luminance > 0 ? std::sqrt(mean_variance) / mean_luminance : 0;
  }
  // The true squared error exceeds this many times the estimate in 5 % of cases: both the sum of
  // squared errors and the sum of variances scatter.
  double Margin() const {
    return 1 + 1.645 * std::sqrt(2 / effective_pixels * (1 + 1.0 / degrees));
  }
};

Noise NoiseOf(const render::Frame& frame, int degrees) {
  Noise noise;
  noise.degrees = degrees;
  const core::Image luminances = core::LuminanceImage(frame.radiance);
  double sum = 0, squares = 0, luminance = 0;
  const std::size_t count = frame.variance.data.size();
  for (std::size_t i = 0; i < count; ++i) {
    const double v = frame.variance.data[i];
    sum += v;
    squares += v * v;
    luminance += luminances.data[i];
  }
  noise.mean_variance = sum / static_cast<double>(count);
  noise.mean_luminance = luminance / static_cast<double>(count);
  noise.effective_pixels =
      squares > 0 ? (1 + 2.0 / degrees) * sum * sum / squares : static_cast<double>(count);
  return noise;
}

// v(k), the mean variance of a pass of k samples: log-log between measured points, with the slopes
// of the outer ones beyond them.
struct VarianceLaw {
  std::map<double, double> points;  // k -> v > 0
  double scale = 1;                 // of the picture's variance over the pilots'
  double mean_luminance = 0;

  void Add(double k, double v) {
    if (v > 0) points[k] = v;
  }
  bool Reaches(double k) const {
    return points.empty() || (k <= kExtrapolate * points.rbegin()->first &&
                              k >= points.begin()->first / kExtrapolate);
  }
  double Of(double k) const {
    if (points.empty()) return 0;
    auto right = points.upper_bound(k);
    if (right == points.end()) --right;
    if (right == points.begin() && points.size() > 1) ++right;
    const auto left = right == points.begin() ? right : std::prev(right);
    const double power = left == right ? 1
                                       : std::clamp(std::log(left->second / right->second) /
                                                        std::log(right->first / left->first),
                                                    kMinPower, kMaxPower);
    const auto& near = k < right->first ? *left : *right;
    return scale * near.second * std::pow(k / near.first, -power);
  }
  // Of the mean of kPasses passes with `samples` in all.
  double VarianceOf(double samples) const { return Of(samples / kPasses) / kPasses; }
  double ErrorOf(double samples) const {
    return mean_luminance > 0 ? std::sqrt(VarianceOf(samples)) / mean_luminance : 0;
  }
  double SamplesFor(double rel_error) const {
    double low = kPasses, high = kMaxSamples;
    while (high > 1.01 * low) {
      const double middle = std::sqrt(low * high);
      (ErrorOf(middle) > rel_error ? low : high) = middle;
    }
    return high;
  }
};

// What is asked of estimators that approximate.
double ApproximationError(const AccuracyRequest& request) {
  return *request.rel_error * (request.picture.shadows == render::Shadows::kNone
                                   ? kApproximationShare
                                   : kApproximationShareOfNoisy);
}

// What an approximation leaves of an error for noise.
double NoiseShare(double rel_error, double approximation) {
  return std::sqrt(std::max(0.01 * rel_error * rel_error,
                            rel_error * rel_error - approximation * approximation));
}

struct Candidate {
  Setting setting;
  bool samples = false;  // takes samples here
  VarianceLaw law;
  double interpolation_error = 0;  // of noise-free parts; relative RMSE
  double build_s = 0;              // of tables that only this picture needs
  LightingWork work_of_one;        // of the picture, one sample per pixel
  double cost_correction = 1;      // pilot's time over the model's
  double margin = 1;               // Noise::Margin of the picture
};

class Chooser {
 public:
  Chooser(render::LitScene& scene, const CostModel& costs, const AccuracyRequest& request)
      : scene_(scene), costs_(costs), request_(request) {
    const auto& camera = scene.camera();
    width_ = request.picture.width > 0 ? request.picture.width : camera.width;
    height_ = request.picture.height > 0 ? request.picture.height : camera.height;
    const double shrink =
        std::min(1.0, std::sqrt(kPilotPixels / (static_cast<double>(width_) * height_)));
    pilot_width_ = std::max(1, static_cast<int>(std::lround(width_ * shrink)));
    pilot_height_ = std::max(1, static_cast<int>(std::lround(height_ * shrink)));
  }

  std::vector<Candidate> Choose() {
    std::vector<Candidate> candidates;
    for (const bool interpolating : {false, true})
      for (const auto& traits : render::EstimatorList()) {
        if (!IsWanted(traits) || traits.needs.volume != interpolating) continue;
        if (interpolating && !IsWorthAVolume(traits, candidates)) continue;
        candidates.push_back(Measure(traits));
        Predict(candidates.back());
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
    while (request_.rel_error && Check(candidates.front())) Sort(candidates);
    return candidates;
  }

 private:
  bool Shadowed() const { return request_.picture.shadows != render::Shadows::kNone; }

  void Sort(std::vector<Candidate>& candidates) const {
    const bool by_time = request_.time_s.has_value();
    std::stable_sort(candidates.begin(), candidates.end(),
                     [&](const Candidate& a, const Candidate& b) {
                       return by_time ? a.setting.predicted_error < b.setting.predicted_error
                                      : a.setting.predicted_s < b.setting.predicted_s;
                     });
  }

  // Samples far beyond those of the pilots are tried, since variances do not follow power laws that
  // far. False if there was nothing to try.
  bool Check(Candidate& candidate) {
    const int of_pass = candidate.setting.samples_per_pixel / kPasses;
    if (!candidate.samples || candidate.law.Reaches(of_pass)) return false;
    const Noise noise =
        NoiseOf(Pilot(candidate.setting.estimator, of_pass, kPilotPasses), kPilotPasses - 1);
    candidate.law.Add(of_pass, noise.mean_variance * kPilotPasses);
    Predict(candidate);
    return true;
  }

  // The volume of this view pays where it saves more than it takes to build; for a time asked for,
  // where nothing else is noise-free in it.
  bool IsWorthAVolume(const render::EstimatorTraits& volume,
                      const std::vector<Candidate>& others) const {
    if (!request_.rel_error)
      return std::none_of(others.begin(), others.end(), [&](const Candidate& other) {
        return !other.samples && other.setting.predicted_s <= *request_.time_s;
      });
    int channels = 0;
    for (const auto& luminaire : scene_.luminaires())
      channels += luminaire.light_field->field.geometry.channels;
    const double build_s = kVolumeChannel_core_s * channels / core::Threads();
    return std::none_of(others.begin(), others.end(), [&](const Candidate& other) {
      const auto& setting = other.setting;
      return setting.predicted_error <= *request_.rel_error &&
             setting.predicted_s <
                 build_s + Seconds(volume.name, other.work_of_one, setting.samples_per_pixel);
    });
  }

  bool IsWanted(const render::EstimatorTraits& traits) const {
    const auto& names = request_.estimators;
    return costs_.Knows(traits.name) &&
           StatesItsError(traits, scene_.geometry().glossy, Shadowed()) &&
           (names.empty() || std::find(names.begin(), names.end(), traits.name) != names.end());
  }

  render::RenderOptions PilotOptions(const std::string& estimator, int samples, int passes) const {
    render::RenderOptions options = request_.picture;
    options.estimator = estimator;
    if (request_.rel_error) options.approximation_error = ApproximationError(request_);
    options.width = pilot_width_;
    options.height = pilot_height_;
    options.antialias = 1;
    options.passes = passes;
    options.samples_per_pixel = samples * passes;
    // Numbers that no pass of the picture has.
    options.first_pass = (1 << 16) - passes;
    return options;
  }

  render::Frame Pilot(const std::string& estimator, int samples, int passes) {
    return render::Renderer(scene_, PilotOptions(estimator, samples, passes)).Render();
  }

  LightingWork PictureWork(const render::Frame& pilot, int samples, double pixels) const {
    std::vector<cl_float4> positions(pilot.coverage.data.size());
    for (std::size_t i = 0; i < positions.size(); ++i)
      positions[i] = {{pilot.position.plane(0)[i], pilot.position.plane(1)[i],
                       pilot.position.plane(2)[i], pilot.coverage.data[i]}};
    const double scale = pixels / static_cast<double>(positions.size());
    LightingWork sum;
    for (const auto& luminaire : scene_.luminaires()) {
      const auto work = WorkOf(positions, luminaire.light_field->field.geometry,
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

  Candidate Measure(const render::EstimatorTraits& traits) {
    Candidate candidate;
    candidate.setting.estimator = traits.name;
    candidate.samples = TakesSamples(traits, Shadowed());
    const int passes = candidate.samples ? kPilotPasses : 1;
    const double tables_before_s = scene_.tables_core_s();
    // The first pilot also warms the kernels up; the second one is timed.
    const Noise first = NoiseOf(Pilot(traits.name, kPilotSamples[0], passes), kPilotPasses - 1);
    const render::Frame pilot = Pilot(traits.name, kPilotSamples[1], passes);
    const Noise second = NoiseOf(pilot, kPilotPasses - 1);
    const double pilot_pixels = static_cast<double>(pilot_width_) * pilot_height_;
    const double picture_pixels =
        static_cast<double>(width_) * height_ * request_.picture.antialias;
    candidate.work_of_one = PictureWork(pilot, 1, picture_pixels);
    const double model_s =
        costs_.Seconds(traits.name, PictureWork(pilot, kPilotSamples[1] * passes, pilot_pixels));
    if (model_s > 0) candidate.cost_correction = pilot.times.lighting_s / model_s;
    if (candidate.samples) {
      candidate.law.mean_luminance = second.mean_luminance;
      Noise of_picture = second;
      of_picture.effective_pixels *= picture_pixels / pilot_pixels;
      of_picture.degrees = kPasses - 1;
      candidate.margin = of_picture.Margin();
      candidate.law.Add(kPilotSamples[0], first.mean_variance * kPilotPasses);
      candidate.law.Add(kPilotSamples[1], second.mean_variance * kPilotPasses);
    }
    candidate.interpolation_error = traits.error_is_asked
                                        ? PilotOptions(traits.name, 1, 1).approximation_error
                                        : traits.rel_error;
    if (traits.needs.volume) {
      // Tables for one picture count as its time, spread over the cores that build them.
      if (request_.rel_error)
        candidate.build_s = (scene_.tables_core_s() - tables_before_s) / core::Threads();
      candidate.interpolation_error = InterpolationError(traits.name);
    }
    return candidate;
  }

  // Against `exact`, at the pilot's pixels.
  double InterpolationError(const std::string& estimator) {
    render::RenderOptions options = PilotOptions(estimator, 1, 1);
    options.shadows = render::Shadows::kNone;
    const auto interpolated = render::Renderer(scene_, options).Render();
    options.estimator = "exact";
    return LuminanceError(interpolated.radiance,
                          render::Renderer(scene_, options).Render().radiance);
  }

  // By the cost model, of the work of one sample per pixel times `samples` in kPasses passes; 0
  // where none are taken.
  double Seconds(const std::string& estimator, LightingWork work, double samples) const {
    const double passes = samples > 0 ? kPasses : 1;
    work.samples *= samples / passes;
    work.rays *= samples / passes;
    return passes * costs_.Seconds(estimator, work);
  }

  // Samples, time and error of the candidate's best setting.
  void Predict(Candidate& candidate) const {
    auto& setting = candidate.setting;
    const auto seconds = [&](double samples) {
      return candidate.build_s +
             candidate.cost_correction * Seconds(setting.estimator, candidate.work_of_one, samples);
    };
    if (!candidate.samples) {
      setting.predicted_s = seconds(0);
      setting.predicted_error = candidate.interpolation_error;
      return;
    }
    const int least = kPasses * static_cast<int>(scene_.luminaires().size());
    double samples = 0;
    if (request_.rel_error) {
      samples = candidate.law.SamplesFor(
          kAim * NoiseShare(*request_.rel_error, candidate.interpolation_error) /
          std::sqrt(candidate.margin));
    } else {
      const double least_s = seconds(least), per_sample_s = (seconds(2 * least) - least_s) / least;
      samples =
          per_sample_s > 0 ? least + (*request_.time_s - least_s) / per_sample_s : kMaxSamples;
    }
    setting.samples_per_pixel = static_cast<int>(
        std::clamp(samples, static_cast<double>(least), static_cast<double>(kMaxSamples)));
    setting.predicted_s = seconds(setting.samples_per_pixel);
    setting.predicted_error =
        std::hypot(candidate.law.ErrorOf(setting.samples_per_pixel), candidate.interpolation_error);
  }

  render::LitScene& scene_;
  const CostModel& costs_;
  const AccuracyRequest& request_;
  int width_ = 0, height_ = 0, pilot_width_ = 0, pilot_height_ = 0;
};

// Renders rounds of kPasses passes and merges them by their samples, which keeps the mean unbiased.
// The picture's own variance, not the pilot's, says whether the first round is enough.
void RefineUntilMet(render::LitScene& scene, render::RenderOptions options, const Candidate& chosen,
                    std::optional<double> rel_error, AccurateFrame& result) {
  const int lights = static_cast<int>(scene.luminaires().size());
  const int least = kPasses * lights;
  VarianceLaw law = chosen.law;
  double wanted = chosen.setting.samples_per_pixel;
  int taken = 0, passes = 0;
  for (int round = 0;; ++round) {
    options.first_pass = passes;
    options.passes = kPasses;
    options.samples_per_pixel = static_cast<int>(
        std::clamp(wanted, static_cast<double>(least), static_cast<double>(kMaxSamples)));
    const render::Frame frame = render::Renderer(scene, options).Render();
    const double expected = law.VarianceOf(options.samples_per_pixel);
    if (expected > 0) law.scale *= NoiseOf(frame, kPasses - 1).mean_variance / expected;
    result.frame = taken == 0
                       ? frame
                       : render::MeanFrame(result.frame, taken, frame, options.samples_per_pixel);
    taken += options.samples_per_pixel;
    passes += kPasses;
    result.chosen.samples_per_pixel = taken;
    const Noise noise = NoiseOf(result.frame, (round + 1) * (kPasses - 1));
    result.estimated_error = std::hypot(noise.RelativeError(), chosen.interpolation_error);
    if (!rel_error) {
      result.met = true;
      return;
    }
    const double allowed =
        std::pow(NoiseShare(*rel_error, chosen.interpolation_error) * noise.mean_luminance, 2) /
        noise.Margin();
    result.met = noise.mean_variance <= allowed;
    if (result.met || round == kMaxRounds || taken >= kMaxSamples) return;
    // The smallest further round whose samples bring the merged variance down to the aim.
    const double aim = kAim * kAim * allowed;
    for (wanted = std::max(least, taken / 4);; wanted *= 1.1) {
      const double merged =
          (std::pow(taken, 2) * noise.mean_variance + wanted * wanted * law.VarianceOf(wanted)) /
          std::pow(taken + wanted, 2);
      if (merged <= aim || wanted >= kMaxSamples) break;
    }
  }
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
  if (picture.shadows != render::Shadows::kNone && picture.shadows != render::Shadows::kTraced)
    throw InputError(
        "shadow maps do not state their error, so no estimator can be chosen by error or time; "
        "take traced shadows or none, or name an estimator and its samples");
  picture.Validate();
}

AccurateFrame RenderToAccuracy(render::LitScene& scene, const CostModel& costs,
                               const AccuracyRequest& request) {
  request.Validate();
  AccurateFrame result;
  const core::Stopwatch stopwatch;
  const std::vector<Candidate> candidates = Chooser(scene, costs, request).Choose();
  result.choosing_s = stopwatch.WallSeconds();
  for (const auto& candidate : candidates) result.considered.push_back(candidate.setting);
  const Candidate& chosen = candidates.front();
  result.chosen = chosen.setting;

  render::RenderOptions options = request.picture;
  options.estimator = chosen.setting.estimator;
  if (request.rel_error) options.approximation_error = ApproximationError(request);
  if (!chosen.samples) {
    result.frame = render::Renderer(scene, options).Render();
    result.estimated_error = chosen.setting.predicted_error;
    result.met = !request.rel_error || result.estimated_error <= *request.rel_error;
    return result;
  }
  RefineUntilMet(scene, options, chosen, request.rel_error, result);
  return result;
}

bool TakesSamples(const render::EstimatorTraits& traits, bool shadows) {
  return !traits.noise_free || shadows;
}

bool StatesItsError(const render::EstimatorTraits& traits, bool glossy, bool shadows) {
  if (glossy ? !traits.any_brdf : traits.any_brdf && traits.noise_free) return false;
  if (shadows && !traits.traced_shadows) return false;
  return TakesSamples(traits, shadows) ? traits.unbiased || traits.noise_free
                                       : traits.rel_error > 0;
}

double LuminanceError(const core::Image& picture, const core::Image& reference) {
  return core::Compare(core::LuminanceImage(picture), core::LuminanceImage(reference)).rel_rmse;
}

}  // namespace luxfield::study
