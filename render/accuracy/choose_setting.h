// Which estimator, with how many samples and where: what pilots of a scene make of the cost model.
#pragma once

#include <optional>
#include <vector>

#include "luxfield/render/accuracy/accuracy.h"
#include "luxfield/render/accuracy/cost_model.h"
#include "luxfield/render/accuracy/further_round.h"
#include "luxfield/render/accuracy/picture_noise.h"
#include "luxfield/render/accuracy/sample_density.h"
#include "luxfield/render/renderer.h"

namespace luxfield::render {

constexpr int kMaxSamples = 1 << 20;  // of a pixel
constexpr double kAim = 0.93;         // of the target, in rounds after the first
// AccuracyRequest::round_s does not hold for rounds of at most so many times what those before took.
constexpr double kLongestRound = 2;

// What is asked of estimators that approximate.
double ApproximationError(const AccuracyRequest& request);

// What an approximation leaves of an error for noise.
double NoiseShare(double rel_error, double approximation);

// What lighting took, as the cost model counts seconds.
double LightingSeconds(const Device& device, const RenderTimes& times);

// A picture of which some pixels are lit.
struct BegunPicture {
  Frame frame;         // black elsewhere
  core::Image taken;   // samples of each pixel
  double lit = 0;      // share of the pixels that hit something
  double samples = 0;  // mean over them
};

// An estimator, and what pilots tell of it for the picture.
struct Candidate {
  Setting setting;
  bool samples = false;            // takes samples here
  VarianceLaw law;                 // of the picture
  SampleDensity density;           // samples are those of density 1 throughout
  double interpolation_error = 0;  // of noise-free parts; relative RMSE
  double build_s = 0;              // of tables that only this picture needs
  LightingWork work_of_one;        // of the picture, one sample per pixel
  // Pilot's time over the model's, of what no sample changes and of samples.
  double fixed_correction = 1, sample_correction = 1;
  double mean_luminance = 0;
  double margin = 1;  // PictureNoise::Margin expected of the picture
  double spread = 0;  // of the logarithm of the picture's variance about the law's
  double least = 1;   // samples of a pixel
  int shown = 1;      // the fewest samples of a pixel that show a variance
  std::optional<BegunPicture> begun;
  // Once it is begun: to light the picture without samples, and a sample of each pixel.
  double lit_s = 0, sample_s = 0;

  // The least density, if samples are `k`: every pixel needs some, and some cost hardly anything.
  double LeastDensity(double k) const;

  // Of a round of a picture that is begun: the share of its pixels that are lit, and mean samples.
  double RoundSeconds(double lit, double mean_samples) const {
    return lit * lit_s + mean_samples * sample_s;
  }

  // What a round is to reach.
  FurtherAim Aim(double variance) const;
  // Mean variance of the luminance that the first round aims at of a picture that is begun.
  double FirstAim(double rel_error) const;

  // Of a picture of k samples, over the squared mean luminance.
  double RelativeVariance(double k) const;
};

// Candidates that state their error, best first, the first of them begun for an error asked
// for.
// Throws InputError if there is none, DeviceError, Interrupted.
std::vector<Candidate> ChooseSetting(LitScene& scene, const CostModel& costs,
                                     const AccuracyRequest& request);

}  // namespace luxfield::render
