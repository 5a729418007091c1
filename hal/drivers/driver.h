// What a driver says of itself. Each has a folder of its own in hal/drivers/, whose driver.h declares
// its Description(). A camera or a stage is added there and in hal/drivers/list/, which lists these.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "luxfield/core/clock.h"
#include "luxfield/core/config.h"
#include "luxfield/hal/camera.h"
#include "luxfield/hal/stage.h"
#include "luxfield/hal/transport/byte_stream.h"
#include "luxfield/hal/trigger.h"

namespace luxfield::hal {

// A camera as the [camera] of a lab.toml describes it, not yet opened.
struct DescribedCamera {
  int bits = 0;                                 // of the frames that it gives
  std::string cfa;                              // its mosaic (rig/cfa.h), empty without one
  std::string mosaic_field;                     // the key of [camera] that says so
  std::map<std::string, std::string> settings;  // camera.settings of session.json
  bool needs_trigger = false;                   // a [trigger] has to be there
  // HardwareError where it does not answer or cannot be set as described.
  std::function<std::unique_ptr<Camera>(std::shared_ptr<core::Clock>, std::shared_ptr<Trigger>)>
      open;
};

// Opens a stage, within limits, on the port that its controller answers on. HardwareError where it
// does not answer or is not the stage described.
using OpenStageOn = std::function<std::unique_ptr<Stage>(
    std::unique_ptr<ByteStream>, const StageLimits&, std::shared_ptr<core::Clock>)>;

// What is attached to this computer that a driver of this program could take.
struct AttachedDevice {
  std::string driver;   // that would take it
  std::string name;     // what lab.toml calls it
  std::string what;     // what it says it is
  std::string refused;  // why it cannot be taken; empty: it can
};

// What a driver does not have is empty.
struct Driver {
  std::string name;      // in lab.toml
  std::string what;      // one line, for people
  bool built = true;     // into this program
  std::string packages;  // that it needs to be built
  // Of [camera] and [stage]. Throw InputError naming file and field.
  std::function<DescribedCamera(const core::Config& camera)> read_camera;
  std::function<OpenStageOn(const core::Config& stage)> read_stage;
  // Nothing is moved, lit or exposed, and nothing taken from a program that uses it.
  std::function<std::vector<AttachedDevice>()> attached;
};

}  // namespace luxfield::hal
