// What a frame shows, whether it can be right, and which exposures a bracket needs
// (docs/lab.md, "Exposure brackets", "What a frame is checked for").
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "capture/plan.h"
#include "core/raw_frame.h"
#include "hal/devices.h"

namespace luxfield::capture {

// Neighbours in the order of a frame's pixels, [begin, end).
struct PixelRun {
  std::size_t begin = 0, end = 0;
};
// Pixels that count, in ascending runs: defects of the calibration left out.
std::vector<PixelRun> UsablePixels(const hal::CameraCapabilities& camera,
                                   const hal::CameraCalibration& calibration);

struct FrameStatistics {
  double mean_dn = 0, brightest_dn = 0;
  double saturated_share = 0;  // of the usable pixels: at or above saturation
  double black_share = 0;      // at or below the black level
};
// Of every usable pixel.
FrameStatistics Measure(const core::RawFrame& frame, const std::vector<PixelRun>& usable,
                        const hal::CameraCalibration& calibration);
nlohmann::json ToJson(const FrameStatistics& statistics);

// The rungs of a bracket: from the longest exposure that keeps the brightest pixel below
// saturation_share, to the first one that lifts every pixel that matters (relevant_share of the
// brightest) floor_sigmas read noises above black. `rate_dn_per_s` is the brightest pixel's signal.
struct Rungs {
  int first = 0, last = 0;
};
Rungs ChooseRungs(double rate_dn_per_s, const std::vector<double>& ladder_s,
                  const ExposurePolicy& policy, const hal::CameraCalibration& calibration);

// Frames that find how bright a place is, before its bracket: from the middle of the ladder down
// while anything is saturated, up while nothing stands out of the noise.
struct Probe {
  int rung = 0;
  bool came_down = false;
};
struct ProbeWalk {
  int top = 0;  // the ladder's last rung
  const ExposurePolicy& policy;
  const hal::CameraCalibration& calibration;

  Probe First() const { return {top / 2, false}; }
  // After a frame with this brightest pixel; nothing: it is good enough.
  std::optional<Probe> Next(const Probe& probe, double brightest_dn) const;
};

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
std::optional<double> LevelRatio(const core::RawFrame& frame, double exposure_s,
                                 const core::RawFrame& shorter, double shorter_exposure_s,
                                 const std::vector<PixelRun>& usable,
                                 const hal::CameraCalibration& calibration, double tolerance);

}  // namespace luxfield::capture
