// The plan that a target asks for, seen through: chosen by prediction, then captured on the
// simulated lab.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/planning/capture_planner.h"

namespace luxfield::planning {

struct PlanForTargetOptions {
  double max_rel_error = 0.01;
  bool capture = true;           // false: by prediction alone
  std::filesystem::path folder;  // scratch of the captures
  std::uint64_t seed = 1;        // of the lab
};

struct PlanForTarget {
  std::vector<PlannedCapture> plans;  // CapturePlanner::Plans
  std::optional<PlannedCapture> recommended;
  std::optional<SimulatedCapture> capture;  // of it, with all of the lab's errors
  // What the capture's error holds beside the prediction, in quadrature: the bench's other errors.
  double bench_error = 0;
  int captures = 0;
  std::string limit;  // without a recommended plan: the least error within reach and what limits it
};

// The fastest plan whose predicted error meets the target and, where it is to be captured, whose
// captured one does: what a capture shows beyond its prediction is left room for in the next
// choice, four captures at most. Throws what Plans and Simulate throw.
PlanForTarget FindPlan(const CapturePlanner& planner, const PlanForTargetOptions& options);

}  // namespace luxfield::planning
