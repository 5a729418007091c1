// Variances of pictures of several seeds, over the pixels of a scene lit light by light.
#pragma once

#include <span>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/render/lights_apart.h"

namespace luxfield::bench {

using render::LightsApart;
using render::StrategySetting;

// Pixel by pixel what a variance is multiplied by before it is summed:
// 1 / (b^2 + eps) / pixels, b the reference's luminance, eps = (0.01 mean b)^2.
std::vector<double> VarianceScales(const core::Image& reference);

// Pictures of the seeds first_seed, first_seed + 1, ...
struct Runs {
  std::vector<core::Image> luminance;                    // of each seed
  std::vector<std::vector<core::Image>> part_luminance;  // of each light and seed
  double mean_lab = 0;                                   // against the reference
  double wall_s = 0, core_s = 0;                         // the least of lighting
};

// `light_shares` as LightsApart::Light's.
Runs RunSeeds(LightsApart& scene, const StrategySetting& setting, std::uint64_t first_seed,
              int seeds, const core::Image& reference,
              std::span<const core::Image> light_shares = {});

struct Estimate {
  double value = 0, standard_error = 0;
  std::vector<double> of_seeds;  // whose mean is the value
};

// Sum of scale times variance over the seeds. The squared deviations of each seed's picture from
// the mean of all are as many estimates.
Estimate RelativeVariance(const Runs& runs, const std::vector<double>& scales);

// b / a - 1 of two estimates from the same seeds, whose random numbers are alike; its standard
// error from the differences seed by seed.
Estimate RelativeDifference(const Estimate& a, const Estimate& b);

// Relative variance of the runs that are best for each pixel and light: chosen on the even seeds,
// by the variance over 3 x 3 pixels, and judged on the odd ones, and the other way round.
double BestOfEachPixel(const LightsApart& scene, const std::vector<Runs>& choices,
                       const std::vector<double>& scales);

}  // namespace luxfield::bench
