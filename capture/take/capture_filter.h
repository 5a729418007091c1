// The photographs of a filter plan -> session (docs/formats/session.md).
#pragma once

#include <filesystem>

#include "luxfield/capture/plan/filter_plan.h"
#include "luxfield/capture/take/capture.h"
#include "luxfield/session/session_store.h"

namespace luxfield::capture {

// The empty holder in an exposure that it chooses, every print in that one and in those 8 times as
// long, and darks of each. Errors and resuming as RunCapture: what is there is not taken again.
CaptureSummary RunFilterCapture(const FilterPlan& plan, hal::Devices& devices,
                                const std::filesystem::path& folder,
                                const CaptureOptions& options = {});

// Frames of the plan that the session does not hold.
int MissingFilterFrames(const session::SessionReader& session);

}  // namespace luxfield::capture
