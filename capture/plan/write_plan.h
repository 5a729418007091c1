// A plan as a plan.toml (docs/formats/lab-and-plan.md).
#pragma once

#include <filesystem>

#include "luxfield/capture/plan/plan.h"

namespace luxfield::capture {

// Every key that ReadPlan knows; numbers with all their digits, so that ReadPlan gives the plan
// back but for rounding of the grid's and the lattice's middle.
void WritePlan(const std::filesystem::path& path, const Plan& plan);

}  // namespace luxfield::capture
