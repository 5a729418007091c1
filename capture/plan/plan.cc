#include "luxfield/capture/plan/plan.h"

#include <limits>

namespace luxfield::capture {
namespace {

constexpr double kTiny = std::numeric_limits<double>::min();

void ReadGeometry(const core::Config& config, Plan& plan) {
  auto& geometry = plan.geometry;
  const core::Config rig = config.Table("rig");
  plan.rig = rig.Choice("kind", {"lensless", "reflector"}) == "reflector" ? rig::RigKind::kReflector
                                                                          : rig::RigKind::kLensless;
  geometry.delta_m = rig.Number("delta_m", {1e-4, 100});
  if (plan.rig == rig::RigKind::kReflector) plan.albedo = rig.Number("albedo", {1e-3, 1});

  const core::Config filter = config.Table("filter");
  plan.dual = filter.Choice("kind", {"basis", "dual"}, "basis") == "dual";
  const std::string name =
      filter.Choice("basis", {"box", "bilinear", "quadratic", "bspline2"}, "bspline2");
  const auto basis = lightfield::Basis::FromName(
      name, name == "quadratic" ? filter.Number("basis_a", 0.5, {-1, 1}) : 0);
  if (plan.dual && name != "quadratic" && name != "bilinear")
    filter.Fail("basis", "has no dual filter", "choose quadratic or bilinear, or kind = \"basis\"");
  const double spacing_m = filter.Number("spacing_m", {1e-6, 10});
  if (!plan.dual) plan.filter_scale = filter.Number("scale", 1, {kTiny, 1e3});

  const core::Config grid = config.Table("grid");
  const int width = grid.Integer("width", 1, 256), height = grid.Integer("height", 1, 256);
  geometry.grid = lightfield::BasisGrid::Centred(basis, width, height, spacing_m);
  geometry.grid.u0_m += grid.Number("centre_u_m", 0, {-10, 10});
  geometry.grid.v0_m += grid.Number("centre_v_m", 0, {-10, 10});

  const core::Config lattice = config.Table("lattice");
  auto& l = geometry.lattice;
  l.width = lattice.Integer("width", 1, 16384);
  l.height = lattice.Integer("height", 1, 16384);
  l.ds_m = lattice.Number("ds_m", {1e-7, 10});
  l.dt_m = lattice.Number("dt_m", l.ds_m, {1e-7, 10});
  l.s0_m = lattice.Number("centre_s_m", 0, {-100, 100}) - 0.5 * l.width * l.ds_m;
  l.t1_m = lattice.Number("centre_t_m", 0, {-100, 100}) + 0.5 * l.height * l.dt_m;
}

void ReadExposure(const core::Config& config, ExposurePolicy& e) {
  e.min_s = config.Number("min_s", {1e-9, 1e4});
  e.max_s = config.Number("max_s", {e.min_s, 1e5});
  e.ratio = config.Number("ratio", e.ratio, {1.1, 8});
  e.measure_pwm = config.HasText("pwm_hz") && config.Choice("pwm_hz", {"measure"}) == "measure";
  if (!e.measure_pwm) e.pwm_hz = config.Number("pwm_hz", e.pwm_hz, {0, 1e6});
  e.saturation_share = config.Number("saturation_share", e.saturation_share, {0.1, 1});
  e.relevant_share = config.Number("relevant_share", e.relevant_share, {1e-9, 1});
  e.floor_sigmas = config.Number("floor_sigmas", e.floor_sigmas, {0, 1000});
  e.repeats = config.Integer("repeats", e.repeats, 1, 1000);
  e.max_attempts = config.Integer("max_attempts", e.max_attempts, 1, 100);
  e.mean_tolerance = config.Number("mean_tolerance", e.mean_tolerance, {1e-6, 1});
  e.flicker = config.Number("flicker", e.flicker, {0, 10});
  if (e.measure_pwm && e.flicker == 0)
    config.Fail("pwm_hz", "needs exposure.flicker, by which frames may differ",
                "add flicker = 0.005");
}

}  // namespace

Plan ReadPlan(const std::filesystem::path& path) { return ReadPlan(core::Config::FromFile(path)); }

WarmUpPolicy ReadWarmUp(const core::Config& config) {
  WarmUpPolicy w;
  if (const auto warm_up = config.OptionalTable("warm_up")) {
    w.window_s = warm_up->Number("window_s", w.window_s, {0, 1e5});
    w.interval_s = warm_up->Number("interval_s", w.interval_s, {0.01, 1e4});
    w.variation = warm_up->Number("variation", w.variation, {1e-9, 1});
    w.max_wait_s = warm_up->Number("max_wait_s", w.max_wait_s, {w.window_s, 1e6});
  }
  return w;
}

PlanKind ReadPlanKind(const core::Config& config) {
  const std::string name = config.Table("plan").Choice(
      "kind", {"light-field", "sensor", "geometry", "glare", "filter"}, "light-field");
  for (const PlanKind kind :
       {PlanKind::kSensor, PlanKind::kGeometry, PlanKind::kGlare, PlanKind::kFilter})
    if (name == session::PlanKindName(kind)) return kind;
  return PlanKind::kLightField;
}

Plan ReadPlan(const core::Config& config) {
  Plan plan;
  if (ReadPlanKind(config) != PlanKind::kLightField)
    config.Table("plan").Fail("kind", "calibrates a lab, and measures no light field",
                              "give a plan of light fields here");
  const core::Config head = config.Table("plan");
  plan.name = head.Text("name", "unnamed plan");
  plan.geometry.channels = head.Integer("channels", 1, 1, 3);
  if (plan.geometry.channels == 2) head.Fail("channels", "must be 1 (luminance) or 3 (R, G, B)");
  plan.geometry.unit =
      lightfield::FluxUnitFromName(head.Choice("unit", {"W", "lm", "relative"}, "relative"));
  plan.order = head.Choice("order", {"serpentine", "random"}, "serpentine") == "random"
                   ? Order::kRandom
                   : Order::kSerpentine;
  plan.order_seed =
      static_cast<std::uint64_t>(head.Integer("order_seed", 1, 0, std::numeric_limits<int>::max()));
  plan.dark_repeats = head.Integer("dark_repeats", plan.dark_repeats, 1, 1000);
  ReadGeometry(config, plan);
  ReadExposure(config.Table("exposure"), plan.exposure);
  if (const auto reference = config.OptionalTable("reference")) {
    ReferencePolicy& r = plan.reference;
    r.every = reference->Integer("every", r.every, 0, 100000);
    r.max_drift = reference->Number("max_drift", r.max_drift, {1e-6, 10});
    r.resume_share = reference->Number("resume_share", r.resume_share, {0.01, 1});
    r.interval_s = reference->Number("interval_s", r.interval_s, {0.01, 1e4});
    r.max_wait_s = reference->Number("max_wait_s", r.max_wait_s, {0, 1e6});
  }
  plan.warm_up = ReadWarmUp(config);
  if (const auto stage = config.OptionalTable("stage")) plan.stage = hal::ReadStageBounds(*stage);
  config.Finish();
  plan.geometry.Validate(config.file());
  return plan;
}

}  // namespace luxfield::capture
