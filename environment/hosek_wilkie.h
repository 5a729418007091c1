// Radiance of the cloudless sky: Hosek and Wilkie, "An analytic model for full spectral sky-dome
// radiance", ACM Trans. Graph. 31 (SIGGRAPH 2012) 95, fitted to path tracing of an atmosphere of
// Preetham's turbidity T. Each tristimulus value is M F(theta, gamma),
//
//   F = (1 + A exp(B / (cos theta + 0.01)))
//       (C + D exp(E gamma) + F cos^2 gamma + G chi(H, gamma) + I sqrt(cos theta))
//   chi(g, a) = (1 + cos^2 a) / (1 + g^2 - 2 g cos a)^(3/2),
//
// theta the angle to the zenith and gamma to the sun. M and A to I are linear between whole
// turbidities and in the ground's albedo, and Bezier curves of degree 5 in cbrt(e / 90 degrees), e
// the sun's elevation. The fit reaches a little below 0 in the lowest 0.2 degrees at turbidities
// above 7 with the sun below 10 degrees (and blue there at any turbidity with a setting sun): such
// values are 0.
#pragma once

#include <array>

#include "luxfield/core/colour.h"

namespace luxfield::environment {

// Turbidities of the fit: 1 air without haze, 2 very clear, 3 clear, 6 hazy.
inline constexpr double kLeastTurbidity = 1, kLargestTurbidity = 10;

class HosekWilkieSky {
 public:
  // Throws InputError for a turbidity or an albedo (0 to 1) out of range, or a sun not from 0 to 90
  // degrees above the horizon: the model knows no twilight.
  HosekWilkieSky(double sun_elevation_deg, double turbidity, double ground_albedo);

  // Tristimulus values, cd m^-2, under a sun at 1 au. cos_theta from 0 to 1; gamma from 0 to pi.
  core::Rgb Xyz(double cos_theta, double gamma, double cos_gamma) const;

 private:
  struct Distribution {
    std::array<double, 9> c{};
    double radiance = 0;
  };
  std::array<Distribution, 3> xyz_;
};

}  // namespace luxfield::environment
