// What a wrong print does to a quantity Q = sum w E (THEORY.md 3 and 4).
//
// All positions share one print T = Phi about its axis. With x from the print's lower corner in
// spacings, and the lamp as reconstructed, an error dT(x) of the print changes Q by
//
//   dQ = h^2 integral dT(x) S(x) dx,   S(x) = sum_ab M_ab B(x - a) B(y - b),
//   M_ab = sum over texels k and positions m of w_mk C_(m+ab)k,      -n < a, b < n
//
// The true lamp is not in the span of the basis; what that leaves out is of second order, error of
// the print times error of the model.
#pragma once

#include <vector>

#include "lightfield/light_field.h"
#include "lightfield/linear_functional.h"

namespace luxfield::reconstruct {

// M_ab, row-major in b then a, (2n - 1)^2 entries; of all positions, or of one alone.
struct LagSums {
  int cells = 0;  // n
  std::vector<double> sums;

  double at(int a, int b) const {
    return sums[static_cast<std::size_t>((b + cells - 1) * (2 * cells - 1) + a + cells - 1)];
  }
  LagSums& operator+=(const LagSums& other);
};
LagSums SumLags(const lightfield::LightField& coefficients, const lightfield::Weights& weights,
                int m);

// Integrals of the basis with itself shifted by a spacings, a = 1 - n ... n - 1, in metres.
class PrintSensitivity {
 public:
  // `scale`: transmittance is scale x Phi.
  PrintSensitivity(const lightfield::Basis& basis, double spacing_m, double scale);

  // dQ per metre that the print, or the filter with it, is off along u and v.
  lightfield::Vec2 Shift(const LagSums& lags) const;
  // Per relative error of the transmittance: sum w E itself.
  double Density(const LagSums& lags) const;
  // Per gamma of T -> T^(1 + gamma), T ln T.
  double Gamma(const LagSums& lags) const;
  // sqrt(integral (Phi S)^2 du), m^-1 Q: times sqrt(grain_area) and grain the standard deviation
  // for grain finer than the spacing.
  double Grain(const LagSums& lags) const;

 private:
  struct Axis {
    std::vector<double> product, slope, logarithm;  // B B, dB/dx B, B ln B B
  };
  double Contract(const LagSums& lags, const std::vector<double>& u,
                  const std::vector<double>& v) const;

  lightfield::Basis basis_;
  double spacing_m_, scale_;
  Axis axis_;
};

}  // namespace luxfield::reconstruct
