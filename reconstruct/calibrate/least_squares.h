// Ceres' solver as this room uses it: what becomes of a solve is the caller's to say.
#pragma once

#include <ceres/ceres.h>

namespace luxfield::reconstruct {

// Prints nothing, neither to stdout nor through glog. The problem's parameters are as before where
// it returns ceres::FAILURE (no step lowers the cost); ceres::NO_CONVERGENCE: the iterations of
// `options` ran out.
ceres::TerminationType SolveLeastSquares(ceres::Solver::Options options, ceres::Problem* problem);

}  // namespace luxfield::reconstruct
