// What a wrong print does to a quantity Q = sum w E (docs/theory.md 13).
//
// All positions share one print T = Phi about its axis, or a pair whose difference is Phi*
// (filter_profile.h). With x from the print's lower corner in spacings, and the lamp as
// reconstructed, an error dPhi(x) of the print changes Q by
//
//   dQ = h^2 integral dPhi(x) S(x) dx,   S(x) = sum_ab M_ab B(x - a) B(y - b),
//   M_ab = sum over texels k and positions m of w_mk C_(m+ab)k,      -n < a, b < n
//
// What both prints of a pair share is one error of both.
//
// The true lamp is not in the span of the basis; what that leaves out is of second order, error of
// the print times error of the model.
#pragma once

#include <array>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/linear_functional.h"
#include "luxfield/reconstruct/merge/filter_profile.h"

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

// Integrals of the filter with the basis shifted by a spacings, a = 1 - n ... n - 1, in metres.
class PrintSensitivity {
 public:
  // `scale`: of a basis filter, whose transmittance is scale x Phi.
  PrintSensitivity(lightfield::FilterKind filter, const lightfield::Basis& basis, double spacing_m,
                   double scale);

  // dQ per metre that the print, or the filter with it, is off along u and v.
  lightfield::Vec2 Shift(const LagSums& lags) const;
  // Mean square of dQ where the print is off by normal errors of `sigma_m` per axis, to second
  // order: the edge on top of a dual function makes squares matter where its slopes cancel.
  double ShiftVariance(const LagSums& lags, double sigma_m) const;
  // Per entry uu, uv, vu, vv of a small L that takes the print's points x, from its axis, to x + L
  // x.
  std::array<double, 4> Stretch(const LagSums& lags) const;
  // Per relative error of the transmittance: sum w E itself.
  double Density(const LagSums& lags) const;
  // The same of each print of a pair: of max(Phi*, 0) and of -max(-Phi*, 0), which add up to
  // Density; of a basis filter all is of the first.
  std::array<double, 2> DensityOfPrints(const LagSums& lags) const;
  // Per gamma of T -> T^(1 + gamma), T ln T of every print.
  double Gamma(const LagSums& lags) const;
  // sqrt(integral (Phi S)^2 du), m^-1 Q: times sqrt(grain_area) and grain the standard deviation
  // for grain finer than the spacing.
  double Grain(const LagSums& lags) const;

 private:
  // Of the profile f with B: f B, df/dx B, x f B, x df/dx B (x from the axis), f ln|f| B, and
  // max(+-f, 0) B.
  struct Axis {
    std::vector<double> product, slope, moment, moment_slope, logarithm, plus, minus;
  };
  double Contract(const LagSums& lags, const std::vector<double>& u,
                  const std::vector<double>& v) const;

  lightfield::Basis basis_;
  FilterProfile profile_;
  double spacing_m_;
  std::array<double, 2> peaks_;  // Phi over T, of the prints
  Axis axis_;
};

}  // namespace luxfield::reconstruct
