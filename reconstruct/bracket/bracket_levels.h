// Which frames of an exposure bracket contradict each other
// (docs/lab.md, "What a frame is checked for").
//
// A capture compares a frame with the shorter exposure before it and cannot tell which of the two
// is wrong: where the shortest is, every other one is flagged. Here each is compared with each.
// Level of frame a over that of frame b, over pixels p that both show well:
//
//   r = sum_p (y_a - d_a) / k_a / sum_p (y_b - d_b) / k_b,   k = gain t a l (merge_exposures.h)
//
// Two frames agree where |r - 1| <= tolerance. Frames that agree, directly or through others, make
// a group; the group of most frames is believed. Two groups of that size: none is.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/rig/sensor_model.h"

namespace luxfield::reconstruct {

// r of the above. Pixels that show well: at least 10 standard deviations of read-out noise above
// the dark signal and at most 0.8 of saturation, in both frames; of at most some 2^18 of the
// frame. Nothing where fewer than 100 do, or the standard error of r is above a tenth of
// `tolerance`. Throws InputError for a frame that does not have the sensor's size.
std::optional<double> LevelRatio(const rig::SensorModel& sensor, const Exposure& a,
                                 const Exposure& b, double tolerance);

// Of every frame, whether it has to be left out: it is not of the believed group and contradicts
// (r is known and beyond the tolerance) another frame. One that cannot be compared with any stays.
std::vector<bool> ContradictedFrames(const rig::SensorModel& sensor,
                                     std::span<const Exposure> exposures, double tolerance);

}  // namespace luxfield::reconstruct
