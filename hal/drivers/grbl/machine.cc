#include "luxfield/hal/drivers/grbl/machine.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "luxfield/hal/error.h"

namespace luxfield::hal::grbl {
namespace {

constexpr int kReportInches = 13, kHoming = 22, kHomingDirection = 23, kPullOff = 27,
              kStepsPerMm = 100, kMaxRate = 110, kMaxTravel = 130;

bool HomesLow(const Controller& controller, int axis, const std::string& device) {
  return (static_cast<int>(controller.Get(kHomingDirection, device)) >> axis & 1) != 0;
}

std::pair<double, double> TravelMm(const Controller& controller, int axis,
                                   const std::string& device) {
  const double travel = controller.Get(kMaxTravel + axis, device);
  const double home = controller.own_home_mm[axis].value_or(0);
  if (controller.own_home_mm[axis] && HomesLow(controller, axis, device))
    return {home, home + travel};
  return {home - travel, home};
}

}  // namespace

void Controller::ReadInfo(std::string_view line) {
  constexpr std::string_view kOptions = "OPT:", kFirmware = "FIRMWARE:";
  if (line.starts_with("VER:")) firmware = ParseVersion(line);
  if (line.starts_with(kFirmware)) firmware.name = line.substr(kFirmware.size());
  if (line.starts_with(kOptions) && line.substr(0, line.find(',')).find('Z') != line.npos)
    own_home_mm.fill(0);
}

double Controller::Get(int number, const std::string& device) const {
  const auto found = settings.find(number);
  if (found == settings.end())
    throw HardwareError(Fault::kProtocol, device, "read settings",
                        fmt::format("${} did not come through", number),
                        "check cable and firmware");
  return found->second;
}

double Controller::HomeMm(int axis, const std::string& device) const {
  if (own_home_mm[axis]) return *own_home_mm[axis];
  const double pull_off = Get(kPullOff, device);
  return HomesLow(*this, axis, device) ? pull_off - Get(kMaxTravel + axis, device) : -pull_off;
}

double Controller::StepMm(int axis, const std::string& device) const {
  const double steps_per_mm = Get(kStepsPerMm + axis, device);
  if (!(steps_per_mm > 0))
    throw HardwareError(Fault::kProtocol, device, "read settings",
                        fmt::format("${} = {}", kStepsPerMm + axis, steps_per_mm),
                        "set the steps per mm");
  return 1 / steps_per_mm;
}

void CheckController(const Controller& controller, const StageSetup& setup,
                     const std::string& device) {
  // FluidNC is set up by a file, of which its $n are a copy.
  const bool by_file = controller.firmware.name == "FluidNC";
  const auto refuse = [&](const std::string& problem, const std::string& remedy,
                          const std::string& remedy_of_file) {
    throw HardwareError(Fault::kRefused, device, "check settings", problem,
                        by_file ? remedy_of_file + " in config.yaml" : remedy);
  };
  if (controller.Get(kReportInches, device) != 0)
    refuse("it reports inches", "send $13=0", "set report_inches: false");
  // Bit 0; grblHAL keeps options of homing in the others.
  if (static_cast<int>(controller.Get(kHoming, device)) % 2 == 0)
    refuse("homing is off, so that it can never know where it is",
           "connect home switches and send $22=1", "connect home switches and set up homing");
  if (controller.Get(kSoftLimits, device) == 0)
    refuse("soft limits are off", "send $20=1", "set soft_limits: true for both axes");
  const StageLimits& limits = setup.limits;
  const std::array low = {limits.min.x, limits.min.y}, high = {limits.max.x, limits.max.y};
  for (int k = 0; k < 2; ++k) {
    const Axis& axis = setup.axes[k];
    const char letter = "XYZ"[axis.machine_axis];
    const auto [from, to] = std::minmax({axis.MachineMm(low[k]), axis.MachineMm(high[k])});
    const auto [travel_low, travel_high] = TravelMm(controller, axis.machine_axis, device);
    if (from < travel_low || to > travel_high)
      refuse(
          fmt::format("the lab's limits are {} = {:.4g} to {:.4g} mm, its travel {:.4g} to "
                      "{:.4g} mm",
                      letter, from, to, travel_low, travel_high),
          fmt::format("correct origin_m, min_m and max_m, or ${}", kMaxTravel + axis.machine_axis),
          "correct origin_m, min_m and max_m in lab.toml, or max_travel_mm and mpos_mm");
    const double rate = controller.Get(kMaxRate + axis.machine_axis, device) / 60000;
    if (limits.speed_m_per_s > rate)
      refuse(fmt::format("{} reaches {:.4g} m/s, the lab asks for {:.4g}", letter, rate,
                         limits.speed_m_per_s),
             fmt::format("lower speed_m_per_s, or raise ${}", kMaxRate + axis.machine_axis),
             "lower speed_m_per_s in lab.toml, or raise max_rate_mm_per_min");
  }
}

}  // namespace luxfield::hal::grbl
