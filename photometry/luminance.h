// A lamp as an eye sees it: luminance by direction, means over round fields of view and the brightest
// place, formulas of glare (docs/photometry.md); what of it glares is in luminous_area.h.
//
// From an eye at p light is seen along w, a unit vector from the eye to the lamp: radiance L(u->s) of
// the ray through p (docs/theory.md 2), of all fields whose planes the eye is before. All in the
// luminaire's frame, metres.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "luxfield/photometry/functional.h"

namespace luxfield::photometry {

Functional LuminanceTowards(const Lamp& lamp, lightfield::Vec3 eye, lightfield::Vec3 w);
double LuminanceValue(const Lamp& lamp, lightfield::Vec3 eye, lightfield::Vec3 w);

struct WeighedRay {
  double factor = 1;
  lightfield::Vec3 w;
};
// sum of factor times luminance.
Functional LuminanceSum(const Lamp& lamp, lightfield::Vec3 eye,
                        const std::vector<WeighedRay>& rays);

// The mean over a cone of so many radians from side to side about w, by rays of equal solid angle,
// or, where it is wider than eight spacings of the basis, over the filter plane (LightWithin):
//
//   1 / Omega integral L dw,   Omega = 2 pi (1 - cos(full_angle / 2))
Functional MeanLuminance(const Lamp& lamp, lightfield::Vec3 eye, lightfield::Vec3 w,
                         double full_angle);
double MeanLuminanceValue(const Lamp& lamp, lightfield::Vec3 eye, lightfield::Vec3 w,
                          double full_angle);

// The middle of the filter planes that an eye is before; absent where it is before none.
std::optional<lightfield::Vec3> MiddleSeen(const Lamp& lamp, lightfield::Vec3 eye);

// Directions centre + x right + y up, x and y evenly over a rectangle that holds all of the filter
// planes that the eye sees; row 0 at the top.
struct LuminancePicture {
  lightfield::Vec3 centre, right, up;  // unit, at right angles
  double x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  int columns = 0, rows = 0;
  std::vector<double> luminance;  // [row][column]

  lightfield::Vec3 Direction(double column,
                             double row) const;  // unit; 0.5, 0.5: of the first field
  double SolidAngle(int column, int row) const;
};
// `up`: as near to it as can be. No field that the eye is before: an empty picture. At most `most`
// columns and rows.
LuminancePicture PictureFrom(const Lamp& lamp, lightfield::Vec3 eye, lightfield::Vec3 up, int most);

// The direction of the largest mean over a field of view: of a picture as fine as a sixth of the
// field (at most 300 fields wide), its brightest places climbed from; the middle of a lamp that the field
// of view holds all of.
lightfield::Vec3 BrightestPlace(const Lamp& lamp, lightfield::Vec3 eye, double full_angle);

// The direction of the largest luminance within a field of view about w: of rays that are half a
// texel and half a spacing of the basis apart on the filter plane (at most 400 across), the brightest ones
// climbed from.
lightfield::Vec3 BrightestRay(const Lamp& lamp, lightfield::Vec3 eye, lightfield::Vec3 w,
                              double full_angle);

// Guth's position index of a source that is seen in direction w, the eye looking along
// `line_of_sight` (CIE 117-1995; the formula is Levin's, 1975): with alpha the angle in degrees at
// the line of sight from `up` to the source, beta that between source and line of sight,
//
//   ln p = (35.2 - 0.31889 alpha - 1.22 exp(-2 alpha / 9)) 1e-3 beta
//          + (21 + 0.26667 alpha - 0.002963 alpha^2) 1e-5 beta^2
double PositionIndex(lightfield::Vec3 line_of_sight, lightfield::Vec3 up, lightfield::Vec3 w);

// The lamp's part of the unified glare rating before a background luminance (CIE 117-1995),
//
//   UGR = 8 log10(0.25 / L_b  L^2 omega / p^2)
double UnifiedGlareRating(double luminance, double solid_angle, double position_index,
                          double background);
// Its scale goes from 10 to 30 (CIE 117-1995): what is below is no glare that people tell apart.
constexpr double kLeastRating = 10;

// The threshold increment, %, of a veiling luminance on a road of an average luminance L, cd/m^2 (CIE
// 140-2019; EN 13201-3:2015, 8.5):
//
//   TI = 65 L_v / L^0.8  up to 5 cd/m^2,   95 L_v / L^1.05 above
double ThresholdIncrement(double veiling, double road);

// Solid angle of a rectangle on F about the origin (van Oosterom and Strackee 1983), sr.
double SolidAngleOfOpening(lightfield::Vec3 eye, double width_m, double height_m);

}  // namespace luxfield::photometry
