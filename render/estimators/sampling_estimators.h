// Estimators that are one kernel over windows, of images or of knot cells: each draws samples from
// tables and traces a shadow ray or reads shadow maps for each (docs/theory.md 6). K is the number
// of samples, A the sum of the windows' masses.
//
//   windowed      Images are allotted samples in proportion to their windows' mass by systematic
//                 allocation. A sample's point comes with probability b (knob basis-share) from
//                 Phi_m, which is good where C hardly varies in the window, and else from C / mass,
//                 exactly (the marginal is restricted in both axes), which is good where the window
//                 holds structure; the balance heuristic weighs both. On glossy surfaces whose lobe
//                 is narrow against the lamp a share of the samples follows the BRDF instead; each
//                 of these stands for all images at once, weighed likewise. Points are drawn on the
//                 support on F: receivers may lie near, on and between the planes. Unbiased; a
//                 contribution is at most A / ((1 - b) K) times the largest Phi (n . (u - p))+ of
//                 the luminaire.
//   cells         Draws knot cells on F (correction 3) in proportion to the mass of their windows
//                 times the receiver's cosine, by systematic allocation, and points in a cell by
//                 its table Q (preprocess/cell_tables.h) or by the fit of the images in the middle
//                 of its window (kernels/luminaire/cell_fit.clh), combined by the balance
//                 heuristic; a sample evaluates all n^2 images that shine through the cell.
//                 Unbiased; every contribution is at most 40 q A / K, A = sum of the cells' masses
//                 times cosines and q that of the basis. On glossy surfaces as windowed. By shadow
//                 maps a cell is seen or not, E = sum_c V_c E_c, where estimators of images take
//                 E = sum_m v_m E_m with v_m the mean of V_c (thesis 4.5.2).
//   basis         Integrates over F: points on the support of each basis function are drawn from
//                 Phi_m by inversion, images in proportion to their windows' mass M_m, which bounds
//                 an image's light by M_m times the largest Phi_m (n . (u - p))+ ("Special cases").
//                 The integrand is regular for every receiver with z > 0: near I, on it and between
//                 the planes. Best where C hardly varies in a window; contributions grow with
//                 max C / mean C in it.
//   uniform       A baseline: uniform points over the part of each image's window that lies on the
//                 image, images in proportion to their windows' mass; contributions grow with
//                 max C / mean C in a window.
//   precomputed   Precomputed light importance sampling, a baseline of the thesis (docs/theory.md
//                 11): images and texels drawn from one distribution over all C, wherever the
//                 receiver is; what misses the windows is lost. Its contributions are unbounded as
//                 receivers approach I: on I itself nothing arrives.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

// In the order above.
const std::vector<EstimatorTraits>& SamplingEstimators();

enum class SamplingKernel {
  kLight,      // lights a G-buffer
  kDrawsOnly,  // draws its samples and adds them up unshaded, so that benches can time the draw
};

// The one of that name; null for other names.
std::unique_ptr<Estimator> MakeSamplingEstimator(const std::string& name, const Device& device,
                                                 SamplingKernel kernel = SamplingKernel::kLight);

}  // namespace luxfield::render
