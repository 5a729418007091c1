// What is asked of a lamp, where it is linear in the coefficients (docs/theory.md 2 and 7):
//
//   Q = sum over fields, m, texels of weight C
//
// so that its variance follows from theirs (coefficient_noise.h), and that of any smooth function
// of such quantities from the weights of its linearisation (the delta method; JCGM 100:2008, 5).
//
// Points and directions are in the luminaire's frame, metres (docs/axes.md); values are in the
// unit of flux (lm; W) or that per sr (cd; W/sr) or per m^2 (lx; W/m^2). Everything is in double.
#pragma once

#include <array>
#include <initializer_list>
#include <optional>
#include <span>
#include <vector>

#include "luxfield/photometry/lamp.h"

namespace luxfield::photometry {

// The weights of one field over the texels that they are not 0 on.
struct FieldFunctional {
  TexelWindow window;
  std::vector<double> weights;  // [m][row][column]
};

using Functional = std::vector<FieldFunctional>;  // one for each field of the lamp

// A value with its standard uncertainty; none where the lamp has no sigma.
struct Estimate {
  double value = 0;
  std::optional<double> u;
};

double Value(const Lamp& lamp, const Functional& functional);
// Absent where the lamp has no noise.
std::optional<double> Uncertainty(const Lamp& lamp, const Functional& functional);
Estimate Evaluate(const Lamp& lamp, const Functional& functional);

struct FunctionalTerm {
  double factor = 1;
  const Functional* functional = nullptr;
};
// sum of factor times functional.
Functional Sum(std::span<const FunctionalTerm> terms);
Functional Sum(std::initializer_list<FunctionalTerm> terms);

// 0 over all texels, and factor times another added to one whose windows hold it: for sums of many.
Functional ZeroOf(const Lamp& lamp);
void Add(Functional& sum, double factor, const Functional& one);

Functional FluxOf(const Lamp& lamp);

// The flux whose rays have direction . axis > 0: of rays from the nodes of a rule of two in each cell
// of F, texels that the border crosses by the share beyond it along their middle line. Off by some
// thousandths of the light in such cells and texels.
Functional FluxTowards(const Lamp& lamp, lightfield::Vec3 axis);

// Far-field intensity; any direction but 0.
Functional IntensityTowards(const Lamp& lamp, lightfield::Vec3 direction);
// With its uncertainty, without weights in memory: faster where many are asked for.
Estimate IntensityEstimate(const Lamp& lamp, lightfield::Vec3 direction);
struct WeighedDirection {
  double factor = 1;
  lightfield::Vec3 direction;
};
// sum of factor times intensity.
Functional IntensitySum(const Lamp& lamp, std::span<const WeighedDirection> directions);

// Quantities at a point are integrals over the directions w in which light is seen from it,
//
//   Q = integral L(w) k(w) dw = delta^2 / z^3 sum_m integral_F C_m(s(u)) Phi_m(u) k(w) |u - p| du
//
// zero for fields whose filter plane lies before the point. Illuminance is exact as long as the
// receiver's horizon does not cut the supports on F; else it is, and the others are, by Gauss rules
// of four nodes per axis between knots and borders of texels. A horizon's kink costs some 1e-4.

// k = max(0, n.w), n a unit vector towards the lamp side.
Functional IlluminanceAt(const Lamp& lamp, lightfield::Vec3 p, lightfield::Vec3 n);

struct WeighedReceiver {
  double factor = 1;
  lightfield::Vec3 p, n;
};
// sum of factor times illuminance.
Functional IlluminanceSum(const Lamp& lamp, std::span<const WeighedReceiver> receivers);

// k = w: towards the light; its length is the largest difference of illuminance between two sides
// of a small plane. Minus Gershun's light vector.
std::array<Functional, 3> LightVectorAt(const Lamp& lamp, lightfield::Vec3 p);

// k = 1: the fluence rate. Mean spherical illuminance is a quarter of it.
Functional FluenceRateAt(const Lamp& lamp, lightfield::Vec3 p);

// integral L dw over the cone about `axis`, from the point to the light, that `half_angle` opens; its
// edge is cut at nodes a sixteenth of a knot spacing apart at most.
Functional LightWithin(const Lamp& lamp, lightfield::Vec3 p, lightfield::Vec3 axis,
                       double half_angle);

// The veiling luminance in an eye that looks along `line_of_sight`, cd/m^2 (CIE 140-2019; EN
// 13201-3:2015, 8.5): of light from theta = 1.5 to 60 degrees off that line,
//
//   L_v = 9.86 (1 + (age / 66.4)^4) integral L cos(theta) / theta^2 dw
//
// theta under the integral in degrees, age in years.
Functional VeilingLuminanceAt(const Lamp& lamp, lightfield::Vec3 eye,
                              lightfield::Vec3 line_of_sight, double age_years);

// Values alone, without weights: faster where many are asked for.
double IntensityValue(const Lamp& lamp, lightfield::Vec3 direction);
double IlluminanceValue(const Lamp& lamp, lightfield::Vec3 p, lightfield::Vec3 n);

}  // namespace luxfield::photometry
