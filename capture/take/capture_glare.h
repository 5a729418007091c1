// Glare plan and rig -> a session of frames of the light trap, and darks.
#pragma once

#include "luxfield/capture/plan/glare_plan.h"
#include "luxfield/capture/take/capture.h"
#include "luxfield/session/session_store.h"

namespace luxfield::capture {

// Captures what the session lacks and seals it: of every place of the trap `repeats` frames at the
// longest exposure below the plan's share of saturation (kind `target`, i the place, from 0), then
// as many darks of every exposure time that was used. Ctrl-C pauses before the next place; on
// resume a place with all of its frames stays.
//
// Throws as RunCapture and ShootBelowSaturation.
CaptureSummary RunGlareCapture(const GlarePlan& plan, hal::Devices& devices,
                               const std::filesystem::path& session_folder,
                               const CaptureOptions& options = {});

// Frames of the plan that a session of kind "glare" lacks.
int MissingGlareFrames(const session::SessionReader& session);

}  // namespace luxfield::capture
