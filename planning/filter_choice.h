// The filters that a search tries: families, spacings, and where they can stand.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "luxfield/hal/stage.h"
#include "luxfield/planning/planned_filters.h"
#include "luxfield/rig/homography.h"

namespace luxfield::planning {

struct FilterFamily {
  lightfield::Basis basis;
  bool dual;
  std::string name;  // "quadratic", "quadratic, dual"
};
// Every basis (`quadratic` with a = 1/2), and the dual filters of those that have them.
std::vector<FilterFamily> FilterFamilies();

// The largest rectangle on I about the filter's axis whose sides keep within a convex sensor's
// outline: all of it is seen.
Rectangle SeenBySensor(const rig::Homography& image_from_sensor, int width, int height);

// Texels of the pitch, or a whole number of pitches, that fill a rectangle on I; at most `texels`
// along its longer side.
lightfield::Lattice LatticeOver(const Rectangle& rectangle, double pitch_m, int texels);

// What filters are laid over.
struct FilterField {
  Rectangle lit;  // of F
  hal::StageLimits stage;
  Rectangle sensor;  // SeenBySensor
  double pitch_m = 0;
  lightfield::Lattice lattice;  // texels that the scene sees
};

// The lit part of F in `cells` cells along its longer side, and `fewer` filters less along each
// axis than cover it (at most n - 1), centred on it; texels that every position sees, a pixel from
// the sensor's edge. Nothing where the stage does not reach all positions, or no texel is left.
std::optional<PlannedFilters> Lay(const FilterFamily& family, int cells, int fewer,
                                  const FilterField& field);

}  // namespace luxfield::planning
