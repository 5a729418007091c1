// luxfield devices: what luxfield can drive and compute on.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <utility>

#include "luxfield/cli/device_tests.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/core/config.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/lab/attached.h"
#include "luxfield/hal/lab/device_lab.h"
#include "luxfield/hal/lab/identify_port.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/hal/options/stage_options.h"
#include "luxfield/hal/transport/open_port.h"
#include "luxfield/render/device/device.h"

namespace luxfield::cli {
namespace {

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

// "NAME: WORD, WORD, ..." under a device, in lines of at most 80 columns.
void PrintDetail(const std::string& name, const std::vector<std::string>& words) {
  constexpr std::size_t kIndent = 17, kColumns = 80;
  std::string line = std::string(kIndent, ' ') + name + ":";
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string word = words[k] + (k + 1 < words.size() ? "," : "");
    if (line.size() + 1 + word.size() > kColumns) {
      fmt::print("{}\n", line);
      line = std::string(kIndent + 1, ' ');
    }
    line += " " + word;
  }
  fmt::print("{}\n", line);
}

core::Json PrintCamera(const hal::Camera& camera) {
  const hal::CameraCapabilities can = camera.capabilities();
  fmt::print("  camera       {}: {} x {}, {} bit, exposures {:.3g} to {:.3g} s\n",
             camera.identity(), can.width, can.height, can.bits, can.min_exposure_s,
             can.max_exposure_s);
  core::Json json = {{"identity", camera.identity()},
                     {"width_px", can.width},
                     {"height_px", can.height},
                     {"bits", can.bits},
                     {"min_exposure_s", can.min_exposure_s},
                     {"max_exposure_s", can.max_exposure_s}};
  if (const std::string firmware = camera.firmware(); !firmware.empty()) {
    PrintDetail("firmware", {firmware});
    json["firmware"] = firmware;
  }
  if (can.exposure_step_s > 0) {
    PrintDetail("exposure_step_s", {fmt::format("{:.6g}", can.exposure_step_s)});
    json["exposure_step_s"] = can.exposure_step_s;
  }
  if (!can.exposures_s.empty()) {
    std::vector<std::string> words;
    for (const double exposure_s : can.exposures_s)
      words.push_back(fmt::format("{:.6g}", exposure_s));
    PrintDetail("exposures_s", words);
    json["exposures_s"] = can.exposures_s;
  }
  if (can.max_gain_db > can.min_gain_db) {
    PrintDetail("gain_db", {fmt::format("{:.6g} to {:.6g}", can.min_gain_db, can.max_gain_db)});
    json["min_gain_db"] = can.min_gain_db;
    json["max_gain_db"] = can.max_gain_db;
  }
  for (const auto& [setting, choices] : can.choices) {
    PrintDetail(setting, choices);
    json["choices"][setting] = choices;
  }
  return json;
}

core::Json PrintStage(hal::Stage& stage) {
  const hal::StageLimits limits = stage.limits();
  fmt::print("  stage        {}: ({:.4g}, {:.4g}) to ({:.4g}, {:.4g}) m, {:.3g} m/s",
             stage.identity(), limits.min.x, limits.min.y, limits.max.x, limits.max.y,
             limits.speed_m_per_s);
  if (limits.resolution_m > 0) fmt::print(", steps of {:.3g} um", 1e6 * limits.resolution_m);
  const hal::StagePosition where = stage.Where();
  fmt::print(", {}homed{}\n", where.homed ? "" : "not ",
             where.lost.empty() ? "" : " (" + where.lost + ")");
  core::Json json = {
      {"identity", stage.identity()},          {"min_m", {limits.min.x, limits.min.y}},
      {"max_m", {limits.max.x, limits.max.y}}, {"speed_m_per_s", limits.speed_m_per_s},
      {"settle_s", limits.settle_s},           {"repeatability_m", limits.repeatability_m},
      {"resolution_m", limits.resolution_m},   {"homed", where.homed}};
  if (!where.lost.empty()) json["lost"] = where.lost;
  return json;
}

// The devices of a lab; of a lab of real ones also which do not open, and why.
struct OpenedLab {
  hal::Devices devices;
  std::vector<std::pair<std::string, hal::HardwareError>> refused;  // by role
};

OpenedLab OpenLab(const std::string& lab) {
  const core::Config config = core::Config::FromFile(lab);
  OpenedLab opened;
  if (config.Table("lab").Text("driver") == "devices")
    opened.devices = hal::OpenDevices(
        hal::ReadDeviceLab(config), [&](const std::string& role, const hal::HardwareError& error) {
          opened.refused.emplace_back(role, error);
        });
  else
    opened.devices = hal::MakeDevices(lab);
  return opened;
}

core::Json PrintLab(const std::string& lab) {
  core::Json json;
  // A port is asked before its driver takes it, so that a driver that fails has its reason.
  const core::Config config = core::Config::FromFile(lab);
  if (const auto stage = hal::ReadStage(config.Table("stage")); !stage.port.empty()) try {
      json["ports"][stage.port] = PrintIdentification(stage.port, stage.baud);
    } catch (const hal::HardwareError&) {
      fmt::print("  cannot be asked, as is told below\n");
    }
  const OpenedLab opened = OpenLab(lab);
  const hal::Devices& devices = opened.devices;
  fmt::print("devices of {}\n", lab);
  if (devices.camera) json["camera"] = PrintCamera(*devices.camera);
  if (devices.stage) json["stage"] = PrintStage(*devices.stage);
  const auto print = [&json](const char* role, const auto& device) {
    if (!device) return;
    fmt::print("  {:<12} {}\n", role, device->identity());
    json[role] = {{"identity", device->identity()}};
  };
  const auto print_selector = [&json](const char* role, const auto& selector) {
    if (!selector) return;
    fmt::print("  {:<12} {}: {}\n", role, selector->identity(),
               fmt::join(selector->positions(), ", "));
    json[role] = {{"identity", selector->identity()}, {"positions", selector->positions()}};
  };
  print_selector("shutter", devices.shutter);
  print_selector("print", devices.print);
  print_selector("colour", devices.colour);
  print("monitor", devices.monitor);
  print("trigger", devices.trigger);
  print("supply", devices.supply);
  print("inputs", devices.inputs);
  fmt::print("  rig          {}, delta {:.6g} m\n", rig::RigKindName(devices.rig.kind),
             devices.rig.delta_m);
  for (const auto& [role, error] : opened.refused)
    fmt::print("  {:<12} does not open: {}\n", role, error.what());
  if (!opened.refused.empty()) throw opened.refused.front().second;
  return json;
}

core::Json PrintAttached() {
  core::Json json = core::Json::array();
  const auto devices = hal::AttachedDevices();
  fmt::print("devices attached, with the driver that takes them\n");
  for (const auto& device : devices) {
    fmt::print("  {:<12} {}{}{}{}\n", device.driver, device.name, device.what.empty() ? "" : ": ",
               device.what, device.refused.empty() ? "" : "; refused: " + device.refused);
    json.push_back({{"driver", device.driver},
                    {"name", device.name},
                    {"what", device.what},
                    {"refused", device.refused}});
  }
  if (devices.empty()) fmt::print("  none\n");
  return json;
}

core::Json Run(const Options& options) {
  core::Json json;
  fmt::print("drivers built in\n");
  for (const auto& driver : hal::Drivers()) {
    fmt::print("  {:<12} {}\n", driver.name, driver.what);
    json["drivers"].push_back(driver.name);
  }
  json["attached"] = PrintAttached();
  fmt::print("serial ports attached (--port asks one who it is)\n");
  const auto ports = hal::AttachedSerialPorts();
  for (const std::string& port : ports) {
    const std::string refused = hal::PortRefusal(port);
    fmt::print("  {}{}{}\n", port, refused.empty() ? "" : "; refused: ", refused);
  }
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

core::Json Test(const Options& options) {
  return TestDevice(
      options.device, options.test_lab,
      ParseQuantity(options.reach, "--reach", {{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}}));
}

}  // namespace

void AddDevices(Program& program) {
  auto options = std::make_shared<Options>();
  auto test = std::make_shared<CLI::App*>(nullptr);
  CLI::App& verb = program.AddVerb(
      "devices", [options, test] { return (*test)->parsed() ? Test(*options) : Run(*options); });
  verb.add_option("LAB", options->lab, "A lab.toml: open its devices and show their capabilities")
      ->check(InputFile({core::FileKind::kLab}));
  verb.add_option(
      "--port", options->port,
      "Ask a serial port (or tcp:HOST:PORT) which driver is its device's; nothing moves");
  verb.add_option("--baud", options->baud, "Rate of --port");
  *test = verb.add_subcommand("test", "Move, light or expose with one device, within bounds");
  (*test)->fallthrough();
  (*test)->option_defaults()->always_capture_default();
  (*test)
      ->add_option("NAME", options->device,
                   fmt::format("One of {}", fmt::join(TestableDevices(), ", ")))
      ->required();
  (*test)
      ->add_option("LAB", options->test_lab, "Its lab.toml")
      ->required()
      ->check(InputFile({core::FileKind::kLab}));
  (*test)->add_option(
      "--reach", options->reach,
      "How far from the middle of its limits the stage may go, in mm, cm or m; homing "
      "goes to the reference marks first");
}

}  // namespace luxfield::cli
