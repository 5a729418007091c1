#include "luxfield/hal/lab/device_lab.h"

#include "luxfield/hal/built_drivers.h"

namespace luxfield::hal {
namespace {

std::unique_ptr<Selector> OpenSelector(const gpiod::LineSelectorOptions& options,
                                       const std::shared_ptr<core::Clock>& clock) {
  if constexpr (kHasGpiod)
    return std::make_unique<gpiod::LineSelector>(options, clock);
  else
    return nullptr;  // ReadSelector has refused it
}

std::shared_ptr<Trigger> OpenTrigger(const gpiod::TriggerLineOptions& options,
                                     const std::shared_ptr<core::Clock>& clock) {
  if constexpr (kHasGpiod)
    return std::make_shared<gpiod::TriggerLine>(options, clock);
  else
    return nullptr;  // ReadTrigger has refused it
}

}  // namespace

DeviceLab ReadDeviceLab(const core::Config& config) {
  DeviceLab lab;
  const core::Config head = config.Table("lab");
  head.Text("driver");
  head.Text("name", "");  // for people
  const int channels = head.Integer("channels", 1, 1, 3);
  if (channels == 2) head.Fail("channels", "must be 1 (luminance) or 3 (R, G, B)");
  lab.rig = ReadRig(config);
  if (const auto lamp = config.OptionalTable("lamp"))
    lab.rig.pwm_hz = lamp->Number("pwm_hz", 0, {0, 1e6});
  lab.camera = ReadCamera(config.Table("camera"), lab.rig.kind, channels);
  lab.rig.camera = lab.camera.calibration;
  const core::Config stage = config.Table("stage");
  lab.stage = ReadStage(stage);
  if (lab.stage.port.empty())
    stage.Fail("driver", "is not a real stage's",
               "choose grbl or zaber, or [lab] driver = \"sim\"");
  lab.inputs = ReadInputs(config.Table("inputs"));
  lab.shutter = ReadSelector(config.Table("shutter"), "shutter", {"closed", "open"});
  if (lab.rig.dual)
    lab.print = ReadSelector(config.Table("print"), "print changer", {"plus", "minus"});
  if (channels == 3 && lab.rig.camera.cfa.empty())
    lab.colour = ReadSelector(config.Table("colour"), "colour wheel", {"R", "G", "B"});
  if (lab.camera.driver.needs_trigger) lab.trigger = ReadTrigger(config.Table("trigger"));
  if (const auto supply = config.OptionalTable("supply")) lab.supply = ReadSupply(*supply);
  if (const auto monitor = config.OptionalTable("monitor")) lab.monitor = ReadMonitor(*monitor);
  config.Finish();
  return lab;
}

std::unique_ptr<Inputs> OpenInputs(const DeviceLab& lab) {
  if constexpr (kHasGpiod)
    return std::make_unique<gpiod::SafetyInputs>(lab.inputs);
  else
    return nullptr;  // ReadInputs has refused them
}

Devices OpenDevices(const DeviceLab& lab, const OnRefusal& on_refusal) {
  Devices devices;
  devices.clock = std::make_shared<core::SystemClock>();
  devices.rig = lab.rig;
  const auto& clock = devices.clock;
  const auto open = [&](const char* role, auto&& action) {
    try {
      action();
      return true;
    } catch (const HardwareError& error) {
      if (!on_refusal) throw;
      on_refusal(role, error);
      return false;
    }
  };
  const bool safe = open("inputs", [&] {
    devices.inputs = OpenInputs(lab);
    const InputState state = devices.inputs->State();
    if (!state.safe())
      throw HardwareError(Fault::kStopped, devices.inputs->identity(), "open the lab",
                          Describe(state), "make the lab safe, clear the input, and start again");
  });
  if (!safe) return devices;
  if (lab.supply) open("supply", [&] { devices.supply = OpenSupply(*lab.supply, clock); });
  open("shutter", [&] { devices.shutter = OpenSelector(lab.shutter, clock); });
  if (lab.print) open("print", [&] { devices.print = OpenSelector(*lab.print, clock); });
  if (lab.colour) open("colour", [&] { devices.colour = OpenSelector(*lab.colour, clock); });
  open("stage", [&] { devices.stage = OpenStage(lab.stage, clock); });
  if (lab.monitor) open("monitor", [&] { devices.monitor = OpenMonitor(*lab.monitor, clock); });
  if (lab.trigger) open("trigger", [&] { devices.trigger = OpenTrigger(*lab.trigger, clock); });
  open("camera", [&] {
    devices.camera = lab.camera.driver.open(clock, devices.trigger);
    devices.camera_settings = lab.camera.driver.settings;
    devices.rig.image_from_sensor = ImageFromSensor(lab.camera, devices.camera->capabilities());
  });
  return devices;
}

}  // namespace luxfield::hal
