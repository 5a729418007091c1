#include "luxfield/cli/reports/photometry_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/cli/svg/svg_polar.h"
#include "luxfield/cli/svg/svg_solid.h"
#include "luxfield/photometry/distribution.h"

namespace luxfield::cli {
namespace {

// The plane of C and C + 180: gamma counts to the side of C.
PolarCurve CurveOf(const photometry::Lamp& lamp, double c_deg, double most_deg) {
  constexpr int kSteps = 360;  // to either side
  PolarCurve curve;
  curve.name = fmt::format("C{:.0f}-C{:.0f}", c_deg + 180, c_deg);
  for (int k = -kSteps; k <= kSteps; ++k) {
    const double gamma = most_deg * k / kSteps;
    curve.gamma_deg.push_back(gamma);
    curve.value.push_back(
        IntensityValue(lamp, photometry::VectorOf({k < 0 ? c_deg + 180 : c_deg, std::abs(gamma)})));
  }
  return curve;
}

// The largest gamma at which a curve still has a thousandth of the largest value, rounded up.
double ReachOf(const std::vector<PolarCurve>& curves) {
  double largest = 0, reach = 0;
  for (const auto& curve : curves)
    for (const double value : curve.value) largest = std::max(largest, value);
  for (const auto& curve : curves)
    for (std::size_t k = 0; k < curve.value.size(); ++k)
      if (curve.value[k] > 1e-3 * largest) reach = std::max(reach, std::abs(curve.gamma_deg[k]));
  return reach;
}

// "u, m" for a direction along an axis of the frame, else `name`, counted from the centre.
std::string AxisName(lightfield::Vec3 d, const std::string& name) {
  if (d.x == 1) return "u (x), m";
  if (d.y == 1) return "v (y), m";
  if (d.z == 1) return "z, m";
  return name + ", m from the centre";
}

// The largest gamma that plots show: 90, of a lamp that shines upwards too 180, and less where the lamp
// shines less far.
double LargestGamma(const photometry::Lamp& lamp, bool whole_sphere) {
  const double most = whole_sphere ? 180 : 90;
  const double reach = ReachOf({CurveOf(lamp, 0, most), CurveOf(lamp, 90, most)});
  return reach > 0 && reach < 0.8 * most ? std::min(most, 1.1 * reach) : most;
}

}  // namespace

std::vector<std::string> IntensityPlots(const photometry::Lamp& lamp, bool whole_sphere) {
  const PhotometryNames names = NamesOf(lamp.unit);
  const double most = LargestGamma(lamp, whole_sphere);
  const std::vector<PolarCurve> curves{CurveOf(lamp, 0, most), CurveOf(lamp, 90, most)};
  Plot plot;
  plot.title = names.intensity;
  plot.x_label = "gamma, °";
  plot.y_label = names.intensity_unit;
  plot.width = 560;
  plot.height = 400;
  for (const auto& curve : curves) {
    const bool dashed = !plot.series.empty();
    plot.series.push_back({curve.name, curve.gamma_deg, curve.value, true, {}, false, dashed});
  }
  return {SvgPolar({names.intensity, names.intensity_unit, curves}), SvgPlot(plot)};
}

std::string SolidOf(const photometry::Lamp& lamp, bool whole_sphere) {
  constexpr int kPlanes = 48, kAngles = 36;
  const PhotometryNames names = NamesOf(lamp.unit);
  const double most = LargestGamma(lamp, whole_sphere);
  IntensitySolid solid{names.intensity + ", solid", names.intensity_unit, {}, {}, {}};
  for (int k = 0; k < kPlanes; ++k) solid.c_deg.push_back(360.0 * k / kPlanes);
  for (int k = 0; k <= kAngles; ++k) solid.gamma_deg.push_back(most * k / kAngles);
  for (const double c : solid.c_deg)
    for (const double gamma : solid.gamma_deg)
      solid.value.push_back(IntensityValue(lamp, photometry::VectorOf({c, gamma})));
  return SvgSolid(solid);
}

IsoluxMap IsoluxOf(const photometry::PlaneAnswer& answer, const PhotometryNames& names) {
  const auto& asked = answer.asked;
  IsoluxMap map;
  map.title = fmt::format("{}, {}", names.IlluminanceTitle(asked.receiver.shape), asked.name);
  map.unit = names.illuminance_unit;
  map.x_label = AxisName(asked.right, "right");
  map.y_label = AxisName(asked.up, "up");
  // A plane along the frame's axes shows its coordinates.
  const auto centre = [&](lightfield::Vec3 d) {
    return d.x == 1 || d.y == 1 || d.z == 1 ? Dot(d, asked.centre_m) : 0.0;
  };
  map.x0 = centre(asked.right) - asked.width_m / 2;
  map.x1 = centre(asked.right) + asked.width_m / 2;
  map.y0 = centre(asked.up) - asked.height_m / 2;
  map.y1 = centre(asked.up) + asked.height_m / 2;
  map.columns = asked.columns;
  map.rows = asked.rows;
  map.values = answer.values;
  return map;
}

}  // namespace luxfield::cli
