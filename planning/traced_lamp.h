// The light of a simulated lab's lamp itself, ray by ray: what measurements of it, and pictures lit
// by them, are judged by. No basis, no texel and no light vector lies between.
//
// Integrals over F are means over a Fibonacci lattice of points on the lit rectangle, shifted on
// the torus by two random numbers (Cranley and Patterson 1976, "Randomization of number theoretic
// methods for multiple integration"): unbiased for every lamp. Two shifts give two independent
// values, a and b; x is judged by the mean of (x - a)(x - b), to which their noise adds nothing.
// Equal seeds give equal numbers, whatever the number of threads.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "luxfield/hal/sim/lab_description.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/planning/chain.h"
#include "luxfield/planning/sampled_lamp.h"
#include "luxfield/preprocess/light_vector_volume.h"

namespace luxfield::planning {

// The points of a lattice rule of at least `least` points on the unit square, as many as the next
// Fibonacci number.
class FibonacciLattice {
 public:
  explicit FibonacciLattice(int least);
  int size() const { return size_; }
  lightfield::Vec2 Point(int k, lightfield::Vec2 shift) const;

 private:
  int size_, step_;
};

class TracedLamp {
 public:
  // Light is looked for on F within twice the supports of `geometry`, as far as it goes through the
  // lattice on I. Throws InputError where there is none.
  TracedLamp(const hal::sim::LabDescription& lab, const lightfield::LuminaireGeometry& geometry);

  int channels() const { return channels_; }
  double delta_m() const { return delta_m_; }
  const Rectangle& lit() const { return lit_; }

  // E(u->s) = L cos^4(theta) / delta^2 for all s[k] of a row, [channel * s.size() + k]: W m^-4 (or
  // lm m^-4, or relative).
  void FluxDensity(lightfield::Vec2 u, double t_m, std::span<const double> s_m,
                   std::span<double> density) const;

  // Irradiance of a receiver, z > 0 (0 elsewhere), one channel repeated into all three:
  //
  //   E = integral over F of V(u) L(u->p) max(0, n.(u-p)) z / |u-p|^4 du
  struct Light {
    std::array<double, 3> open{};  // V = 1
    std::array<double, 3> seen{};  // V = visible(u), 0 or 1; asked where there is light only
  };
  Light Irradiance(const preprocess::Receiver& receiver, const FibonacciLattice& points,
                   lightfield::Vec2 shift,
                   const std::function<bool(lightfield::Vec2 u)>& visible) const;

 private:
  std::shared_ptr<const hal::sim::Lamp> lamp_;
  double delta_m_;
  int channels_;
  Rectangle lit_;
};

// Of the lamp through the lattice, luminance; from two shifts a row of texels.
struct TracedFlux {
  double value = 0, standard_error = 0;
};
TracedFlux FluxThrough(const lightfield::Lattice& lattice, const TracedLamp& lamp,
                       std::uint64_t seed);

// Errors of light fields of one lattice over all rays of the lattice and of the rectangle of F that
// holds the supports and the light: their flux density against the lamp's.
std::vector<StageError> CompareWithLamp(const std::vector<const lightfield::LightField*>& fields,
                                        const TracedLamp& lamp, std::uint64_t seed);

// Measurements without noise: irradiances behind ideal filters as hal::sim traces them,
// [m][(traced channel * height + row) * width + column], in the lamp's colours.
lightfield::Measurements IdealMeasurements(const lightfield::LuminaireGeometry& geometry,
                                           const std::vector<std::vector<float>>& traced,
                                           const hal::sim::Lamp& lamp);

// Luminance of the light field's flux.
double LuminousFlux(const lightfield::LightField& field);

// The known irradiances against the lamp's behind perfect filters at the planned places, at as many
// texels, drawn at random.
StageError IrradianceAgainstLamp(const lightfield::Measurements& measurements,
                                 const TracedLamp& lamp, int texels, std::uint64_t seed);

}  // namespace luxfield::planning
