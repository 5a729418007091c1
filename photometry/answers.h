// What a lamp's light is at points and on planes that are asked for (asked.h).
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "luxfield/photometry/asked.h"
#include "luxfield/photometry/distribution.h"
#include "luxfield/photometry/functional.h"
#include "luxfield/photometry/luminous_area.h"

namespace luxfield::photometry {

struct PointAnswer {
  PointAsked asked;
  Estimate illuminance;                  // on `normal`
  std::array<Estimate, 3> light_vector;  // towards the light
  Estimate spherical;                    // a quarter of the fluence rate
  Estimate cylindrical;
  std::optional<Estimate> semicylindrical;  // where `facing` is asked for
};
PointAnswer AnswerAt(const Lamp& lamp, const PointAsked& asked);

struct EyeAnswer {
  EyeAsked asked;
  struct FieldOfView {
    double mrad = 0;
    Estimate largest;            // of the mean luminance over it, anywhere
    lightfield::Vec3 direction;  // where
    Estimate peak;               // the largest luminance within that field of view
    lightfield::Vec3 peak_direction;
  };
  std::vector<FieldOfView> fields;
  // Above the threshold; absent: nothing is. This and what follows of glare but the veiling luminance
  // are of luminance in cd/m^2, and absent of a lamp in other units.
  std::optional<LuminousArea> area;
  std::optional<Estimate> ugr;        // of that area; absent: not asked for, or no area
  std::optional<Estimate> plain_ugr;  // of the opening, as if it were evenly bright
  std::optional<Estimate> veiling;    // luminance; absent: no line of sight
  // %, from the veiling luminance and that of the road; absent: not asked for.
  std::optional<Estimate> threshold_increment;
};
EyeAnswer AnswerFor(const Lamp& lamp, const EyeAsked& asked);

struct GlareAnswer {
  GlareAsked asked;
  // [plane][distance], of the luminous area and of the opening; as of an eye.
  std::vector<std::optional<Estimate>> ugr, plain_ugr;
};
GlareAnswer AnswerFor(const Lamp& lamp, const GlareAsked& asked);

struct LineAnswer {
  LineAsked asked;
  std::vector<PointAnswer> points;
};
LineAnswer AnswerAlong(const Lamp& lamp, const LineAsked& asked);

// What receivers take in at many points. Values are exact on a plane (IlluminanceValue), else by
// quadrature; uncertainties are those of the places found, first order.
struct ManyPoints {
  std::vector<double> values;
  Estimate mean, least, most;
  // least / mean and least / most; absent where one of both is below 0, which is noise, or that it is
  // divided by 0.
  std::optional<Estimate> uniformity, diversity;
  std::size_t least_at = 0, most_at = 0;  // of `values`
};

struct PlaneAnswer : ManyPoints {  // [row][column], row 0 at the top
  PlaneAsked asked;
  double at(int column, int row) const {
    return values[static_cast<std::size_t>(row) * asked.columns + column];
  }
};
PlaneAnswer AnswerOn(const Lamp& lamp, const PlaneAsked& asked);

struct VolumeAnswer : ManyPoints {  // [layer][row][column]
  VolumeAsked asked;
};
VolumeAnswer AnswerIn(const Lamp& lamp, const VolumeAsked& asked);

// 51 x 51 points at a distance before the lamp, as wide as its beam.
PlaneAsked PlaneOfBeam(const Distribution& distribution, double distance_m);

}  // namespace luxfield::photometry
