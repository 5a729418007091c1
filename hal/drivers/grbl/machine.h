// What a Grbl machine is set up to be, and whether that is the stage a lab.toml describes.
//
// A filter coordinate c (metres) and the machine coordinate m (mm) of its axis:
//   m = origin_mm + sign 1000 c
// Machine space is 0 at the home switches and negative elsewhere, on every axis. Firmware that puts
// the place where homing ends at a coordinate of its own (`Z` in [OPT:] at 0, FluidNC at mpos_mm)
// counts from there, upwards where the switches are at the lower end.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "luxfield/hal/drivers/grbl/message.h"
#include "luxfield/hal/stage.h"

namespace luxfield::hal::grbl {

struct Axis {
  int machine_axis = 0;  // 0 X, 1 Y, 2 Z
  int sign = 1;
  double origin_mm = 0;

  double MachineMm(double metres) const { return origin_mm + sign * 1000 * metres; }
  double Metres(double machine_mm) const { return sign * (machine_mm - origin_mm) / 1000; }
};

constexpr int kSoftLimits = 20;  // $20

struct StageSetup {
  StageLimits limits;        // the stage never leaves them, nor exceeds their speed
  std::array<Axis, 2> axes;  // of u and v
};

struct Controller {
  Firmware firmware;
  std::map<int, double> settings;                    // $n
  std::array<std::optional<double>, 3> own_home_mm;  // X, Y, Z, where the firmware sets them

  // A line of `$I`, without its brackets.
  void ReadInfo(std::string_view line);
  // A setting that a 1.1 controller has; HardwareError(kProtocol) if it did not come through.
  double Get(int number, const std::string& device) const;
  // Where homing leaves an axis, in mm.
  double HomeMm(int machine_axis, const std::string& device) const;
  double StepMm(int machine_axis, const std::string& device) const;
};

// HardwareError(kRefused) naming the setting and what to send: not millimetres, homing or soft
// limits off, limits outside the travel, speed beyond an axis.
void CheckController(const Controller& controller, const StageSetup& setup,
                     const std::string& device);

}  // namespace luxfield::hal::grbl
