#include "luxfield/planning/capture_planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "luxfield/capture/plan/write_plan.h"
#include "luxfield/core/error.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/hal/sim/lab_description.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/planning/chain.h"
#include "luxfield/planning/exposure_choice.h"
#include "luxfield/planning/filter_choice.h"
#include "luxfield/planning/lab_variant.h"
#include "luxfield/preprocess/scene_receivers.h"
#include "luxfield/scene/scene.h"
#include "luxfield/session/session_store.h"

namespace luxfield::planning {
namespace {

using preprocess::Receiver;

// Fastest first; each at least a hundredth more accurate than all that are faster.
std::vector<PlannedCapture> ParetoFront(std::vector<PlannedCapture> plans) {
  std::sort(plans.begin(), plans.end(), [](const PlannedCapture& a, const PlannedCapture& b) {
    return a.capture_s != b.capture_s ? a.capture_s < b.capture_s : a.error() < b.error();
  });
  constexpr double kBetter = 0.99;
  std::vector<PlannedCapture> front;
  for (PlannedCapture& plan : plans)
    if (front.empty() || plan.error() < kBetter * front.back().error())
      front.push_back(std::move(plan));
  return front;
}

}  // namespace

double PlannedCapture::error() const { return std::hypot(truncation, noise); }

struct CapturePlanner::State {
  CapturePlannerOptions options;
  hal::sim::LabDescription lab;
  hal::Devices devices;  // their rig description is set to the filters at hand
  PixelNoise noise;
  capture::FrameTimes times;
  FilterField field;
  SampledLamp samples;
  std::vector<Receiver> chosen_by, judged_by;
  std::vector<double> truth, judged_truth;
  double truth_error = 0, samples_error = 0;

  // Filters laid over the lamp, and a plan with them.
  struct Trial {
    FilterJudgement judgement;
    capture::ExpandedPlan expanded;
    ExposedImages exposed;
    capture::StageTravel travel;
  };
  Trial Try(const PlannedFilters& filters, const capture::Plan& plan,
            const std::vector<Receiver>& receivers, const std::vector<double>& irradiance);
  // With the exposures of `expanded`.
  PlannedCapture Outcome(const std::string& family, const Trial& trial,
                         const capture::ExpandedPlan& expanded) const;

  std::vector<PlannedCapture> PlansOf(const std::string& family, const PlannedFilters& filters);
  capture::Plan BasePlan(const PlannedFilters& filters) const;
  double pwm_hz() const { return capture::PwmHz(options.base.exposure, devices.rig); }
};

namespace {

// The part of `at_most` on I through which `lit` lights the receivers; the dimmest of them are left
// out as long as their light's RMS is below a thousandth of the mean.
Rectangle SeenByReceivers(const std::vector<Receiver>& receivers,
                          const std::vector<double>& irradiance, double delta_m,
                          const Rectangle& lit, const Rectangle& at_most) {
  constexpr double kLeftOut = 1e-3;
  std::vector<std::size_t> order(receivers.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return irradiance[a] < irradiance[b]; });
  const auto n = static_cast<double>(receivers.size());
  const double mean = std::accumulate(irradiance.begin(), irradiance.end(), 0.0) / n;
  Rectangle seen{at_most.x1, at_most.x0, at_most.y1, at_most.y0};
  double square = 0;
  for (const std::size_t r : order) {
    square += irradiance[r] * irradiance[r] / n;
    if (square <= kLeftOut * kLeftOut * mean * mean) continue;
    const auto& p = receivers[r].p;
    const double tau = delta_m / p.z;
    for (const double u : {lit.x0, lit.x1}) {
      const double s = tau * p.x + (1 - tau) * u;
      seen.x0 = std::min(seen.x0, s), seen.x1 = std::max(seen.x1, s);
    }
    for (const double v : {lit.y0, lit.y1}) {
      const double t = tau * p.y + (1 - tau) * v;
      seen.y0 = std::min(seen.y0, t), seen.y1 = std::max(seen.y1, t);
    }
  }
  return {std::max(seen.x0, at_most.x0), std::min(seen.x1, at_most.x1),
          std::max(seen.y0, at_most.y0), std::min(seen.y1, at_most.y1)};
}

}  // namespace

CapturePlanner::CapturePlanner(const CapturePlannerOptions& options)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.options = options;
  s.lab = hal::sim::ReadLab(core::Config::FromFile(options.lab), options.seed);
  if (s.lab.channels != 1)
    throw InputError(options.lab.string(), "lab.channels = 3 is not planned for",
                     "plan with the luminance alone: channels = 1");
  s.devices = hal::sim::SimulatedLab(options.lab, options.seed, options.base.stage).MakeDevices();
  const hal::CameraCapabilities camera = s.devices.camera->capabilities();
  s.times = capture::MeasureFrameTimes(s.devices);
  s.noise.camera = s.devices.rig.camera;
  double sensitivity = s.devices.rig.albedo * s.noise.camera.responsivity_e_per_s_per_w_m2[0];
  if (const std::vector<float>& v = s.noise.camera.vignetting; !v.empty())
    sensitivity *= std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
  s.noise.electrons_per_irradiance = sensitivity;
  s.noise.photon_noise = s.lab.camera.sensor.photon_noise;
  s.noise.rounds = camera.bits < 32;
  s.noise.darks = 2 * options.base.dark_repeats;
  const Rectangle sensor =
      SeenBySensor(s.devices.rig.image_from_sensor, camera.width, camera.height);

  const scene::Scene scene = scene::ReadScene(options.scene);
  if (scene.luminaires.empty())
    throw InputError(options.scene.string(), "holds no luminaire", "add a [[luminaire]]");
  for (const auto& lamp : scene.luminaires)
    if (lamp.scale != scene.luminaires[0].scale)
      throw InputError(options.scene.string(),
                       fmt::format("luminaire.scale = {} and {} are not planned for together",
                                   scene.luminaires[0].scale, lamp.scale),
                       "give all luminaires one scale");
  for (const auto& lamp : scene.luminaires)
    if (lamp.colour != scene.luminaires[0].colour)
      throw InputError(options.scene.string(),
                       fmt::format("luminaires '{}' and '{}' differ in colour and are not planned "
                                   "for together",
                                   scene.luminaires[0].name, lamp.name),
                       "give all luminaires one colour");
  const double delta_m = s.devices.rig.delta_m;
  const hal::StageLimits stage = s.devices.stage->limits();
  // Light from beyond the stage's reach is part of the truth too. Twice: the second look is finer.
  const double beyond = 0.25 * std::max(stage.max.x - stage.min.x, stage.max.y - stage.min.y);
  Rectangle lit{stage.min.x - beyond, stage.max.x + beyond, stage.min.y - beyond,
                stage.max.y + beyond};
  for (int look = 0; look < 2; ++look)
    lit = LitRectangle(*s.lab.lamp, delta_m, lit,
                       LatticeOver(sensor, s.lab.camera.pitch_m, options.texels));

  for (const auto& lamp : scene.luminaires) {
    const auto add = [&](std::vector<Receiver>& list, std::uint64_t stream) {
      const auto more =
          preprocess::PictureReceivers(scene, lamp.world_from_luminaire, options.receivers, stream);
      list.insert(list.end(), more.begin(), more.end());
    };
    add(s.chosen_by, 2 * options.seed);
    add(s.judged_by, 2 * options.seed + 1);
  }
  const auto truth = [&](const std::vector<Receiver>& receivers, int nodes) {
    return LampIrradiance(*s.lab.lamp, delta_m, lit, receivers, nodes);
  };
  s.truth = truth(s.chosen_by, options.truth_nodes);
  s.judged_truth = truth(s.judged_by, options.truth_nodes);
  if (!(std::accumulate(s.truth.begin(), s.truth.end(), 0.0) > 0) ||
      !(std::accumulate(s.judged_truth.begin(), s.judged_truth.end(), 0.0) > 0))
    throw InputError(options.scene.string(), "shows nothing that the lab's lamp lights",
                     "turn its camera or its luminaires");
  auto all = s.chosen_by;
  auto light = s.truth;
  all.insert(all.end(), s.judged_by.begin(), s.judged_by.end());
  light.insert(light.end(), s.judged_truth.begin(), s.judged_truth.end());
  const Rectangle seen = SeenByReceivers(all, light, delta_m, lit, sensor);
  if (!(seen.x0 < seen.x1 && seen.y0 < seen.y1))
    throw InputError(options.scene.string(), "sees no light through the lab's image plane",
                     "turn its luminaires to what the camera shows");
  s.samples = SampleLamp(*s.lab.lamp, delta_m, lit, options.cells,
                         LatticeOver(seen, s.lab.camera.pitch_m, options.texels));
  s.field = {lit, stage, sensor, s.lab.camera.pitch_m, s.samples.lattice};
  s.truth_error = RelativeRmse(truth(s.chosen_by, options.truth_nodes * 2 / 3), s.truth).value;
  s.samples_error = RelativeRmse(SampledIrradiance(s.samples, s.chosen_by), s.truth).value;
}

CapturePlanner::~CapturePlanner() = default;

double CapturePlanner::truth_error() const { return state_->truth_error; }
double CapturePlanner::samples_error() const { return state_->samples_error; }

capture::Plan CapturePlanner::State::BasePlan(const PlannedFilters& filters) const {
  capture::Plan plan = options.base;
  plan.rig = devices.rig.kind;
  plan.albedo = devices.rig.albedo;
  plan.dual = filters.dual;
  plan.filter_scale = filters.print_scale();
  plan.geometry.delta_m = devices.rig.delta_m;
  plan.geometry.grid = filters.grid;
  plan.geometry.lattice = filters.lattice;
  plan.geometry.channels = 1;
  return plan;
}

CapturePlanner::State::Trial CapturePlanner::State::Try(const PlannedFilters& filters,
                                                        const capture::Plan& plan,
                                                        const std::vector<Receiver>& receivers,
                                                        const std::vector<double>& irradiance) {
  const auto images = FilterImages(samples, filters);
  auto judgement = Judge(images, filters, samples.delta_m, receivers, irradiance);
  devices.rig.dual = filters.dual;
  devices.rig.basis = filters.grid.basis;
  devices.rig.spacing_m = filters.grid.spacing_m;
  devices.rig.filter_scale = plan.filter_scale;
  auto expanded = capture::ExpandPlan(plan, devices);
  ExposedImages exposed(
      images, filters, judgement, expanded, noise,
      filters.lattice.texel_area_m2() / (lab.camera.pitch_m * lab.camera.pitch_m));
  const auto travel = capture::TravelOf(expanded, devices.stage->limits(), {0, 0});
  return {std::move(judgement), std::move(expanded), std::move(exposed), travel};
}

PlannedCapture CapturePlanner::State::Outcome(const std::string& family, const Trial& trial,
                                              const capture::ExpandedPlan& expanded) const {
  const auto time =
      capture::PredictCapture(expanded, trial.exposed.rates(), trial.exposed.reference_rate(),
                              devices.rig.camera, times, trial.travel);
  const double spread =
      trial.exposed.Noise(expanded.ladder_s, time.brackets, expanded.plan.exposure.repeats);
  return {family,
          expanded.plan,
          time.frames,
          time.duration_s,
          trial.judgement.truncation.value,
          trial.judgement.truncation.standard_error,
          spread};
}

std::vector<PlannedCapture> CapturePlanner::State::PlansOf(const std::string& family,
                                                           const PlannedFilters& filters) {
  const hal::CameraCapabilities camera = devices.camera->capabilities();
  const double period_s = pwm_hz() > 0 ? 1 / pwm_hz() : 0;
  capture::Plan plan = BasePlan(filters);
  plan.exposure.min_s = plan.exposure.max_s = std::max(camera.min_exposure_s, period_s);
  const Trial trial = Try(filters, plan, chosen_by, truth);

  // A pixel may be brighter than its texel's middle.
  constexpr double kHeadroom = 0.7;
  const rig::SensorModel& calibration = devices.rig.camera;
  const double room_s =
      (plan.exposure.saturation_share * calibration.saturation_dn - calibration.black_dn) /
      trial.exposed.largest_rate();
  const auto choices = ExposureChoices(kHeadroom * room_s, plan.exposure.ratio, camera, period_s);
  std::vector<PlannedCapture> plans(choices.size());
  core::ParallelFor(choices.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      capture::ExpandedPlan e = trial.expanded;
      capture::ExposurePolicy& exposure = e.plan.exposure;
      exposure.min_s = choices[k].min_s;
      exposure.max_s = choices[k].max_s;
      exposure.relevant_share = choices[k].relevant_share;
      exposure.repeats = choices[k].repeats;
      e.ladder_s = capture::MakeLadder(exposure.min_s, exposure.max_s, exposure.ratio, pwm_hz(),
                                       camera, plan.name);
      plans[k] = Outcome(family, trial, e);
    }
  });
  std::erase_if(plans, [](const PlannedCapture& p) { return !std::isfinite(p.noise); });
  return ParetoFront(std::move(plans));
}

PlannedCapture CapturePlanner::Confirmed(const PlannedCapture& plan) const {
  const auto& geometry = plan.plan.geometry;
  const auto trial = state_->Try({plan.plan.dual, geometry.grid, geometry.lattice}, plan.plan,
                                 state_->judged_by, state_->judged_truth);
  PlannedCapture confirmed = state_->Outcome(plan.family, trial, trial.expanded);
  confirmed.confirmed = true;
  return confirmed;
}

std::vector<PlannedCapture> CapturePlanner::Plans() const {
  constexpr int kCells[] = {1, 2, 3, 4, 6, 8, 9, 12, 18};  // whole numbers of 72 samples
  const auto families = FilterFamilies();
  std::uint64_t total = 0;
  for (const FilterFamily& family : families)
    total += std::size(kCells) * static_cast<std::uint64_t>(family.basis.cells);
  core::Progress progress("plan", total);
  std::vector<PlannedCapture> all;
  for (const FilterFamily& family : families) {
    std::vector<PlannedCapture> of_family;
    for (const int cells : kCells)
      for (int fewer = 0; fewer < family.basis.cells; ++fewer) {
        core::ThrowIfInterrupted();
        if (const auto filters = Lay(family, cells, fewer, state_->field)) {
          auto plans = state_->PlansOf(family.name, *filters);
          std::move(plans.begin(), plans.end(), std::back_inserter(of_family));
        }
        progress.Advance(1, family.name);
      }
    auto front = ParetoFront(std::move(of_family));
    std::move(front.begin(), front.end(), std::back_inserter(all));
  }
  if (all.empty())
    throw InputError(state_->options.lab.string(),
                     "has no exposure short enough and no filter position within reach",
                     "give the camera a shorter exposure, or the stage more room");
  return all;
}

void CapturePlanner::WritePlanAndLab(const PlannedCapture& plan,
                                     const std::filesystem::path& plan_toml,
                                     const std::filesystem::path& lab_toml) const {
  const auto& p = plan.plan;
  capture::WritePlan(plan_toml, p);
  WriteLabWithFilter(state_->options.lab,
                     {p.dual, p.geometry.grid.basis, p.geometry.grid.spacing_m, p.filter_scale},
                     lab_toml);
}

SimulatedCapture CapturePlanner::Simulate(
    const PlannedCapture& plan, const std::filesystem::path& folder, std::uint64_t seed,
    const std::optional<std::vector<std::string>>& sources) const {
  const core::Stopwatch watch;
  const core::WritesAtOnce scratch;
  std::filesystem::create_directories(folder);
  ChainOptions chain;
  chain.lab = folder / "lab.toml";
  chain.plan = folder / "plan.toml";
  chain.folder = folder;
  chain.seed = seed;
  std::filesystem::remove_all(folder / "session");
  WritePlanAndLab(plan, chain.plan, chain.lab);
  if (sources) WriteLabVariant(chain.lab, *sources, false, chain.lab);
  const ChainResult result = RunChain(chain);

  SimulatedCapture capture;
  std::vector<double> found(state_->judged_by.size());
  core::ParallelFor(found.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      found[k] = lightfield::ExactIrradiance(result.reconstruction.coefficients,
                                             state_->judged_by[k].p, state_->judged_by[k].n)[0];
  });
  capture.error = RelativeRmse(found, state_->judged_truth);
  const session::SessionReader session(folder / "session");
  double start = 0, end = 0;
  for (const auto& frame : session.frames()) {
    if (end == 0) start = frame.t_start_s;
    end = frame.t_start_s + frame.exposure_s;
  }
  capture.rig_s = end - start;
  capture.flagged = result.capture.flagged;
  capture.rejected = result.capture.rejected;
  capture.bench_s = watch.WallSeconds();
  return capture;
}

const PlannedCapture* Fastest(const std::vector<PlannedCapture>& plans, double max_rel_error) {
  const PlannedCapture* best = nullptr;
  for (const PlannedCapture& plan : plans)
    if (plan.error() <= max_rel_error && (!best || plan.capture_s < best->capture_s)) best = &plan;
  return best;
}

const PlannedCapture* FastestConfirmed(const CapturePlanner& planner, double max_rel_error,
                                       std::vector<PlannedCapture>* plans) {
  for (;;) {
    const PlannedCapture* found = Fastest(*plans, max_rel_error);
    if (!found || found->confirmed) return found;
    (*plans)[static_cast<std::size_t>(found - plans->data())] = planner.Confirmed(*found);
  }
}

const PlannedCapture& MostAccurate(const std::vector<PlannedCapture>& plans) {
  return *std::min_element(
      plans.begin(), plans.end(),
      [](const PlannedCapture& a, const PlannedCapture& b) { return a.error() < b.error(); });
}

}  // namespace luxfield::planning
