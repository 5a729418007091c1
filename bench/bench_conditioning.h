// `luxfield bench conditioning`: how well the solve is posed, beside what it should be.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace luxfield::bench {

struct BenchConditioningOptions {
  // Filters per axis; 1 to 64 by default.
  std::vector<int> counts{1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64};
};

// Rows: case, filters ("W x H"), answer ("solved" or the refusal), condition and its prediction
// `predicted`, noise_gain (units of 1/h^2), c_error (largest error of the coefficients brought back
// from their own irradiance, over the largest coefficient; of missing positions, of what is known).
//
// Predictions share nothing with the solve: filters are written here from the textbook's formula
// (quadratic B-spline), their inner products taken by the midpoint rule over 4000 points a spacing
// (relative error 1e-8 and less), and singular values by Eigen's two-sided Jacobi iteration of the
// dense matrix, per axis where the system is a product. `tent` rows have a closed form: the 1-D
// matrix of bilinear filters is tridiagonal, 2/3 and 1/6, its eigenvalues
// 2/3 + 1/3 cos(k pi / (n + 1)).
//
// Cases: n filters per axis; supports clipped by the border of F at half of the outer cells and all
// but a tenth of them; positions spaced 1e-6 too wide, ideal filters assumed and the forward model;
// two filters in one place, on the separable and on the general way; one position missing, a column
// missing, a third missing at random.
nlohmann::json BenchConditioning(const BenchConditioningOptions& options);

}  // namespace luxfield::bench
