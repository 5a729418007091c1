#include "luxfield/hal/lab/open_lab.h"

#include <fmt/format.h>

#include "luxfield/core/execution.h"
#include "luxfield/hal/drivers/list/drivers.h"
#include "luxfield/hal/lab/device_lab.h"
#include "luxfield/hal/lab/safe_state.h"
#include "luxfield/hal/sim/simulated_lab.h"

namespace luxfield::hal {
namespace {

// No watchdog: a simulated lab may compute for minutes between two operations.
void WarnOfRealStage(const StageOptions& stage) {
  if (stage.port.empty()) return;
  core::Say(
      core::Severity::kNote,
      fmt::format("the stage on {} is real and the rest of the lab simulated: no emergency "
                  "stop, door or watchdog is looked at; keep a hand on the machine's own stop",
                  stage.port));
}

}  // namespace

Devices MakeDevices(const std::filesystem::path& lab_toml, std::optional<std::uint64_t> seed,
                    const StageBounds& plan) {
  const core::Config config = core::Config::FromFile(lab_toml);
  const core::Config lab = config.Table("lab");
  const bool simulated = lab.Choice("driver", {"sim", "devices"}) == "sim";
  const StageOptions stage = ReadStage(config.Table("stage"));
  for (const std::string& sentence : Overruled(stage.limits, plan))
    core::Say(core::Severity::kNote, sentence);
  if (simulated) {
    WarnOfRealStage(stage);
    return sim::SimulatedLab(config, seed, plan).MakeDevices();
  }
  DeviceLab device_lab = ReadDeviceLab(config);
  Tighten(device_lab.stage, plan);
  const auto watchdog =
      StartWatchdog(device_lab);  // outlives what OpenDevices opens and fails with
  Devices devices = OpenDevices(device_lab);
  devices.watchdog = watchdog;
  return devices;
}

std::vector<DriverInfo> Drivers() {
  std::vector<DriverInfo> drivers = {
      {"sim", "the simulated lab: lamp, filter, stage and camera as one world"}};
  for (const Driver& driver : AllDrivers())
    if (driver.built) drivers.push_back({driver.name, driver.what});
  return drivers;
}

}  // namespace luxfield::hal
