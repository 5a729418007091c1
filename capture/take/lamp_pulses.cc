#include "luxfield/capture/take/lamp_pulses.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "luxfield/capture/plan/bracket_rungs.h"
#include "luxfield/capture/take/preflight.h"
#include "luxfield/capture/take/probe_rate.h"
#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/random.h"

namespace luxfield::capture {
namespace {

using core::Json;
using session::FrameKind;
using session::FrameRecord;

constexpr double kSigmas = 5;  // a measured and a stated frequency agree within so many

// Pixels that count in a frame's mean.
double UsableCount(const FrameTaker& taker) {
  std::size_t pixels = 0;
  for (const PixelRun& run : taker.usable()) pixels += run.end - run.begin;
  return static_cast<double>(pixels);
}

// Exposures T / rho and T / rho^2 with rho^3 = rho + 1: of no frequency are both close to whole
// periods for long (1, rho and rho^2 are badly approximable together). T is that of the references
// where pulses of 40 Hz and of 25 kHz both show: within 8 and 40 ms. No more than four times too
// much light.
std::array<double, 2> BurstExposures(double reference_s, const hal::CameraCapabilities& camera) {
  constexpr double kRho = 1.324717957244746, kShortest_s = 8e-3, kLongest_s = 40e-3, kBrighter = 4;
  const double t_s =
      std::clamp(reference_s, std::min(kShortest_s, kBrighter * reference_s), kLongest_s);
  std::array exposures_s{t_s / kRho, t_s / (kRho * kRho)};
  for (double& exposure_s : exposures_s)
    exposure_s = std::clamp(exposure_s, camera.min_exposure_s, camera.max_exposure_s);
  return exposures_s;
}

// Starts that do not repeat: waits spread evenly over a period of the slowest pulses.
LevelBurst TakeBurst(FrameTaker& taker, const FrameRecord& place, double exposure_s,
                     double black_dn, std::uint64_t stream) {
  constexpr int kFrames = 48;
  core::Random random(1, stream);
  LevelBurst burst;
  taker.ConfigureExposure(exposure_s);
  for (int n = 0; n < kFrames; ++n) {
    taker.Rest(random.Uniform() / kLowestPulse_hz);
    const Shot shot = taker.Shoot(place);
    burst.start_s.push_back(shot.frame.t_start_s);
    burst.level.push_back(shot.statistics.mean_dn - black_dn);
  }
  return burst;
}

bool Agree(const LampFrequency& measured, double stated_hz, double allowed) {
  const double multiple = std::max(1.0, std::round(measured.hz / stated_hz));
  return std::abs(measured.hz - multiple * stated_hz) <=
         kSigmas * measured.sigma_hz + allowed * measured.hz;
}

std::string ScatterText(const LampPulses& p, double allowed) {
  return fmt::format(
      "frames of {:.6g} s differ by {:.2g} %, noise explains {:.2g} %, the plan allows {:.2g} %",
      p.exposure_s, 100 * p.scatter.rms, 100 * p.scatter.noise, 100 * allowed);
}

// What a lamp that pulses calls for, besides direct current.
std::string PulseRemedy(const LampPulses& p, double stated_hz, bool measured_before) {
  if (stated_hz > 0)
    return p.frequency && p.frequency->hz > 0
               ? "its exposures are whole periods, so something else pulses too, or the shutter "
                 "jitters"
               : fmt::format("correct pwm_hz = {}, which is not its frequency", stated_hz);
  if (measured_before) return "it was steady before the session began";
  if (!p.frequency) return "the camera's shutter speeds cannot be whole periods";
  if (p.frequency->hz > 0)
    return fmt::format("it pulses at {}: state it as exposure.pwm_hz, or \"measure\"",
                       FormatHertz(p.frequency->hz, p.frequency->sigma_hz));
  return fmt::format("its frequency cannot be told ({}): state it as exposure.pwm_hz",
                     p.frequency->why);
}

double MeasuredPwmHz(const Plan& plan, hal::Devices& devices, const std::filesystem::path& folder,
                     const CaptureOptions& options) {
  const ExpandedPlan expanded = ExpandPlan(plan, devices);
  CheckDiskAndSafety(DryRun(expanded, devices).bytes, devices, folder);
  const hal::Vec2 centre =
      plan.reference.every > 0 ? expanded.reference : expanded.positions.front().centre;
  if (devices.announce) {
    hal::VisitPlan visits;
    visits.filter_centres.push_back(centre);
    devices.announce(visits);
  }
  CaptureSummary summary;
  FrameTaker taker(devices, nullptr, expanded.ladder_s, plan.exposure.max_attempts, options,
                   summary);
  taker.Home();
  taker.WarmUpLamp(plan.warm_up);
  FaceLamp(taker, centre);
  FrameRecord place;
  place.kind = FrameKind::kReference;
  const rig::SensorModel& calibration = devices.rig.camera;
  place.exposure_index = ChooseRungs(ProbeRate(taker, place, expanded, calibration),
                                     expanded.ladder_s, plan.exposure, calibration)
                             .first;
  const double allowed = plan.exposure.flicker;
  const LampPulses pulses = LookForPulses(taker, devices, place, allowed, true);
  if (pulses.frequency->hz > 0) return pulses.frequency->hz;
  if (std::max(pulses.scatter.rms, pulses.most_rms) <= allowed) return 0;
  throw DeviceError(fmt::format(
      "the lamp pulses: {}, by up to {:.2g} % at other phases; its frequency cannot be told ({}): "
      "state it as exposure.pwm_hz, drive it with direct current, or raise exposure.flicker",
      ScatterText(pulses, allowed), 100 * pulses.most_rms, pulses.frequency->why));
}

}  // namespace

void FaceLamp(FrameTaker& taker, hal::Vec2 centre) {
  taker.SelectShutter("open");
  taker.MoveTo(centre);
  taker.SelectPrint(0);
  taker.SelectChannel(0);
}

LampPulses LookForPulses(FrameTaker& taker, hal::Devices& devices, const FrameRecord& place,
                         double allowed, bool measure) {
  constexpr int kFrames = 24;
  const rig::SensorModel& calibration = devices.rig.camera;
  const double pixels = UsableCount(taker);
  LampPulses pulses;
  taker.Configure(place.exposure_index);
  pulses.exposure_s = taker.exposure_s();
  pulses.frames = kFrames;
  std::vector<double> level_dn;
  for (int n = 0; n < kFrames; ++n) {
    taker.Rest(FlickerWait(n));
    level_dn.push_back(taker.Shoot(place).statistics.mean_dn);
  }
  pulses.scatter = ScatterOf(level_dn, pixels, calibration);
  if (!pulses.scatter.light)
    throw DeviceError(fmt::format(
        "{}: sees no light at the filter's first place, the lamp on and the shutter open; take the "
        "lens cap off, look at lamp and shutter, or plan longer exposures",
        devices.camera->identity()));
  const hal::CameraCapabilities camera = devices.camera->capabilities();
  const bool scatters = pulses.scatter.present && pulses.scatter.rms > allowed;
  if (!camera.exposures_s.empty() || !(measure || scatters)) return pulses;
  std::vector<LevelBurst> bursts;
  for (const double exposure_s : BurstExposures(pulses.exposure_s, camera)) {
    const LevelBurst& burst = bursts.emplace_back(
        TakeBurst(taker, place, exposure_s, calibration.black_dn, bursts.size()));
    level_dn.clear();
    for (const double level : burst.level) level_dn.push_back(level + calibration.black_dn);
    const Scatter scatter = ScatterOf(level_dn, pixels, calibration);
    if (scatter.present)
      pulses.most_rms = std::max(
          pulses.most_rms, scatter.rms * std::min(1.0, taker.exposure_s() / pulses.exposure_s));
  }
  pulses.frequency = FrequencyOf(bursts);
  return pulses;
}

Json ToJson(const LampPulses& p, double stated_hz) {
  Json json = {{"exposure_s", p.exposure_s},
               {"frames", p.frames},
               {"scatter", p.scatter.rms},
               {"noise", p.scatter.noise},
               {"stated_hz", stated_hz}};
  if (!p.frequency) return json;
  json["hz"] = p.frequency->hz;
  if (p.frequency->hz > 0)
    json["sigma_hz"] = p.frequency->sigma_hz;
  else
    json["why"] = p.frequency->why;
  return json;
}

void RequireSteadyFrames(const LampPulses& p, double stated_hz, const ExposurePolicy& exposure) {
  const bool told = p.frequency && p.frequency->hz > 0;
  if (told && stated_hz > 0 && !Agree(*p.frequency, stated_hz, exposure.flicker))
    throw DeviceError(
        exposure.measure_pwm
            ? fmt::format(
                  "the lamp pulses at {}, and at {} Hz when this session was planned: its "
                  "frequency wanders; drive it with direct current, or capture into another "
                  "folder",
                  FormatHertz(p.frequency->hz, p.frequency->sigma_hz), stated_hz)
            : fmt::format(
                  "pwm_hz = {}, but the lamp pulses at {}; correct pwm_hz, and capture into "
                  "another folder",
                  stated_hz, FormatHertz(p.frequency->hz, p.frequency->sigma_hz)));
  if (!p.scatter.present || p.scatter.rms <= exposure.flicker) return;
  throw DeviceError(fmt::format(
      "the lamp flickers: {}; {}; or drive it with direct current, or raise exposure.flicker, and "
      "capture into another folder",
      ScatterText(p, exposure.flicker), PulseRemedy(p, stated_hz, exposure.measure_pwm)));
}

Plan WithPwmHz(const Plan& plan, hal::Devices& devices, const std::filesystem::path& folder,
               const CaptureOptions& options) {
  Plan definite = plan;
  if (!session::SessionWriter::HasSession(folder)) {
    definite.exposure.pwm_hz = MeasuredPwmHz(plan, devices, folder, options);
  } else if (options.resume) {
    const auto file = folder / "plan.json";
    const Json recorded = core::ReadJson(file);
    const Json exposure = core::Field<Json>(recorded, "exposure", file.string());
    if (exposure.contains("pwm_hz"))
      definite.exposure.pwm_hz = core::Field<double>(exposure, "pwm_hz", file.string());
  }
  return definite;  // a folder with another session is refused when it is opened
}

}  // namespace luxfield::capture
