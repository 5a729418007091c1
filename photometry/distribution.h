// A lamp's light distribution in numbers: flux, far-field intensity, beam and field angle, symmetry,
// and from where on the lamp is a point (docs/photometry.md).
//
// Linear quantities have the uncertainty of their weights. Angles and distances are solutions of
// g(x, C) = 0, so that to first order (the delta method; JCGM 100:2008, 5.1)
//
//   dx = -(sum dg/dC dC) / (dg/dx)
//
// and the peak's direction does not enter the uncertainty of its intensity, whose slope there is 0.
// A maximum over directions of equal intensity is biased upwards by noise, which u does not show.
// Where noise is no small change, there is no u: the direction of a peak so flat that it may lie
// anywhere, or an asymmetry that is for the most part noise.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/photometry/functional.h"

namespace luxfield::photometry {

// docs/axes.md; gamma from the +z axis, C in [0, 360).
struct Direction {
  double c_deg = 0, gamma_deg = 0;
};
Direction DirectionOf(lightfield::Vec3 d);
lightfield::Vec3 VectorOf(Direction direction);

// The full angle between the two directions, to both sides of the peak, in which intensity first
// falls to a share of the peak's: in the plane through the peak and along C0-C180 (u), in the one
// across it, and their mean.
struct BeamAngle {
  Estimate along_c0_deg, along_c90_deg, mean_deg;
  // The light field ends before intensity falls so far: the angle is that of what was measured.
  bool limited = false;
};

// Distances from the origin of the luminaire's frame along a direction d, from which on
// |E r^2 / I - 1| stays within a tolerance, E on a plane that faces the origin. Towards the peak their
// uncertainties have that of where it is, unless intensity is flat there.
struct InverseSquare {
  lightfield::Vec3 direction;
  std::array<std::optional<Estimate>, 3> distance_m;  // of kInverseSquarePercent; absent: nowhere
};
constexpr std::array<int, 3> kInverseSquarePercent = {1, 5, 10};

// How far noise turns a direction: standard uncertainties.
struct DirectionUncertainty {
  double along_c0_deg = 0, across_deg = 0;  // in the plane of d and u (C0-C180), and across it
  // Of C and gamma; absent within four times these of the pole, where C may be anything.
  std::optional<double> c_deg, gamma_deg;
};

struct Distribution {
  lightfield::FluxUnit unit = lightfield::FluxUnit::kRelative;
  Estimate flux;
  Estimate axis;  // intensity along +z
  Estimate peak;
  lightfield::Vec3 peak_direction{0, 0, 1};
  // Absent without noise, and where intensity about the peak is flat for the noise that it has.
  std::optional<DirectionUncertainty> peak_direction_u;
  std::optional<BeamAngle> beam, field;  // 50 % and 10 %; absent: there is no light
  // Of the flux, by rays with z > 0, and the rest; absent: there is none.
  std::optional<Estimate> downward_share, upward_share;
  // Half the integral of |I - mirrored I| over the sphere, over the flux: 0 of a lamp that is its
  // own mirror image in the plane C0-C180 (v to -v) or C90-C270 (u to -u). Noise makes it larger, as it
  // does any sum of absolute values; there is no u where that is more than half of it.
  std::optional<Estimate> asymmetry_c0_c180, asymmetry_c90_c270;
  InverseSquare on_axis, towards_peak;
  // The largest gamma up to which, at every C, all of F was measured; of a lamp of one field. It follows
  // from where the planes are, which no noise moves.
  std::optional<Estimate> covered_gamma_deg;
  std::vector<std::string> remarks;  // what a person should know of these numbers, a sentence each
};

Distribution DistributionOf(const Lamp& lamp);

// Gamma up to which the lamp shines with a tenth of its peak, by its field angle; 60 without one.
double EdgeGammaOf(const Distribution& distribution);

// Where intensity is largest.
lightfield::Vec3 PeakDirectionOf(const Lamp& lamp);

// Is every ray of this direction that leaves F within the measured part of I? Of a lamp of several
// fields true everywhere: what one does not show another may.
bool IsCovered(const Lamp& lamp, lightfield::Vec3 direction);

// The smallest scale on which far-field intensity can change, radians: spacing / delta.
double FinestAngle(const Lamp& lamp);

// Intensity at all planes and angles, [plane][angle].
struct IntensityTable {
  std::vector<double> c_deg, gamma_deg;
  std::vector<Estimate> intensity;
  const Estimate& at(std::size_t c, std::size_t gamma) const {
    return intensity[c * gamma_deg.size() + gamma];
  }
};
IntensityTable TableOf(const Lamp& lamp, double c_step_deg, double gamma_step_deg);

}  // namespace luxfield::photometry
