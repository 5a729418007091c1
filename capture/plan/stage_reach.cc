#include "luxfield/capture/plan/stage_reach.h"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "luxfield/core/error.h"

namespace luxfield::capture {

StageReach::StageReach(std::string plan_name, const hal::StageBounds& plan, const hal::Stage& stage)
    : plan_name_(std::move(plan_name)), plan_(plan), stage_(stage.limits()) {
  const hal::StageLimits within = hal::Tightened(stage_, plan);
  if (within.speed_m_per_s < stage_.speed_m_per_s ||
      !(within.Contain(stage_.min) && within.Contain(stage_.max)))
    throw std::logic_error("the stage was opened without the bounds of plan \"" + plan_name_ +
                           "\"");
}

void StageReach::Require(hal::Vec2 centre, const std::string& place,
                         const std::string& remedy) const {
  std::string beyond = hal::LimitBefore(plan_, centre);
  if (!beyond.empty())
    beyond = "lies beyond " + beyond;
  else if (!stage_.Contain(centre))
    beyond = fmt::format("is outside the stage's [{}, {}] x [{}, {}] m", stage_.min.x, stage_.max.x,
                         stage_.min.y, stage_.max.y);
  if (!beyond.empty())
    throw InputError(fmt::format("plan \"{}\"", plan_name_), place + " " + beyond, remedy);
}

session::PlannedStage Planned(const hal::StageBounds& plan) {
  return {plan.min, plan.max, plan.speed_m_per_s, {}};
}

}  // namespace luxfield::capture
