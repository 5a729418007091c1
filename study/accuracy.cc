#include "study/accuracy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/measures.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/stopwatch.h"

namespace luxfield::study {
namespace {

constexpr int kPilotPixels = 1536;
constexpr int kPilotPasses = 8;
constexpr int kPilotSamples[2] = {8, 32};  // of a pass
constexpr int kPasses = 4;                 // few: a pass gains more from stratification the larger
constexpr int kMaxRounds = 12;
constexpr int kMaxSamples = 1 << 20;
constexpr double kMaxPower = 1.5;  // of the variance over the samples, as pilots measure it
constexpr double kWorthAVolume_s = 2;
constexpr double kApproximationShare = 0.5;  // of the target, asked of volumes and gloss
constexpr double kAim = 0.9;                 // of the target

// Mean variance and mean luminance over the pixels, and how far the former may be off.
struct Noise {
  double mean_luminance = 0, mean_variance = 0;
  double effective_pixels = 0;  // (sum v)^2 / sum v^2

  double RelativeError() const {
    return mean_luminance > 0 ? std::sqrt(mean_variance) / mean_luminance : 0;
  }
  // The true squared error exceeds this many times the estimate in some 2 % of cases: both the
  // sum of squared errors and the sum of variances from `passes` passes scatter.
  double Margin(int passes) const {
    return 1 + 2 * std::sqrt(2 / effective_pixels * (1 + 1.0 / (passes - 1)));
  }
};

Noise NoiseOf(const render::Frame& frame) {
  Noise noise;
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
  noise.effective_pixels = squares > 0 ? sum * sum / squares : static_cast<double>(count);
  return noise;
}

// v(k), the mean variance of a pass of k samples: v(k) = v1 (k / k1)^-power.
struct VarianceLaw {
  double k1 = 1, v1 = 0, power = 1, mean_luminance = 0;

  // Of the mean of kPasses passes with `samples` in all.
  double VarianceOf(double samples) const {
    return v1 * std::pow(samples / kPasses / k1, -power) / kPasses;
  }
  double ErrorOf(double samples) const {
    return mean_luminance > 0 ? std::sqrt(VarianceOf(samples)) / mean_luminance : 0;
  }
  double SamplesFor(double rel_error) const {
    const double wanted = rel_error * mean_luminance;
    if (!(v1 > 0) || !(wanted > 0)) return kPasses;
    return kPasses * k1 * std::pow(v1 / kPasses / (wanted * wanted), 1 / power);
  }
};

struct Candidate {
  Setting setting;
  bool samples = false;  // takes samples here
  VarianceLaw law;
  double interpolation_error = 0;  // of noise-free parts; relative RMSE
  double build_s = 0;              // of tables that only this picture needs
  LightingWork work_of_one;        // of the picture, one sample per pixel
  double cost_correction = 1;      // pilot's time over the model's
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
        if (interpolating && !IsWorthAVolume(candidates)) continue;
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
    const bool by_time = request_.time_s.has_value();
    std::stable_sort(candidates.begin(), candidates.end(),
                     [&](const Candidate& a, const Candidate& b) {
                       return by_time ? a.setting.predicted_error < b.setting.predicted_error
                                      : a.setting.predicted_s < b.setting.predicted_s;
                     });
    return candidates;
  }

 private:
  bool Shadowed() const { return request_.picture.shadows != render::Shadows::kNone; }
  // A volume takes seconds to build, which only pays where lighting takes longer; for a time asked
  // for, where nothing else is noise-free in it.
  bool IsWorthAVolume(const std::vector<Candidate>& others) const {
    return std::none_of(others.begin(), others.end(), [&](const Candidate& other) {
      return request_.rel_error ? other.setting.predicted_s < kWorthAVolume_s &&
                                      other.setting.predicted_error <= *request_.rel_error
                                : !other.samples && other.setting.predicted_s <= *request_.time_s;
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
    if (request_.rel_error) options.approximation_error = kApproximationShare * *request_.rel_error;
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
    const Noise first = NoiseOf(Pilot(traits.name, kPilotSamples[0], passes));
    const render::Frame pilot = Pilot(traits.name, kPilotSamples[1], passes);
    const Noise second = NoiseOf(pilot);
    const double pilot_pixels = static_cast<double>(pilot_width_) * pilot_height_;
    const double picture_pixels =
        static_cast<double>(width_) * height_ * request_.picture.antialias;
    candidate.work_of_one = PictureWork(pilot, 1, picture_pixels);
    const double model_s =
        costs_.Seconds(traits.name, PictureWork(pilot, kPilotSamples[1] * passes, pilot_pixels));
    if (model_s > 0) candidate.cost_correction = pilot.times.lighting_s / model_s;
    if (candidate.samples) {
      auto& law = candidate.law;
      law.mean_luminance = second.mean_luminance;
      law.k1 = kPilotSamples[1];
      law.v1 = second.mean_variance * kPilotPasses;
      if (law.v1 > 0 && first.mean_variance > 0)
        law.power =
            std::clamp(std::log(first.mean_variance / second.mean_variance) /
                           std::log(static_cast<double>(kPilotSamples[1]) / kPilotSamples[0]),
                       1.0, kMaxPower);
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

  // Samples, time and error of the candidate's best setting.
  void Predict(Candidate& candidate) const {
    auto work = candidate.work_of_one;
    const auto seconds = [&](double samples) {
      work.samples = candidate.work_of_one.samples * samples;
      work.rays = candidate.work_of_one.rays * samples;
      return candidate.cost_correction * costs_.Seconds(candidate.setting.estimator, work);
    };
    if (!candidate.samples) {
      candidate.setting.predicted_s = candidate.build_s + seconds(0);
      candidate.setting.predicted_error = candidate.interpolation_error;
      return;
    }
    const int least = kPasses * static_cast<int>(scene_.luminaires().size());
    double samples = 0;
    if (request_.rel_error) {
      samples = candidate.law.SamplesFor(
          kAim * std::sqrt(std::max(0.01 * std::pow(*request_.rel_error, 2),
                                    std::pow(*request_.rel_error, 2) -
                                        std::pow(candidate.interpolation_error, 2))));
    } else {
      const double fixed_s = seconds(0), per_sample_s = seconds(1) - fixed_s;
      samples = per_sample_s > 0 ? (*request_.time_s - fixed_s) / per_sample_s : kMaxSamples;
    }
    candidate.setting.samples_per_pixel = static_cast<int>(
        std::clamp(samples, static_cast<double>(least), static_cast<double>(kMaxSamples)));
    candidate.setting.predicted_s =
        candidate.build_s + seconds(candidate.setting.samples_per_pixel);
    candidate.setting.predicted_error = std::hypot(
        candidate.law.ErrorOf(candidate.setting.samples_per_pixel), candidate.interpolation_error);
  }

  render::LitScene& scene_;
  const CostModel& costs_;
  const AccuracyRequest& request_;
  int width_ = 0, height_ = 0, pilot_width_ = 0, pilot_height_ = 0;
};

// Renders rounds of kPasses passes and merges them by their samples, which keeps the mean unbiased.
// Where an error is asked for, the first round takes a third of what the pilot suggests: the
// picture itself then tells its variance, and pilots of peaked noise may be far off.
void RefineUntilMet(render::LitScene& scene, render::RenderOptions options, const Candidate& chosen,
                    std::optional<double> rel_error, AccurateFrame& result) {
  const int lights = static_cast<int>(scene.luminaires().size());
  const int least = kPasses * lights;
  VarianceLaw law = chosen.law;
  double wanted = chosen.setting.samples_per_pixel;
  if (rel_error) wanted /= 3;
  int taken = 0, passes = 0;
  for (int round = 0;; ++round) {
    options.first_pass = passes;
    options.passes = kPasses;
    options.samples_per_pixel = static_cast<int>(
        std::clamp(wanted, static_cast<double>(least), static_cast<double>(kMaxSamples)));
    const render::Frame frame = render::Renderer(scene, options).Render();
    law.k1 = static_cast<double>(options.samples_per_pixel) / kPasses;
    law.v1 = NoiseOf(frame).mean_variance * kPasses;
    result.frame = taken == 0
                       ? frame
                       : render::MeanFrame(result.frame, taken, frame, options.samples_per_pixel);
    taken += options.samples_per_pixel;
    passes += kPasses;
    result.chosen.samples_per_pixel = taken;
    const Noise noise = NoiseOf(result.frame);
    result.estimated_error = std::hypot(noise.RelativeError(), chosen.interpolation_error);
    if (!rel_error) {
      result.met = true;
      return;
    }
    const double allowed = std::pow(*rel_error * noise.mean_luminance, 2) / noise.Margin(kPasses);
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
  if (request.rel_error) options.approximation_error = kApproximationShare * *request.rel_error;
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
