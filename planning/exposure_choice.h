// How exposures turn into noise and time for filters whose images are known.
#pragma once

#include <vector>

#include "luxfield/capture/plan/bracket_rungs.h"
#include "luxfield/capture/plan/capture_time.h"
#include "luxfield/hal/devices.h"
#include "luxfield/planning/planned_filters.h"

namespace luxfield::planning {

// What a camera adds to irradiance on I, per pixel.
struct PixelNoise {
  rig::SensorModel camera;
  double electrons_per_irradiance = 0;  // per second: R v albedo
  bool photon_noise = true;             // false in a simulated lab without it
  bool rounds = true;                   // whole DN
  int darks = 1;                        // frames that a dark level is averaged from

  // Variance of the merged irradiance E of one pixel from the bracket's exposures, each taken
  // `repeats` times, in units of E (docs/theory.md 14):
  //   1 / sum t^2 / var(t) + (prnu E)^2,  exposures within 5 sigma of saturation left out.
  // Infinite where none is left. The dark level's own variance counts as every bracket's own.
  double Variance(double irradiance, const std::vector<double>& ladder_s, capture::Rungs bracket,
                  int repeats) const;
};

// The images of a plan, as far as exposures matter to them.
class ExposedImages {
 public:
  // `expanded`: of any exposures; its positions are the filters'. A texel is the mean of
  // `pixels_per_texel` pixels, equally lit.
  ExposedImages(const std::vector<std::vector<float>>& images, const PlannedFilters& filters,
                const FilterJudgement& judgement, const capture::ExpandedPlan& expanded,
                const PixelNoise& noise, double pixels_per_texel);

  // Signal of the brightest texel of every bracket, DN per second, in the order they are taken.
  const std::vector<double>& rates() const { return rates_; }
  double reference_rate() const { return reference_rate_; }
  double largest_rate() const;

  // Relative RMSE that noise adds to the picture.
  double Noise(const std::vector<double>& ladder_s, const std::vector<capture::Rungs>& brackets,
               int repeats) const;

 private:
  // Texels of one bracket whose irradiances are within a quarter of a stop.
  struct Bin {
    double irradiance = 0, weight = 0;  // weight per pixel's variance
  };
  PixelNoise noise_;
  std::vector<std::vector<Bin>> bins_;  // by bracket
  std::vector<double> rates_;
  double reference_rate_ = 0;
};

// The exposures that a search tries.
struct ExposureChoice {
  double min_s = 0, max_s = 0, relevant_share = 1;
  int repeats = 1;
};
// `longest_s` keeps every pixel below saturation; rungs are `ratio` apart and whole periods.
// Ladders from there up to every rung that the camera has, brackets of five depths, and one
// exposure up to three rungs shorter; each 1, 2, 4, 8 and 16 times. None if the camera, or a
// period, is too long.
std::vector<ExposureChoice> ExposureChoices(double longest_s, double ratio,
                                            const hal::CameraCapabilities& camera, double period_s);

}  // namespace luxfield::planning
