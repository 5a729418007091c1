// Geometry plan and rig -> a session of frames of calibration targets.
#pragma once

#include "luxfield/capture/plan/geometry_plan.h"
#include "luxfield/capture/take/capture.h"
#include "luxfield/session/session_store.h"

namespace luxfield::capture {

// Captures what the session lacks and seals it: per view the target is put up, the stage moved, and
// the longest exposure of the ladder kept that leaves every pixel below the plan's share of
// saturation. Frames have kind `target` and the view's number as i. Ctrl-C pauses before the next
// view; on resume the frames that are there stay.
//
// Throws as RunCapture, and InputError where even the shortest exposure saturates, or the longest
// shows less than a tenth of the sensor's range.
CaptureSummary RunGeometryCapture(const GeometryPlan& plan, hal::Devices& devices,
                                  const std::filesystem::path& session_folder,
                                  const CaptureOptions& options = {});

// Frames of the plan that a session of kind "geometry" lacks.
int MissingGeometryFrames(const session::SessionReader& session);

}  // namespace luxfield::capture
