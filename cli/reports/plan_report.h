// What `plan --max-error` shows: a table on the terminal, a page with the curve of capture time
// against accuracy.
#pragma once

#include <filesystem>
#include <string>

#include "luxfield/core/json.h"
#include "luxfield/planning/plan_for_target.h"

namespace luxfield::cli {

// What was asked, and what the answer's numbers are good to.
struct PlanQuestion {
  std::string lab, scene;
  double max_rel_error = 0;
  double truth_error = 0, samples_error = 0;
};

core::Json PrintPlanForTarget(const PlanQuestion& question, const planning::PlanForTarget& answer);

// X.svg of X.html. Throws InputError where something else has the name.
std::filesystem::path CurveBeside(const std::filesystem::path& html);

// X.html, and X.svg beside it with the curve alone.
void WritePlanReport(const PlanQuestion& question, const planning::PlanForTarget& answer,
                     const std::filesystem::path& html);

}  // namespace luxfield::cli
