#include "luxfield/hal/sim/simulated_lab.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "luxfield/core/random.h"
#include "luxfield/hal/sim/followed_stage.h"
#include "luxfield/hal/sim/targets.h"
#include "luxfield/hal/sim/world.h"

namespace luxfield::hal::sim {
namespace {

using Shared = std::shared_ptr<World>;

// Lets simulated time pass for an operation, or runs into its deadline.
void Spend(World& world, double duration_s, double deadline_s, const char* device,
           const char* operation) {
  core::SimulatedClock& clock = *world.clock();
  const double end = clock.MonotonicSeconds() + duration_s;
  if (end > deadline_s) {
    clock.SleepSeconds(deadline_s - clock.MonotonicSeconds());
    throw HardwareError(
        Fault::kTimeout, device, operation,
        fmt::format("would have taken {:.3g} s, longer than its deadline allows", duration_s),
        "allow more time");
  }
  clock.SleepSeconds(duration_s);
}

class SimCamera : public Camera {
 public:
  explicit SimCamera(Shared world) : world_(std::move(world)) {}

  std::string identity() const override { return "simulated camera"; }

  CameraCapabilities capabilities() const override {
    const LabDescription& lab = world_->lab();
    return {lab.camera.sensor.width,   lab.camera.sensor.height,  lab.camera.sensor.bits,
            lab.camera.min_exposure_s, lab.camera.max_exposure_s, lab.camera.exposure_step_s,
            lab.camera.readout_s};
  }

  AppliedSettings Configure(const CameraSettings& settings, double) override {
    const LabDescription& lab = world_->lab();
    double exposure = settings.exposure_s;
    if (!(exposure >= lab.camera.min_exposure_s && exposure <= lab.camera.max_exposure_s))
      throw HardwareError(Fault::kOutOfRange, identity(), "configure",
                          fmt::format("exposure_s = {} is outside [{}, {}]", exposure,
                                      lab.camera.min_exposure_s, lab.camera.max_exposure_s),
                          "choose an exposure the camera has");
    if (lab.camera.exposure_step_s > 0)
      exposure = std::max(1.0, std::round(exposure / lab.camera.exposure_step_s)) *
                 lab.camera.exposure_step_s;
    if (exposure != applied_.exposure_s) applied_ = {exposure, applied_.settings_epoch + 1};
    return applied_;
  }

  Frame Expose(double deadline_s) override {
    if (applied_.settings_epoch == 0)
      throw HardwareError(Fault::kRefused, identity(), "expose", "was never configured",
                          "configure it first");
    const double start = world_->clock()->MonotonicSeconds();
    const double duration = applied_.exposure_s + world_->lab().camera.readout_s;
    if (start + duration > deadline_s)
      Spend(*world_, duration, deadline_s, "simulated camera", "expose");
    Frame frame;
    frame.settings = applied_;
    frame.frame_id = ++frames_;
    frame.image = world_->Expose(applied_.exposure_s, frame.frame_id);
    frame.t_start_s = start;
    frame.t_end_s = start + applied_.exposure_s;
    frame.temperature_c = 25;
    return frame;
  }

  void Abort() override {}

 private:
  Shared world_;
  AppliedSettings applied_;
  std::uint64_t frames_ = 0;
};

class SimStage : public Stage {
 public:
  explicit SimStage(Shared world) : world_(std::move(world)) {}

  std::string identity() const override { return "simulated stage"; }
  StageLimits limits() const override { return world_->lab().stage.options.limits; }

  void Home(double deadline_s) override {
    ThrowIfStopped("home");
    Travel({0, 0}, deadline_s, "home");
    homed_ = true;
  }

  void MoveTo(Vec2 centre, double deadline_s) override {
    const StageLimits& limit = world_->lab().stage.options.limits;
    if (!homed_)
      throw HardwareError(Fault::kNotHomed, identity(), "move",
                          "the stage does not know where it is", "home it first");
    if (!limit.Contain(centre))
      throw HardwareError(Fault::kOutOfRange, identity(), "move",
                          fmt::format("({}, {}) m is outside [{}, {}] x [{}, {}]", centre.x,
                                      centre.y, limit.min.x, limit.max.x, limit.min.y, limit.max.y),
                          "choose a smaller grid or another stage");
    ThrowIfStopped("move");
    Travel(centre, deadline_s, "move");
  }

  StagePosition Where() override {
    return {world_->stage_setpoint(), world_->stage_setpoint(), homed_, false};
  }
  void Stop() override { stop_requested_ = true; }

 private:
  void ThrowIfStopped(const char* operation) {
    if (stop_requested_.exchange(false))
      throw HardwareError(Fault::kStopped, identity(), operation, "stopped on request",
                          "move it again when it is safe");
  }

  void Travel(Vec2 to, double deadline_s, const char* operation) {
    const StageLimits& limit = world_->lab().stage.options.limits;
    const Vec2 way = to - world_->stage_setpoint();
    const double longest = std::max(std::abs(way.x), std::abs(way.y));
    if (longest > 0)
      Spend(*world_, longest / limit.speed_m_per_s + limit.settle_s, deadline_s, "simulated stage",
            operation);
    world_->MoveStage(to);
  }

  Shared world_;
  bool homed_ = false;
  std::atomic<bool> stop_requested_ = false;
};

class SimSelector : public Selector {
 public:
  SimSelector(Shared world, std::string name, std::vector<std::string> positions,
              std::function<void(World&, int)> select)
      : world_(std::move(world)),
        name_(std::move(name)),
        positions_(std::move(positions)),
        select_(std::move(select)) {}

  std::string identity() const override { return name_; }
  std::vector<std::string> positions() const override { return positions_; }
  std::string Current() override { return positions_[at_]; }

  void Select(const std::string& position, double deadline_s) override {
    const auto found = std::find(positions_.begin(), positions_.end(), position);
    if (found == positions_.end())
      throw HardwareError(Fault::kOutOfRange, name_, "select",
                          fmt::format("has no position \"{}\"", position), "choose one it has");
    const auto index = static_cast<std::size_t>(found - positions_.begin());
    if (index != at_) Spend(*world_, kSwitch_s, deadline_s, name_.c_str(), "select");
    at_ = index;
    select_(*world_, static_cast<int>(index));
  }

 private:
  static constexpr double kSwitch_s = 0.2;
  Shared world_;
  std::string name_;
  std::vector<std::string> positions_;
  std::function<void(World&, int)> select_;
  std::size_t at_ = 0;
};

class SimMonitor : public Meter {
 public:
  explicit SimMonitor(Shared world) : world_(std::move(world)) {}
  std::string identity() const override { return "simulated lamp monitor"; }

  Reading Read(double deadline_s) override {
    constexpr double kIntegration_s = 0.02;
    const double factor = world_->LampFactor(), t = world_->clock()->MonotonicSeconds();
    Spend(*world_, kIntegration_s, deadline_s, "simulated lamp monitor", "read");
    core::Random random(world_->lab().seed, kMonitorStream, reads_++);
    return {factor * (1 + world_->lab().monitor_noise * random.Normal()), "relative", false, t};
  }

 private:
  static constexpr std::uint64_t kMonitorStream = 5;
  Shared world_;
  std::uint32_t reads_ = 0;
};

class SimSupply : public Supply {
 public:
  explicit SimSupply(Shared world) : world_(std::move(world)) {}
  std::string identity() const override { return "simulated lamp supply"; }
  SupplyState SetOutput(bool on, double deadline_s) override {
    Spend(*world_, 0.1, deadline_s, "simulated lamp supply", "switch");
    world_->SwitchLamp(on);
    return State();
  }
  SupplyState State() override {
    const bool on = world_->lamp_on();
    return {on ? 12.0 : 0.0, on ? 2.0 : 0.0, on};
  }

 private:
  Shared world_;
};

class SimInputs : public Inputs {
 public:
  std::string identity() const override { return "simulated safety inputs"; }
  InputState State() override { return {}; }
  void OnTrip(Action) override {}  // they never trip
};

rig::RigDescription Describe(const World& world) {
  const LabDescription& lab = world.lab();
  rig::RigDescription rig;
  rig.kind = lab.rig;
  rig.delta_m = lab.stated.delta_m;
  rig.albedo = lab.albedo;
  rig.dual = lab.filter.dual;
  rig.basis = lab.filter.basis;
  rig.spacing_m = lab.filter.spacing_m;
  rig.filter_scale = lab.filter.scale;
  rig.image_from_sensor = lab.stated.image_from_sensor;
  rig.targets = lab.targets;
  rig.pwm_hz = lab.lamp_time.pwm_hz;
  rig.camera = lab.camera.sensor;
  if (lab.camera.hot_pixels_calibrated) rig.camera.defects = world.sensor().hot_pixels();
  if (lab.camera.sensor.corner_loss > 0 && lab.camera.vignetting_calibrated)
    rig.camera.vignetting = world.sensor().Vignetting();
  return rig;
}

}  // namespace

SimulatedLab::SimulatedLab(const core::Config& config, std::optional<std::uint64_t> seed,
                           const StageBounds& plan) {
  LabDescription lab = ReadLab(config, seed);
  config.Finish();
  Tighten(lab.stage.options, plan);
  world_ = std::make_shared<World>(std::move(lab));
}

SimulatedLab::SimulatedLab(const std::filesystem::path& lab_toml, std::optional<std::uint64_t> seed,
                           const StageBounds& plan)
    : SimulatedLab(core::Config::FromFile(lab_toml), seed, plan) {}

Devices SimulatedLab::MakeDevices() const {
  Devices devices;
  devices.clock = world_->clock();
  devices.rig = Describe(*world_);
  devices.lab_files = world_->lab().files;
  devices.camera = std::make_unique<SimCamera>(world_);
  if (const StageOptions& stage = world_->lab().stage.options; stage.port.empty())
    devices.stage = std::make_unique<SimStage>(world_);
  else
    devices.stage = Follow(OpenStage(stage, devices.clock), world_);
  devices.shutter = std::make_unique<SimSelector>(
      world_, "simulated shutter", std::vector<std::string>{"open", "closed"},
      [](World& world, int at) { world.shutter_open = at == 0; });
  if (world_->lab().filter.dual)
    devices.print = std::make_unique<SimSelector>(world_, "simulated print changer",
                                                  std::vector<std::string>{"plus", "minus"},
                                                  [](World& world, int at) { world.print = at; });
  if (world_->lab().channels == 3 && world_->lab().camera.sensor.cfa.empty())
    devices.colour = std::make_unique<SimSelector>(
        world_, "simulated colour wheel", std::vector<std::string>{"R", "G", "B"},
        [](World& world, int at) { world.channel = at; });
  if (auto targets = TargetPositions(world_->lab()); targets.size() > 1)
    devices.target =
        std::make_unique<SimSelector>(world_, "simulated target holder", std::move(targets),
                                      [](World& world, int at) { world.target = at; });
  devices.monitor = std::make_unique<SimMonitor>(world_);
  devices.supply = std::make_unique<SimSupply>(world_);
  devices.inputs = std::make_unique<SimInputs>();
  devices.announce = [world = world_](const VisitPlan& plan) { world->Announce(plan); };
  return devices;
}

}  // namespace luxfield::hal::sim
