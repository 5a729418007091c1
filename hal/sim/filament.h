// A glowing coil: an optically thin Gaussian body, and the lamp that is nothing else.
//
// The coil's standard deviations are a = `radius_m` and, along its axis, b = `length_m`. Its radiance
// along a line is the closed form
//
//   L = L_0 exp(-q^2 / 2) / |d'|,   q the distance of the line from the centre, d' its direction,
//
// both in coordinates that make the coil a sphere of deviation 1 (d' so that a line across the axis
// has |d'| = 1). A thin body sends the same into all directions; the integral over the lines of one
// direction is its intensity
//
//   I = 2 pi L_0 a b.
#pragma once

#include <array>
#include <memory>

#include "luxfield/core/config.h"
#include "luxfield/hal/sim/lamp.h"

namespace luxfield::hal::sim {

struct Coil {
  double radiance = 7e6;  // L_0, cd/m^2 for a lab in lm
  double radius_m = 1.1e-3;
  double length_m = 2.2e-3;
  lightfield::Vec3 centre{};
  double turn_rad = 0;  // of its axis about z, from x towards y

  // L along the line through `point`, whose direction may have any length but 0.
  double Radiance(lightfield::Vec3 point, lightfield::Vec3 direction) const;
};

// A bare filament on the axis behind a round opening in F, without bulb, mirror or lens. Its flux is
// 2 pi I (1 - gap / sqrt(gap^2 + opening^2)).
struct FilamentOptions {
  double coil_radiance = 7e6;
  double coil_radius_m = 5e-4;
  double coil_length_m = 2e-3;
  double coil_turn_deg = 30;  // of its axis in the plane z = -gap, from x towards y
  double gap_m = 0.04;        // from the coil to F
  double opening_m = 0.03;    // radius
  std::array<double, 3> colour{1, 1, 1};
};

// Without `colour`. Throws InputError.
FilamentOptions ReadFilament(const core::Config& config);
std::unique_ptr<Lamp> MakeFilament(const FilamentOptions& options);

}  // namespace luxfield::hal::sim
