// Fuzz target: a plan.toml of any kind. Anything but an InputError is a fault.
#pragma once

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "luxfield/capture/plan/filter_plan.h"
#include "luxfield/capture/plan/geometry_plan.h"
#include "luxfield/capture/plan/glare_plan.h"
#include "luxfield/capture/plan/plan.h"
#include "luxfield/capture/plan/sensor_plan.h"
#include "luxfield/core/error.h"

namespace luxfield::fuzz {

inline void PlanFile(std::string_view input) {
  try {
    const core::Config config = core::Config::FromString(input, "plan.toml");
    switch (capture::ReadPlanKind(config)) {
      case capture::PlanKind::kLightField: {
        const capture::Plan plan = capture::ReadPlan(config);
        const auto& grid = plan.geometry.grid;
        if (grid.width < 1 || grid.height < 1 || !std::isfinite(grid.u0_m) ||
            !std::isfinite(plan.exposure.max_s) || plan.exposure.max_s < plan.exposure.min_s)
          std::abort();
        break;
      }
      case capture::PlanKind::kSensor:
        capture::ReadSensorPlan(config);
        break;
      case capture::PlanKind::kGeometry:
        capture::ReadGeometryPlan(config);
        break;
      case capture::PlanKind::kGlare:
        capture::ReadGlarePlan(config);
        break;
      case capture::PlanKind::kFilter:
        capture::ReadFilterPlan(config);
        break;
    }
  } catch (const InputError&) {
  }
}

}  // namespace luxfield::fuzz
