// luxfield devices: what luxfield can drive and compute on.
#include <fmt/format.h>

#include <memory>

#include "cli/program.h"
#include "hal/devices.h"
#include "render/device.h"

namespace luxfield::cli {
namespace {

core::Json Run(const std::string& lab) {
  core::Json json;
  fmt::print("drivers built in\n");
  for (const auto& driver : hal::Drivers()) {
    fmt::print("  {:<12} {}\n", driver.name, driver.what);
    json["drivers"].push_back(driver.name);
  }
  if (!lab.empty()) {
    const hal::Devices devices = hal::MakeDevices(lab);
    const auto& camera = *devices.camera;
    const auto capabilities = camera.capabilities();
    const auto limits = devices.stage->limits();
    fmt::print("devices of {}\n", lab);
    fmt::print("  camera       {}: {} x {}, {} bit, exposures {:.3g} to {:.3g} s\n",
               camera.identity(), capabilities.width, capabilities.height, capabilities.bits,
               capabilities.min_exposure_s, capabilities.max_exposure_s);
    fmt::print("  stage        {}: ({:.4g}, {:.4g}) to ({:.4g}, {:.4g}) m, {:.3g} m/s\n",
               devices.stage->identity(), limits.min.x, limits.min.y, limits.max.x, limits.max.y,
               limits.speed_m_per_s);
    fmt::print("  rig          {}, delta {:.6g} m\n", hal::RigKindName(devices.rig.kind),
               devices.rig.delta_m);
    json["camera"] = camera.identity();
    json["stage"] = devices.stage->identity();
  }
  fmt::print("OpenCL devices (--device takes the number or a part of the name)\n");
  for (const auto& device : render::ListDevices()) {
    fmt::print("  {}: {} ({}), {} compute units, {}\n", device.index, device.name, device.version,
               device.compute_units, FormatBytes(double(device.global_memory_bytes)));
    json["opencl"].push_back(device.name);
  }
  return json;
}

}  // namespace

void AddDevices(Program& program) {
  auto lab = std::make_shared<std::string>();
  CLI::App& verb = program.AddVerb("devices", "List drivers, a lab's devices and OpenCL devices",
                                   [lab] { return Run(*lab); });
  verb.add_option("LAB", *lab, "A lab.toml: open its devices and show their capabilities");
}

}  // namespace luxfield::cli
