// Importance sampling in windows (docs/theory.md 6): images are allotted samples in proportion to
// their windows' mass by systematic allocation. A sample's point comes with probability b from
// Phi_m, which is good where C hardly varies in the window, and else from C / mass, exactly (the
// marginal is restricted in both axes), which is good where the window holds structure; the balance
// heuristic weighs both. On glossy surfaces whose lobe is narrow against the lamp a share of the
// samples follows the BRDF instead; each of these stands for all images at once, weighed likewise.
// Points are drawn on the support on F: receivers may lie near, on and between the planes.
// Unbiased; a contribution is at most A / ((1 - b) K) times the largest Phi (n . (u - p))+ of the
// luminaire.
#pragma once

#include <string>

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

const EstimatorTraits& WindowedTraits();
// `build_options` are added to those of its kernels.
std::unique_ptr<Estimator> MakeWindowed(const Device& device,
                                        const std::string& build_options = {});

}  // namespace luxfield::render
