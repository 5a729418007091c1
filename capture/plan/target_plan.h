// What plans that show a camera one target after the other have in common: of the geometry, of the
// glare and of a printed filter (docs/formats/lab-and-plan.md).
#pragma once

#include <string>
#include <vector>

#include "luxfield/capture/plan/plan.h"

namespace luxfield::capture {

struct TargetPlan {
  std::string name;
  double min_s = 0, max_s = 0;    // a target takes the longest exposure, in factors of 2, that ...
  double saturation_share = 0.8;  // ... keeps every pixel below this share of saturation
  int max_attempts = 3;
};

// [plan] kind and name, [exposure] min_s, max_s, saturation_share and max_attempts. `what` the kind
// of plan does, for the sentence about one of another kind. Throws InputError naming file and field.
void ReadTargetPlan(const core::Config& config, PlanKind kind, const std::string& what,
                    TargetPlan& plan);

// Rising, in factors of 2. Throws InputError for exposures beyond the camera's.
std::vector<double> TargetLadder(const TargetPlan& plan, const hal::Devices& devices);

// What all of them state in plan.json.
session::PlanFile TargetPlanFile(PlanKind kind, const TargetPlan& plan,
                                 const std::vector<double>& ladder_s);

std::vector<session::PlannedView> Views(const std::vector<std::string>& targets);

}  // namespace luxfield::capture
