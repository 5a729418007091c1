// luxfield devices: what luxfield can drive and compute on.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "cli/program.h"
#include "core/config.h"
#include "core/error.h"
#include "hal/devices.h"
#include "hal/identify_port.h"
#include "hal/safety_guard.h"
#include "hal/stage_options.h"
#include "hal/transport/open_port.h"
#include "render/device.h"

namespace luxfield::cli {
namespace {

constexpr double kHome_s = 600, kMove_s = 600;  // deadlines of a test

struct Options {
  std::string lab;
  std::string port;
  int baud = 115200;
  // test
  std::string device, test_lab;
  std::string reach = "5mm";
};

// What a port answers to each driver.
core::Json PrintIdentification(const std::string& port, int baud) {
  core::Json json;
  fmt::print("port {}\n", port);
  for (const auto& answer : hal::IdentifyPort(port, baud)) {
    fmt::print("  {:<12} {}{}\n", answer.driver,
               answer.takes ? "takes it: " : "refuses it: ", answer.what);
    json.push_back({{"driver", answer.driver}, {"takes", answer.takes}, {"what", answer.what}});
  }
  return json;
}

void PrintStage(hal::Stage& stage) {
  const hal::StageLimits limits = stage.limits();
  fmt::print("  stage        {}: ({:.4g}, {:.4g}) to ({:.4g}, {:.4g}) m, {:.3g} m/s",
             stage.identity(), limits.min.x, limits.min.y, limits.max.x, limits.max.y,
             limits.speed_m_per_s);
  if (limits.resolution_m > 0) fmt::print(", steps of {:.3g} um", 1e6 * limits.resolution_m);
  fmt::print(", {}\n", stage.Where().homed ? "homed" : "not homed");
}

core::Json PrintLab(const std::string& lab) {
  core::Json json;
  // A port is asked before its driver takes it, so that a driver that fails has its reason.
  const core::Config config = core::Config::FromFile(lab);
  if (const auto stage = hal::ReadStage(config.Table("stage")); !stage.port.empty())
    json["ports"][stage.port] = PrintIdentification(stage.port, stage.baud);
  const hal::Devices devices = hal::MakeDevices(lab);
  const auto& camera = *devices.camera;
  const auto capabilities = camera.capabilities();
  fmt::print("devices of {}\n", lab);
  fmt::print("  camera       {}: {} x {}, {} bit, exposures {:.3g} to {:.3g} s\n",
             camera.identity(), capabilities.width, capabilities.height, capabilities.bits,
             capabilities.min_exposure_s, capabilities.max_exposure_s);
  PrintStage(*devices.stage);
  const auto print = [](const char* role, const auto& device) {
    if (device) fmt::print("  {:<12} {}\n", role, device->identity());
  };
  print("shutter", devices.shutter);
  print("print", devices.print);
  print("colour", devices.colour);
  print("monitor", devices.monitor);
  print("supply", devices.supply);
  print("inputs", devices.inputs);
  fmt::print("  rig          {}, delta {:.6g} m\n", hal::RigKindName(devices.rig.kind),
             devices.rig.delta_m);
  json["camera"] = camera.identity();
  json["stage"] = devices.stage->identity();
  return json;
}

core::Json Run(const Options& options) {
  core::Json json;
  fmt::print("drivers built in\n");
  for (const auto& driver : hal::Drivers()) {
    fmt::print("  {:<12} {}\n", driver.name, driver.what);
    json["drivers"].push_back(driver.name);
  }
  fmt::print("serial ports attached (--port asks one who it is)\n");
  const auto ports = hal::AttachedSerialPorts();
  for (const std::string& port : ports) fmt::print("  {}\n", port);
  if (ports.empty()) fmt::print("  none\n");
  json["serial_ports"] = ports;
  if (!options.port.empty())
    json["ports"][options.port] = PrintIdentification(options.port, options.baud);
  if (!options.lab.empty()) json.update(PrintLab(options.lab), true);
  fmt::print("OpenCL devices (--device takes the number or a part of the name)\n");
  for (const auto& device : render::ListDevices()) {
    fmt::print("  {}: {} ({}), {} compute units, {}\n", device.index, device.name, device.version,
               device.compute_units, FormatBytes(double(device.global_memory_bytes)));
    json["opencl"].push_back(device.name);
  }
  return json;
}

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
  camera.Configure({capabilities.min_exposure_s}, clock.MonotonicSeconds() + 10);
  const hal::Frame frame =
      camera.Expose(clock.MonotonicSeconds() + 10 + capabilities.min_exposure_s);
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

core::Json Test(const Options& options) {
  const double reach_m =
      ParseQuantity(options.reach, "--reach", {{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}});
  if (options.device != "stage" && options.device != "camera")
    throw InputError(
        fmt::format("there is no test of \"{}\"; test stage or camera", options.device));
  hal::Devices devices = hal::MakeDevices(options.test_lab);
  return options.device == "stage" ? TestStage(devices, reach_m) : TestCamera(devices);
}

}  // namespace

void AddDevices(Program& program) {
  auto options = std::make_shared<Options>();
  auto test = std::make_shared<CLI::App*>(nullptr);
  CLI::App& verb = program.AddVerb(
      "devices", "List drivers, ports, a lab's devices and OpenCL devices; test a device",
      [options, test] { return (*test)->parsed() ? Test(*options) : Run(*options); });
  verb.add_option("LAB", options->lab, "A lab.toml: open its devices and show their capabilities");
  verb.add_option(
      "--port", options->port,
      "Ask a serial port (or tcp:HOST:PORT) which driver is its device's; nothing moves");
  verb.add_option("--baud", options->baud, "Rate of --port");
  *test = verb.add_subcommand("test", "Move the stage, or expose with the camera, within bounds");
  (*test)->fallthrough();
  (*test)->option_defaults()->always_capture_default();
  (*test)->add_option("NAME", options->device, "stage or camera")->required();
  (*test)->add_option("LAB", options->test_lab, "Its lab.toml")->required();
  (*test)->add_option(
      "--reach", options->reach,
      "How far from the middle of its limits the stage may go, in mm, cm or m; homing "
      "goes to the reference marks first");
}

}  // namespace luxfield::cli
