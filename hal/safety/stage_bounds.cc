#include "luxfield/hal/safety/stage_bounds.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/core/error.h"

namespace luxfield::hal {
namespace {

constexpr double kRounding_m = 1e-9;

std::optional<Vec2> ReadPoint(const core::Config& stage, const char* key) {
  if (!stage.Has(key)) return {};
  const auto numbers = stage.Numbers(key, 2);
  return Vec2{numbers[0], numbers[1]};
}

std::string Text(double value) { return fmt::format("{:.6g}", value); }
std::string Text(Vec2 v) { return fmt::format("[{:.6g}, {:.6g}]", v.x, v.y); }

// The plan's limits as they are held against.
Vec2 Least(const StageBounds& plan) {
  return {plan.min->x - kRounding_m, plan.min->y - kRounding_m};
}
Vec2 Most(const StageBounds& plan) {
  return {plan.max->x + kRounding_m, plan.max->y + kRounding_m};
}

Vec2 Larger(Vec2 a, Vec2 b) { return {std::max(a.x, b.x), std::max(a.y, b.y)}; }
Vec2 Smaller(Vec2 a, Vec2 b) { return {std::min(a.x, b.x), std::min(a.y, b.y)}; }

}  // namespace

StageBounds ReadStageBounds(const core::Config& stage) {
  StageBounds bounds{stage.file(), ReadPoint(stage, "min_m"), ReadPoint(stage, "max_m"), {}};
  if (bounds.min && bounds.max && !(bounds.min->x < bounds.max->x && bounds.min->y < bounds.max->y))
    stage.Fail("max_m", "must lie above min_m in both axes");
  if (stage.Has("speed_m_per_s")) bounds.speed_m_per_s = stage.Number("speed_m_per_s", {1e-6, 100});
  return bounds;
}

std::string LimitBefore(const StageBounds& plan, Vec2 centre) {
  if (plan.min && !(centre.x >= Least(plan).x && centre.y >= Least(plan).y))
    return "stage.min_m = " + Text(*plan.min);
  if (plan.max && !(centre.x <= Most(plan).x && centre.y <= Most(plan).y))
    return "stage.max_m = " + Text(*plan.max);
  return {};
}

StageLimits Tightened(const StageLimits& lab, const StageBounds& plan) {
  StageLimits limits = lab;
  if (plan.min) limits.min = Larger(lab.min, Least(plan));
  if (plan.max) limits.max = Smaller(lab.max, Most(plan));
  if (plan.speed_m_per_s) limits.speed_m_per_s = std::min(lab.speed_m_per_s, *plan.speed_m_per_s);
  if (limits.min.x < limits.max.x && limits.min.y < limits.max.y) return limits;
  // One of the two is the plan's: the lab's own leave something.
  const bool by_min = plan.min && !(plan.min->x < lab.max.x && plan.min->y < lab.max.y);
  throw InputError(plan.file,
                   fmt::format("stage.{} = {} leaves nothing of the lab's {} to {} m",
                               by_min ? "min_m" : "max_m", Text(by_min ? *plan.min : *plan.max),
                               Text(lab.min), Text(lab.max)),
                   "correct it, or take the plan's lab");
}

std::vector<std::string> Overruled(const StageLimits& lab, const StageBounds& plan) {
  const StageLimits held = Tightened(lab, plan);
  std::vector<std::string> sentences;
  const auto say = [&](const char* field, const auto& planned, const auto& labs,
                       const auto& holds) {
    sentences.push_back(fmt::format("{}: stage.{} = {} allows more than the lab's {}: {} holds",
                                    plan.file, field, Text(planned), Text(labs), Text(holds)));
  };
  if (plan.min && (plan.min->x < lab.min.x || plan.min->y < lab.min.y))
    say("min_m", *plan.min, lab.min, held.min);
  if (plan.max && (plan.max->x > lab.max.x || plan.max->y > lab.max.y))
    say("max_m", *plan.max, lab.max, held.max);
  if (plan.speed_m_per_s && *plan.speed_m_per_s > lab.speed_m_per_s)
    say("speed_m_per_s", *plan.speed_m_per_s, lab.speed_m_per_s, held.speed_m_per_s);
  return sentences;
}

}  // namespace luxfield::hal
