// What filters on a grid would measure of a sampled lamp, and what that measurement would give a
// scene: the error that the model leaves, and how noise of the images gets into it.
#pragma once

#include <vector>

#include "luxfield/lightfield/edge_light.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/planning/relative_error.h"
#include "luxfield/planning/sampled_lamp.h"
#include "luxfield/preprocess/light_vector_volume.h"

namespace luxfield::planning {

struct PlannedFilters {
  bool dual = false;
  lightfield::BasisGrid grid;
  lightfield::Lattice lattice;  // whole texels of the sampled lamp's

  // Prints with full transmittance at the peak: 1 / peak^2, 1 for dual filters.
  double print_scale() const;
  int prints() const { return dual ? 2 : 1; }
  // E_ij = sum over prints of factor * the print's image (docs/theory.md 3, "Filters").
  std::vector<double> print_factors() const;
};

// Irradiance on I behind every print at every position, images[print][m * texels + texel], with the
// lamp constant over the cells of its samples: separable integrals of the filters over the cells,
// rounded to float32, sums in float32 (1e-5 of an image's largest value).
std::vector<std::vector<float>> FilterImages(const SampledLamp& samples,
                                             const PlannedFilters& filters);

// Of the irradiances that a picture's receivers get from the light field reconstructed from the
// images, Q_r = sum w_r E (docs/theory.md 14):
struct FilterJudgement {
  RelativeError truncation;  // of Q_r against the truth
  // [m * texels + texel]: mean over receivers of w_r^2, over the squared mean of the truth. Summed
  // with the variances of E it is the squared relative RMSE that noise adds.
  std::vector<float> noise_weight;
};

// Whether the lamp's light reaches the outer filters; nowhere for dual filters.
lightfield::EdgeLight EdgeLightOf(const std::vector<std::vector<float>>& images,
                                  const PlannedFilters& filters);

// `truth` per receiver. The weights are those of the closed form through the solve's map with the
// moments that it keeps (the dual filters' 1 / h^2), separable per receiver, in double. A receiver
// whose horizon cuts the supports is taken as if it did not; one that faces away is dark.
FilterJudgement Judge(const std::vector<std::vector<float>>& images, const PlannedFilters& filters,
                      double delta_m, const std::vector<preprocess::Receiver>& receivers,
                      const std::vector<double>& truth);

}  // namespace luxfield::planning
