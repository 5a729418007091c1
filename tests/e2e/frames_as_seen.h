// The frames of a session against what the bench's camera saw: whether a wrong one was accepted.
#pragma once

#include <filesystem>
#include <vector>

#include "tests/fakes/exposure_log.h"

namespace luxfield::e2e {

// The worst differences between what frames say of themselves and what was.
struct FramesAsSeen {
  int frames = 0;       // committed, those of broken brackets included
  double exposure = 0;  // relative
  double place_m = 0;   // of the filter
  double start_s = 0;   // of the exposure
  double meter = 0;     // reading of the lamp's monitor, where there is one; relative
};

// Expects (gtest) of each frame that its pixels are those of one exposure, bit by bit, and of no
// other frame; that shutter, print and lamp were as its kind asks; and that exposure time, place
// start and lamp were what it says, within rounding, half a step of the stage, the delivery of an
// image and the drift of the lamp between two readings of its monitor.
FramesAsSeen ExpectFramesAsSeen(const std::filesystem::path& session,
                                const std::vector<fakes::SeenExposure>& exposures);

}  // namespace luxfield::e2e
