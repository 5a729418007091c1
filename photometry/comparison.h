// Two lamps, or one measured twice, in the words of photometry: what differs, and by how many of its
// standard uncertainties. Noise of the two is independent, so that
//
//   u(a - b)^2 = u(a)^2 + u(b)^2
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "luxfield/photometry/answers.h"
#include "luxfield/photometry/colour.h"
#include "luxfield/photometry/distribution.h"

namespace luxfield::photometry {

enum class ComparedUnit { kFlux, kIntensity, kIlluminance, kDegree, kNone };

struct ComparedQuantity {
  std::string name;
  ComparedUnit unit = ComparedUnit::kNone;
  std::optional<Estimate> a, b;  // absent: this lamp has none

  std::optional<Estimate> Difference() const;  // a - b
  // Of its standard uncertainty; absent without one.
  std::optional<double> InUncertainties() const;
};

struct Comparison {
  std::vector<ComparedQuantity> quantities;
  PlaneAnswer plane_a, plane_b;  // the same plane, lit by either
};

// `colour_a`, `colour_b`: of lamps of three channels, both or none. The plane is asked of both.
Comparison Compare(const Lamp& a, const Lamp& b, const ColourLamp* colour_a,
                   const ColourLamp* colour_b, const PlaneAsked& plane);

}  // namespace luxfield::photometry
