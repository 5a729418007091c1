#include "luxfield/planning/plan_for_target.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/progress.h"

namespace luxfield::planning {
namespace {

std::string Percent(double share) { return fmt::format("{:.3g} %", 100 * share); }

std::string Described(const PlannedCapture& plan) {
  const auto& grid = plan.plan.geometry.grid;
  return fmt::format("{}, {} x {} positions, {}", plan.family, grid.width, grid.height,
                     core::FormatDuration(plan.capture_s));
}

// What the least error within reach is made of, and what would lower it.
std::string LimitOf(const PlannedCapture& best, double samples_error) {
  if (best.noise > best.truncation)
    return fmt::format(
        "noise, {}, with the longest brackets and 16 repeats: a brighter lamp, a more "
        "sensitive camera or larger pixels",
        Percent(best.noise));
  if (samples_error > 0.7 * best.truncation)
    return fmt::format("images of {} x {} texels, {}: raise --texels",
                       best.plan.geometry.lattice.width, best.plan.geometry.lattice.height,
                       Percent(samples_error));
  return fmt::format(
      "the basis at a spacing of {:.3g} mm, {}: a stage of more reach or a sensor that "
      "sees more of the image plane",
      1e3 * best.plan.geometry.grid.spacing_m, Percent(best.truncation));
}

}  // namespace

PlanForTarget FindPlan(const CapturePlanner& planner, const PlanForTargetOptions& options) {
  constexpr int kCaptures = 4;
  PlanForTarget result;
  result.plans = planner.Plans();
  const double target = options.max_rel_error;
  double aim = target;
  while (const PlannedCapture* plan = FastestConfirmed(planner, aim, &result.plans)) {
    result.recommended = *plan;
    if (!options.capture) return result;
    result.capture = planner.Simulate(*plan, options.folder, options.seed);
    ++result.captures;
    const double error = result.capture->error.value, predicted = plan->error();
    result.bench_error = std::sqrt(std::max(0.0, error * error - predicted * predicted));
    if (error <= target) return result;
    if (result.captures == kCaptures) break;
    // The next plan is another one, even where the bench's errors would leave room for this one.
    const double room = target * target - result.bench_error * result.bench_error;
    aim = std::min(room > 0 ? std::sqrt(room) : 0, predicted * (1 - 1e-6));
  }
  const PlannedCapture& best = MostAccurate(result.plans);
  if (result.captures == 0)
    result.limit =
        fmt::format("the least error within reach is {} ({}), limited by {}", Percent(best.error()),
                    Described(best), LimitOf(best, planner.samples_error()));
  else
    result.limit = fmt::format(
        "a simulated capture of {} has an error of {}, of which {} is what the bench gets wrong "
        "beside noise and model (stage, print, lamp, stray light, shutter); the least of noise and "
        "model within reach is {}: better the bench",
        Described(*result.recommended), Percent(result.capture->error.value),
        Percent(result.bench_error), Percent(best.error()));
  result.recommended.reset();
  return result;
}

}  // namespace luxfield::planning
