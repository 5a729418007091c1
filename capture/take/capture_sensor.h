// Sensor plan and rig -> a session of flats and darks.
#pragma once

#include "luxfield/capture/plan/sensor_plan.h"
#include "luxfield/capture/take/capture.h"
#include "luxfield/session/session_store.h"

namespace luxfield::capture {

// Captures what the session lacks and seals it: warm-up, a probe that the ladder fits the light,
// darks of every exposure time, then per channel the flats: up the ladder (repeat 0, 2, ...) and
// down again (1, 3, ...), so that the two frames of a pair lie symmetrically in time and a steady
// drift leaves the ratios of the pairs' means alone. The stage stays where homing leaves it.
// Ctrl-C pauses before the next frame; on resume the frames that are there stay.
//
// Throws as RunCapture, and InputError with the exposure times to plan where the ladder has fewer
// than six levels between 5 % and 95 % of saturation, or none above it.
CaptureSummary RunSensorCapture(const SensorPlan& plan, hal::Devices& devices,
                                const std::filesystem::path& session_folder,
                                const CaptureOptions& options = {});

// Frames of the plan that a session of kind "sensor" lacks.
int MissingSensorFrames(const session::SessionReader& session);

}  // namespace luxfield::capture
