// The light vector at many points of one height, in closed form: what light_vector.h gives point by
// point, with the sums over an axis done once for all points that share it.
//
//   J(x_k, y, z) = delta^2 sum_i sum_c X_ikc S_ic,   S_ic = sum_j sum_r Y_jr C_ij[r, c]
//
// X, Y: moments of the basis over texels as seen through (x_k, z) and (y, z) (projected_texels.h).
// A row of n points costs one point's sum over rows of texels, and n sums over columns alone.
#pragma once

#include <span>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::lightfield {

class LightVectorRows {
 public:
  // Points at x_m, metres, in any order, at a height z_m of the field's frame. The field must outlive
  // this.
  LightVectorRows(const LightField& field, std::span<const double> x_m, double z_m);

  // J at (x_k, y_m, z_m) for every k; zero where z_m <= 0. Takes no notice of a receiver's horizon.
  // As ClosedFormLightVector but for rounding. May be called by several threads at once.
  std::vector<LightVector> At(double y_m) const;

 private:
  // Of basis function i as seen through x_k: columns first ... first + count - 1, whose moments lie
  // from `offset` on.
  struct Run {
    int first = 0, count = 0;
    std::size_t offset = 0;
  };

  const LightField& field_;
  std::size_t points_;
  double z_m_;
  std::vector<Run> runs_;                // [k][i]
  std::vector<double> zeroth_, moment_;  // in units of z and z^2
  std::vector<int> begin_, end_;         // columns that any point meets, by i
};

}  // namespace luxfield::lightfield
