// What a plan allows a stage: of what its lab allows less, never more ([stage] of a plan.toml,
// docs/formats/lab-and-plan.md).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/config.h"
#include "luxfield/hal/stage.h"

namespace luxfield::hal {

// Absent: as the lab has it.
struct StageBounds {
  std::string file;              // that states them
  std::optional<Vec2> min, max;  // metres, of the filter's centre in the luminaire frame
  std::optional<double> speed_m_per_s;
};

// The keys min_m, max_m and speed_m_per_s of a plan's [stage]. Throws InputError naming file and
// field.
StageBounds ReadStageBounds(const core::Config& stage);

// The plan's limit that a filter's centre lies beyond, as it stands in the plan; empty: none.
// Places of a grid are rounded sums: the last of it may lie a nanometre beyond, here and in
// Tightened.
std::string LimitBefore(const StageBounds& plan, Vec2 centre_m);

// Of every limit, and of the speed, the tighter one. Throws InputError naming the plan's field
// where nothing is left of the lab's limits.
StageLimits Tightened(const StageLimits& lab, const StageBounds& plan);

// A sentence for every field by which the plan would allow more than the lab, and what holds.
std::vector<std::string> Overruled(const StageLimits& lab, const StageBounds& plan);

}  // namespace luxfield::hal
