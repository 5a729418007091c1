#include "luxfield/cli/device_tests.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/config.h"
#include "luxfield/core/error.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/lab/device_lab.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/hal/safety/safety_guard.h"

namespace luxfield::cli {
namespace {

constexpr double kHome_s = 600, kMove_s = 600, kSelect_s = 30, kAnswer_s = 10;  // deadlines
constexpr double kLampOn_s = 2;
constexpr int kReadings = 5;

// Homes, then visits the corners of a square about the middle of the limits.
core::Json TestStage(hal::Devices& devices, double reach_m) {
  hal::SafetyGuard guard(devices);
  hal::Stage& stage = *devices.stage;
  core::Clock& clock = *devices.clock;
  const hal::StageLimits limits = stage.limits();
  const hal::Vec2 middle = 0.5 * (limits.min + limits.max);
  const double reach = std::min({reach_m, limits.max.x - middle.x, limits.max.y - middle.y});
  fmt::print("{}: homes at its reference marks, then stays within {:.4g} m of ({:.4g}, {:.4g}) m\n",
             stage.identity(), reach, middle.x, middle.y);
  guard.ThrowIfUnsafe();
  stage.Home(clock.MonotonicSeconds() + kHome_s);
  fmt::print("{:>20} {:>20} {:>10} {:>8}\n", "target (m)", "read back (m)", "off by", "seconds");
  core::Json rows;
  for (const auto& [u, v] : {std::pair{0, 0}, {-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {0, 0}}) {
    const hal::Vec2 target = middle + reach * hal::Vec2{double(u), double(v)};
    guard.ThrowIfUnsafe();
    const double start = clock.MonotonicSeconds();
    stage.MoveTo(target, start + kMove_s);
    const double seconds = clock.MonotonicSeconds() - start;
    const hal::Vec2 at = stage.Where().readback;
    const double off_m = std::hypot(at.x - target.x, at.y - target.y);
    fmt::print("({:8.5f}, {:8.5f}) ({:8.5f}, {:8.5f}) {:7.2f} um {:8.2f}\n", target.x, target.y,
               at.x, at.y, 1e6 * off_m, seconds);
    rows.push_back({{"u_m", target.x}, {"v_m", target.y}, {"off_m", off_m}, {"move_s", seconds}});
  }
  return {{"stage", stage.identity()}, {"reach_m", reach}, {"rows", rows}};
}

// One exposure, the shortest there is; lamp and shutter stay as they are.
core::Json TestCamera(hal::Devices& devices) {
  hal::Camera& camera = *devices.camera;
  core::Clock& clock = *devices.clock;
  const auto capabilities = camera.capabilities();
  camera.Configure({capabilities.min_exposure_s}, clock.MonotonicSeconds() + kAnswer_s);
  const hal::Frame frame =
      camera.Expose(clock.MonotonicSeconds() + kAnswer_s + capabilities.min_exposure_s);
  double sum = 0, most = 0;
  for (std::size_t k = 0; k < frame.image.size(); ++k) {
    sum += frame.image.at(k);
    most = std::max(most, double(frame.image.at(k)));
  }
  const double mean = sum / double(frame.image.size());
  fmt::print("{}: frame {} of {} s: mean {:.1f} DN, brightest {:.1f} DN\n", camera.identity(),
             frame.frame_id, frame.settings.exposure_s, mean, most);
  return {{"camera", camera.identity()},
          {"exposure_s", frame.settings.exposure_s},
          {"mean_dn", mean},
          {"brightest_dn", most}};
}

// A few pulses, far enough apart to be seen. The lab's camera exposes to each; nobody takes the
// frames.
core::Json TestTrigger(hal::Devices& devices) {
  constexpr int kPulses = 5;
  constexpr double kApart_s = 0.5;
  hal::SafetyGuard guard(devices);
  hal::Trigger& trigger = *devices.trigger;
  core::Clock& clock = *devices.clock;
  fmt::print("{}: {} pulses, {} s apart\n", trigger.identity(), kPulses, kApart_s);
  for (int k = 0; k < kPulses; ++k) {
    if (k > 0) clock.SleepSeconds(kApart_s);
    guard.ThrowIfUnsafe();
    trigger.Pulse(clock.MonotonicSeconds() + kAnswer_s);
  }
  return {{"trigger", trigger.identity()}, {"pulses", kPulses}};
}

// Every position once, then back to the first.
core::Json TestSelector(hal::Devices& devices, hal::Selector& selector) {
  hal::SafetyGuard guard(devices);
  core::Clock& clock = *devices.clock;
  auto positions = selector.positions();
  positions.push_back(positions.front());
  fmt::print("{}: goes to each of its positions\n", selector.identity());
  core::Json rows;
  for (const std::string& position : positions) {
    guard.ThrowIfUnsafe();
    const double start = clock.MonotonicSeconds();
    selector.Select(position, start + kSelect_s);
    const double seconds = clock.MonotonicSeconds() - start;
    fmt::print("  {:<12} reads back {:<12} {:6.2f} s\n", position, selector.Current(), seconds);
    rows.push_back(
        {{"position", position}, {"read_back", selector.Current()}, {"select_s", seconds}});
  }
  return {{"selector", selector.identity()}, {"rows", rows}};
}

// The lamp, on for two seconds at the lab's settings, then off, whatever happens between.
core::Json TestSupply(hal::Devices& devices) {
  hal::SafetyGuard guard(devices);
  hal::Supply& supply = *devices.supply;
  core::Clock& clock = *devices.clock;
  const auto soon = [&clock] { return clock.MonotonicSeconds() + kAnswer_s; };
  fmt::print("{}: on for {} s, then off\n", supply.identity(), kLampOn_s);
  const auto print = [](const char* when, const hal::SupplyState& state) {
    fmt::print("  {:<12} output {}, {:.4g} V, {:.4g} A\n", when, state.output ? "on" : "off",
               state.voltage_v, state.current_a);
  };
  hal::SupplyState lit;
  const double start = clock.MonotonicSeconds();
  try {
    print("switched on", guard.SwitchLampOn(soon()));
    clock.SleepSeconds(kLampOn_s);
    lit = supply.State();
    print("at the end", lit);
    guard.ThrowIfUnsafe();
  } catch (const hal::HardwareError&) {
    supply.SetOutput(false, soon());
    throw;
  }
  const hal::SupplyState off = supply.SetOutput(false, soon());
  const double on_s = clock.MonotonicSeconds() - start;
  print("switched off", off);
  return {{"supply", supply.identity()},
          {"on_s", on_s},
          {"voltage_v", lit.voltage_v},
          {"current_a", lit.current_a},
          {"off", !off.output}};
}

core::Json TestMonitor(hal::Devices& devices) {
  hal::Meter& monitor = *devices.monitor;
  core::Clock& clock = *devices.clock;
  fmt::print("{}: {} readings; the lamp stays as it is\n", monitor.identity(), kReadings);
  core::Json readings;
  for (int k = 0; k < kReadings; ++k) {
    const double start = clock.MonotonicSeconds();
    const hal::Reading reading = monitor.Read(start + kAnswer_s);
    fmt::print("  {:.6g} {}{}, {:.3f} s\n", reading.value, reading.unit,
               reading.over_range ? " (over range)" : "", clock.MonotonicSeconds() - start);
    readings.push_back(reading.value);
  }
  return {{"monitor", monitor.identity()}, {"readings", readings}};
}

// As they are now. Of a lab of real devices nothing else is opened, so that contacts can be tested
// one by one.
core::Json TestInputs(const std::string& lab_toml) {
  const core::Config config = core::Config::FromFile(lab_toml);
  hal::Devices devices;
  if (config.Table("lab").Text("driver") == "devices")
    devices.inputs = hal::OpenInputs(hal::ReadDeviceLab(config));
  else
    devices = hal::MakeDevices(lab_toml);
  const hal::InputState state = devices.inputs->State();
  fmt::print("{}: {}\n", devices.inputs->identity(),
             state.safe() ? std::string("safe") : hal::Describe(state));
  return {{"inputs", devices.inputs->identity()},
          {"emergency_stop", state.emergency_stop},
          {"door_open", state.door_open},
          {"limit", state.limit},
          {"unreadable", state.unreadable}};
}

}  // namespace

const std::vector<std::string>& TestableDevices() {
  static const std::vector<std::string> names = {"stage",  "camera",  "shutter", "print", "colour",
                                                 "supply", "monitor", "trigger", "inputs"};
  return names;
}

core::Json TestDevice(const std::string& name, const std::string& lab_toml, double reach_m) {
  if (std::find(TestableDevices().begin(), TestableDevices().end(), name) ==
      TestableDevices().end())
    throw InputError(fmt::format("there is no test of \"{}\"; test one of {}", name,
                                 fmt::join(TestableDevices(), ", ")));
  if (name == "inputs") return TestInputs(lab_toml);
  hal::Devices devices = hal::MakeDevices(lab_toml);
  const auto has = [&](const auto& device) -> auto& {
    if (!device) throw InputError(lab_toml, fmt::format("has no {}", name), "test another device");
    return *device;
  };
  if (name == "stage") return TestStage(devices, reach_m);
  if (name == "camera") return TestCamera(devices);
  if (name == "shutter") return TestSelector(devices, has(devices.shutter));
  if (name == "print") return TestSelector(devices, has(devices.print));
  if (name == "colour") return TestSelector(devices, has(devices.colour));
  if (name == "monitor") {
    has(devices.monitor);
    return TestMonitor(devices);
  }
  if (name == "trigger") {
    has(devices.trigger);
    return TestTrigger(devices);
  }
  has(devices.supply);
  return TestSupply(devices);
}

}  // namespace luxfield::cli
