// The unknowns of the geometry's fit as figures of the bench, with their covariance.
#pragma once

#include <Eigen/Core>

#include "luxfield/reconstruct/calibrate/geometry/geometry_start.h"

namespace luxfield::reconstruct {

// Fills everything of `geometry` that follows from the state: values, parameters with sigma,
// covariance and place_sigma_m, by first-order propagation of the covariance of state.Blocks() in
// their order (central differences of a hundredth of sigma). width and height must be set.
void FillFigures(const GeometryState& state, const Eigen::MatrixXd& covariance, Geometry& geometry);

}  // namespace luxfield::reconstruct
