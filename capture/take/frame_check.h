// What a frame shows and whether it can be right (docs/lab.md, "What a frame is checked for").
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/capture/plan/plan.h"
#include "luxfield/hal/devices.h"
#include "luxfield/session/raw_frame.h"

namespace luxfield::capture {

// Neighbours in the order of a frame's pixels, [begin, end).
struct PixelRun {
  std::size_t begin = 0, end = 0;
};
// Pixels that count, in ascending runs: defects of the calibration left out.
std::vector<PixelRun> UsablePixels(const hal::CameraCapabilities& camera,
                                   const rig::SensorModel& calibration);

struct FrameStatistics {
  double mean_dn = 0, brightest_dn = 0;
  double saturated_share = 0;  // of the usable pixels: at or above saturation
  double black_share = 0;      // at or below the black level
};
// Of every usable pixel.
FrameStatistics Measure(const session::RawFrame& frame, const std::vector<PixelRun>& usable,
                        const rig::SensorModel& calibration);
nlohmann::json ToJson(const FrameStatistics& statistics);

// Level of `frame` over that of `shorter`, divided by the ratio of their exposures, over pixels
// that both show well; 1 if all is right. Nothing if too few pixels do (100) or their noise is
// above a tenth of `tolerance`.
//
// First a sixteenth of the pixels is looked at, 2048 in a row of every 32768, from one end of the
// frame to the other; the rest only where the noise of the shorter frame's level, over the sample,
// is above 0.02 of the tolerance. The longer frame's is less. So a level wrong by 1.15 tolerances
// or more is found to be beyond the tolerance, and one within 0.85 is not, but for a chance of
// 1e-7 (five standard deviations). A wrong part of the frame counts by its share of the light,
// as it does in the whole, if it is larger than 32768 pixels in a row.
std::optional<double> LevelRatio(const session::RawFrame& frame, double exposure_s,
                                 const session::RawFrame& shorter, double shorter_exposure_s,
                                 const std::vector<PixelRun>& usable,
                                 const rig::SensorModel& calibration, double tolerance);

}  // namespace luxfield::capture
