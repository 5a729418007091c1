// A rig: its devices and what is known about them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "luxfield/core/clock.h"
#include "luxfield/core/config.h"
#include "luxfield/hal/camera.h"
#include "luxfield/hal/error.h"
#include "luxfield/hal/instruments.h"
#include "luxfield/hal/stage.h"
#include "luxfield/hal/trigger.h"
#include "luxfield/rig/rig_description.h"

namespace luxfield::hal {

class Watchdog;

// The filter centres a session is going to visit, in order, repeats included.
struct VisitPlan {
  int epoch = 0;
  std::vector<Vec2> filter_centres;
};

struct Devices {
  // Of a lab of real devices (hal/safety/watchdog.h); may be null. First, so that it outlives the
  // others.
  std::shared_ptr<Watchdog> watchdog;
  std::shared_ptr<core::Clock> clock;
  rig::RigDescription rig;
  std::unique_ptr<Camera> camera;
  std::map<std::string, std::string> camera_settings;  // camera.settings of session.json
  std::map<std::string, std::string> lab_files;        // of session.json: field, SHA-256
  std::shared_ptr<Trigger> trigger;  // of the camera, which has it too; null: it has its own
  std::unique_ptr<Stage> stage;
  std::unique_ptr<Selector> shutter;  // "open", "closed": for darks
  std::unique_ptr<Selector> print;    // "plus", "minus"; null where there is one print
  std::unique_ptr<Selector>
      target;  // rig::TargetNames: what stands in the light; null: none there is
  std::unique_ptr<Selector> colour;  // "Y", or "R", "G", "B"; null for one channel
  std::unique_ptr<Meter> monitor;    // lamp monitor; may be null
  std::unique_ptr<Supply> supply;    // may be null: the lamp is on
  std::unique_ptr<Inputs> inputs;    // may be null
  // Optional: told before a session what it will visit. A real rig needs no warning; the simulated
  // one traces the light for all visits together.
  std::function<void(const VisitPlan&)> announce;
};

}  // namespace luxfield::hal
