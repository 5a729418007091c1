#include "luxfield/formats/far_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "luxfield/core/colour.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::formats {
namespace {

using lightfield::PosedLightField;
using lightfield::Vec3;

Opening OpeningOf(std::span<const PosedLightField> fields) {
  Vec3 low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  for (const auto& posed : fields) {
    const auto& grid = posed.field.geometry.grid;
    const double width = (grid.width + grid.basis.cells - 1) * grid.spacing_m;
    const double height = (grid.height + grid.basis.cells - 1) * grid.spacing_m;
    for (const double u : {grid.u0_m, grid.u0_m + width})
      for (const double v : {grid.v0_m, grid.v0_m + height}) {
        const Vec3 p = posed.luminaire_from_field.Point({u, v, 0});
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
      }
  }
  return {Opening::Shape::kBox, high.x - low.x, high.y - low.y, high.z - low.z};
}

}  // namespace

double IntensityOf(std::span<const PosedLightField> fields, Vec3 direction,
                   std::optional<double> distance_m) {
  if (!distance_m) return core::Luminance(lightfield::FarFieldIntensity(fields, direction));
  double sum = 0;
  for (const auto& posed : fields) {
    const lightfield::RigidPose field_from_luminaire = posed.luminaire_from_field.Inverse();
    const Vec3 p = field_from_luminaire.Point(*distance_m * direction);
    if (!(p.z > 0)) continue;
    const Vec3 n = field_from_luminaire.Direction(-1.0 * direction);
    sum += core::Luminance(lightfield::ExactIrradiance(posed.field, p, n));
  }
  return sum * *distance_m * *distance_m;
}

Photometry FarFieldTable(std::span<const PosedLightField> fields,
                         const std::vector<double>& planes_deg,
                         const std::vector<double>& angles_deg, std::optional<double> distance_m) {
  Photometry p;
  p.format = "light field";
  p.absolute = true;
  p.planes_deg = planes_deg;
  p.angles_deg = angles_deg;
  for (const double plane : planes_deg)
    for (const double angle : angles_deg) {
      const bool pole = angle == 0 || angle == 180;  // one direction in all planes
      p.intensity_cd.push_back(
          IntensityOf(fields, Direction(PhotometryType::kC, pole ? 0 : plane, angle), distance_m));
    }
  p.opening = OpeningOf(fields);
  p.keywords = {{"TEST", "computed from a light field"}, {"_SIMULATED", "yes"}};
  if (distance_m)
    p.keywords.emplace_back("NEARFIELD", fmt::format("{0:.6g} {0:.6g} {0:.6g}", *distance_m));
  for (const auto& [key, value] : fields.front().field.provenance)
    p.keywords.emplace_back("_" + key, value);
  return p;
}

}  // namespace luxfield::formats
