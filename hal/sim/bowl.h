// A motorcycle lamp: a glowing coil in a faceted paraboloid bowl, traced backwards (ray by ray, no
// samples, no randomness but the facets' fixed tilts).
//
// The bowl opens along +z; its rim and the clear glass lie `gap_m` behind the filter plane F. A ray
// u->s is followed backwards through the glass into the bowl. After the mirror it carries
// `reflectance` times the radiance of the coil that it passes; a cap over the bulb keeps the coil's
// direct light in, and the glass has its own weak haze. The bowl's facets are sectors of rings; each
// keeps the paraboloid's curvature and is turned by its own small angles, so that their images of
// the coil (filament.h) lie apart on a near wall.
#pragma once

#include <array>
#include <memory>

#include "luxfield/core/config.h"
#include "luxfield/hal/sim/lamp.h"

namespace luxfield::hal::sim {

struct BowlOptions {
  double coil_radiance = 7e6;  // L_0, cd/m^2 for a lab in lm
  double coil_radius_m = 1.1e-3;
  double coil_length_m = 2.2e-3;
  double coil_ahead_m = 1e-3;  // of the focus, along +z
  double reflectance = 0.8;
  double haze = 2e-4;  // radiance of the whole glass, relative to the coil
  double focal_m = 0.014;
  double radius_m = 0.032;
  double gap_m = 0.006;
  int rings = 4, sectors = 14;
  double tilt_across = 0.12, tilt_up = 0.05;  // standard deviations of the facets' slopes
  std::array<double, 3> colour{1, 1, 1};
};

BowlOptions ReadBowl(const core::Config& config);
std::unique_ptr<Lamp> MakeBowl(const BowlOptions& options);

}  // namespace luxfield::hal::sim
