// Where a plan may send the stage: within its own [stage] and what the lab's stage allows.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "luxfield/hal/safety/stage_bounds.h"
#include "luxfield/session/plan_file.h"

namespace luxfield::capture {

class StageReach {
 public:
  // Throws std::logic_error for a stage that was opened without the plan's bounds.
  StageReach(std::string plan_name, const hal::StageBounds& plan, const hal::Stage& stage);

  // Throws InputError that names the plan, `place`, and the limit that it lies beyond.
  void Require(hal::Vec2 centre_m, const std::string& place, const std::string& remedy) const;

 private:
  std::string plan_name_;
  const hal::StageBounds& plan_;
  hal::StageLimits stage_;
};

// As plan.json states it.
session::PlannedStage Planned(const hal::StageBounds& plan);

}  // namespace luxfield::capture
