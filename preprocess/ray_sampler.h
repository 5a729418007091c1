// Rays of equal flux drawn from light fields (docs/theory.md 2): E(u->s) = sum C_m(s) Phi_m(u) is
// the flux per du ds, so with C >= 0
//
//   m, texel    with probability proportional to C_m(texel), once the areas are equal
//   u           with density Phi_m(u) over its integral: for bspline2 the sum of three uniforms
//   s           uniform in the texel
//
// draws rays of density E / flux, and N of them carry flux / N each. Where C is negative, rays are
// drawn from the positive coefficients and kept with probability
//
//   max(E, 0) / sum max(C, 0) Phi
//
// which leaves rays of density max(E, 0); N of them with flux / N each hold the flux, scaled from
// the flux of max(E, 0). Of three channels C is the luminance.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "luxfield/core/random.h"
#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::preprocess {

struct DrawnRay {
  lightfield::Vec3 position_m, direction;  // on F, unit; in the luminaire's frame
  // R G B of the flux density over its luminance; 1 1 1 of a field of one channel.
  std::array<double, 3> colour{1, 1, 1};
  int proposals = 1;  // drawn until this one was kept
};

class RaySampler {
 public:
  // The fields have to outlive it. Beside them it holds 8 bytes for each row of an image. InputError
  // naming `file` where there is no light.
  RaySampler(std::span<const lightfield::PosedLightField> fields, const std::string& file);

  DrawnRay Draw(core::Random& random) const;

  // Luminance of all fields, in their unit.
  double flux() const { return flux_; }
  // That of the positive coefficients alone; times the share of proposals that are kept, that of
  // max(E, 0).
  double positive_flux() const { return positive_flux_; }

 private:
  struct Row {
    std::size_t field;
    int image, row;
  };
  Row RowOf(std::size_t index) const;

  std::span<const lightfield::PosedLightField> fields_;
  std::vector<std::size_t> first_row_;  // of each field, and the end
  std::vector<double> cumulative_;      // flux of positive coefficients up to and with a row
  double flux_ = 0, positive_flux_ = 0;
};

}  // namespace luxfield::preprocess
