#include "luxfield/hal/options/rig_options.h"

#include <limits>

#include "luxfield/core/warning.h"

namespace luxfield::hal {

rig::RigDescription ReadRig(const core::Config& config) {
  constexpr double kTiny = std::numeric_limits<double>::min();
  rig::RigDescription rig;
  const core::Config table = config.Table("rig");
  rig.kind = table.Choice("kind", {"lensless", "reflector"}) == "reflector"
                 ? rig::RigKind::kReflector
                 : rig::RigKind::kLensless;
  rig.delta_m = table.Number("delta_m", {1e-4, 100});
  core::SuspectLength(table.file(), "rig.delta_m", rig.delta_m, 10);
  if (rig.kind == rig::RigKind::kReflector) rig.albedo = table.Number("albedo", {1e-3, 1});

  const core::Config filter = config.Table("filter");
  rig.dual = filter.Choice("kind", {"basis", "dual"}, "basis") == "dual";
  const std::string basis =
      filter.Choice("basis", {"box", "bilinear", "quadratic", "bspline2"}, "bspline2");
  const double a = basis == "quadratic" ? filter.Number("basis_a", 0.5, {-1, 1}) : 0;
  rig.basis = lightfield::Basis::FromName(basis, a);
  if (rig.dual && basis != "quadratic" && basis != "bilinear")
    filter.Fail("basis", "has no dual filter", "choose quadratic or bilinear, or kind = \"basis\"");
  rig.spacing_m = filter.Number("spacing_m", {1e-6, 10});
  core::SuspectLength(filter.file(), "filter.spacing_m", rig.spacing_m, 1);
  const double peak = rig.basis.Peak() * rig.basis.Peak();
  rig.filter_scale = rig.dual ? 1 : filter.Number("scale", 1, {kTiny, 1 / peak * (1 + 1e-12)});
  return rig;
}

Corners ReadCorners(const core::Config& camera) {
  const auto c = camera.Numbers("corners_m", 8);
  Corners corners;
  for (int k = 0; k < 4; ++k) corners[k] = {c[2 * k], c[2 * k + 1]};
  // Clockwise as seen from the receivers, and convex, or rays would cross.
  for (int k = 0; k < 4; ++k) {
    const auto a = corners[k], b = corners[(k + 1) % 4], d = corners[(k + 2) % 4];
    if ((b.x - a.x) * (d.y - b.y) - (b.y - a.y) * (d.x - b.x) >= 0)
      camera.Fail("corners_m", "must be a convex quadrilateral",
                  "give top left, top right, bottom right, bottom left");
  }
  return corners;
}

Corners CornersOfPixels(double pitch_m, int width, int height) {
  const double x = 0.5 * width * pitch_m, y = 0.5 * height * pitch_m;
  return {{{-x, y}, {x, y}, {x, -y}, {-x, -y}}};
}

}  // namespace luxfield::hal
