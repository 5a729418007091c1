// What a reconstruction is worth, in numbers.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/kept_moments.h"
#include "luxfield/reconstruct/solve/missing_data.h"
#include "luxfield/reconstruct/solve/non_negative.h"
#include "luxfield/reconstruct/solve/regularise.h"

namespace luxfield::reconstruct {

// Of the least-squares solution, regularised or not, before any non-negative projection.
struct CoefficientStatistics {
  double negative_energy = 0;  // sum of |C < 0| over sum of C > 0; 0 if all C are 0
  double min = 0, max = 0, mean = 0;
  double sigma_median = 0;  // of sigma(C) over all entries
  double sigma_relative =
      0;  // sqrt(sum sigma^2 / sum C^2): the random error expected of C as a relative RMSE
};

struct ReconstructionReport {
  int images = 0;
  CoefficientStatistics coefficients;
  // "gram": the banded Gram solve; "separable", "general": the forward model with measured filters,
  // displaced positions or several measurements; "none": dual filters at their places.
  std::string solve;
  double condition = 0;                // of the 2-D system; 1 for "none"
  double noise_gain = 0;               // of white noise, in units of 1 / h^2
  double worst_gain = 0;               // of the worst mode, in units of 1 / h^2
  std::optional<double> filter_noise;  // relative, of the system (FilterSystem::matrix_noise)
  IncompletePixels incomplete;         // texels
  KeptMoments kept;
  // Of the forward model: how far the flux of a point of light may be off where it is kept, rms
  // over the interior cells, relative (MomentConstraint::residual).
  std::optional<double> moment_residual;
  std::optional<lightfield::EdgeLight> edges;  // absent: dual filters, whose sum is no flux density
  std::vector<std::string> warnings;           // a sentence each
  // Texels x positions that carry each flag.
  std::size_t off_sensor = 0, saturated = 0, too_dark = 0, defect = 0;
  std::optional<NonNegativeSummary> non_negative;
  std::optional<RegularisationSummary> regularisation;
};

// The value that stands at place n < values.size() of the sorted values, without a copy of them, in two
// passes. No value is NaN.
float NthSmallest(std::span<const float> values, std::size_t n);

CoefficientStatistics Statistics(const lightfield::LightField& coefficients,
                                 const lightfield::LightField& sigma);

}  // namespace luxfield::reconstruct
