#include "luxfield/reconstruct/merge/tilt_effect.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/reconstruct/merge/tilt_effect_json.h"

namespace luxfield::reconstruct {

using lightfield::Vec2;

TiltEffect EffectOfTilts(const SessionPlan& plan) {
  const auto& geometry = plan.geometry;
  const TiltedPlanes& tilts = plan.tilts.value();
  const auto& lattice = geometry.lattice;
  const auto& grid = geometry.grid;
  TiltEffect effect;
  effect.stated_light = 2 * tilts.delta_sigma_m / geometry.delta_m;
  effect.stated_displacement = tilts.place_sigma_m / grid.spacing_m;
  for (int m = 0; m < grid.count(); ++m) {
    const Vec2 c = grid.centre(m % grid.width, m / grid.width);
    const double lift_m = tilts.stage_slopes.x * c.x + tilts.stage_slopes.y * c.y;
    for (const int row : {0, lattice.height - 1})
      for (const int column : {0, lattice.width - 1}) {
        const Vec2 q = lattice.centre(row, column) - c;
        const double light = tilts.filter_tilt_rad.y * q.x - tilts.filter_tilt_rad.x * q.y;
        effect.light = std::max(effect.light, std::abs(light) / geometry.delta_m);
        effect.displacement =
            std::max(effect.displacement,
                     std::hypot(q.x, q.y) * std::abs(lift_m) / (geometry.delta_m * grid.spacing_m));
      }
  }
  return effect;
}

std::string TextOf(const TiltEffect& effect) {
  return fmt::format(
      "E off by up to {:.2g} % from the filter's tilt, the filter by {:.2g} spacings from the "
      "stage's slope: not corrected{}",
      100 * effect.light, effect.displacement,
      effect.BeyondStated()
          ? fmt::format(", and more than the calibration's own uncertainty ({:.2g} %, {:.2g} "
                        "spacings), which is what the error budget knows; shim filter and stage",
                        100 * effect.stated_light, effect.stated_displacement)
          : "");
}

nlohmann::json ToJson(const TiltEffect& effect) {
  return {{"light", effect.light},
          {"displacement", effect.displacement},
          {"stated_light", effect.stated_light},
          {"stated_displacement", effect.stated_displacement}};
}

}  // namespace luxfield::reconstruct
