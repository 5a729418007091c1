// Integration over F: points on the support of each basis function drawn from Phi_m by inversion,
// images in proportion to their windows' mass M_m, which bounds an image's light by M_m times the
// largest Phi_m (n . (u - p))+ (docs/theory.md 6, "Special cases"). The integrand is regular for
// every receiver with z > 0: near I, on it and between the planes. Best where C hardly varies in a
// window; contributions grow with max C / mean C in it.
#pragma once

#include <string>

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

const EstimatorTraits& BasisTraits();
// `build_options` are added to those of its kernels.
std::unique_ptr<Estimator> MakeBasis(const Device& device, const std::string& build_options = {});

}  // namespace luxfield::render
