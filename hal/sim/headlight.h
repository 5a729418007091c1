// A low-beam headlight of round projector type, traced backwards (ray by ray, no samples, no
// randomness).
//
// Along +z: a paraboloid mirror, LED chips near its focus and facing it, a shield with a kinked
// edge in the focal plane of a projector lens, the lens, and the filter plane F (z = 0). A ray u->s
// is followed backwards through the lens (an ideal thin lens:
// slope behind = slope in front + x / f), over the shield's edge (light above the edge is lost; the
// lens turns the picture upside down, so the beam stays below the horizon), to the mirror and onto
// the chips' plane. It carries the radiance of the chip it meets times the transmission of mirror
// and lens, plus the lens' own weak haze; radiance is constant along rays.
#pragma once

#include <array>
#include <memory>

#include "luxfield/core/config.h"
#include "luxfield/hal/sim/lamp.h"

namespace luxfield::hal::sim {

struct HeadlightOptions {
  double chip_radiance = 2e6;  // cd/m^2 for a lab in lm
  double transmission = 0.75;  // mirror and lens together
  double haze = 1e-6;          // radiance of the whole lens, relative to the chips
  int chip_columns = 5, chip_rows = 4;
  double chip_m = 7e-3, chip_gap_m = 0.5e-3;
  double gap_radiance = 0.7;  // of the phosphor between chips, relative to theirs
  double rim_m = 0.010;       // over which the phosphor fades at the array's border (cosine)
  double chip_tilt_deg = 70;  // of the chips' plane from facing straight into the mirror, upwards
  double mirror_focal_m = 0.030;
  double mirror_radius_m = 0.090;
  double mirror_axis_m = -0.004;  // height of the mirror's axis above the lens axis
  double lens_focal_m = 0.140;
  double lens_radius_m = 0.090;
  double lens_gap_m = 0.010;     // from the lens to F
  double shield_defocus = 0.02;  // shield distance over focal length, minus 1: softens the cut-off
  double cutoff_deg = -0.57;     // the horizontal part of the edge
  double kink_deg = 15;          // the rising part on the side of -x (the driver's right)
  double mirror_gap_m = 0.02;    // from the mirror's rim to the shield
  std::array<double, 3> colour{1, 1, 1};
};

HeadlightOptions ReadHeadlight(const core::Config& config);
std::unique_ptr<Lamp> MakeHeadlight(const HeadlightOptions& options);

}  // namespace luxfield::hal::sim
