// Exposure times of a session from its frames instead of the camera's word (exposure_ratios.h;
// LAB.md 4.3).
//
// All frames taken with one exposure time and attenuation make a rung; its ratio r is the true over
// the read-back exposure, the mean over the session: what differs from frame to frame (jitter, PWM)
// scatters about it. The rung of the largest exposure is taken at its
// word: a shutter that opens a fixed time too long errs least there. Standard errors are the
// larger of those of the pixels' noise and of the jackknife over brackets, which sees what the
// pixels of a frame share.
//
// A merged pixel is X = sum share_n x_n, hence the ratios' errors change it by X sum share_n dr_n:
// the same for all pixels that take the same shares, so averaging over pixels does not reduce it.
#pragma once

#include <span>
#include <vector>

#include "core/session_store.h"
#include "reconstruct/exposure_ratios.h"
#include "reconstruct/merge_exposures.h"

namespace luxfield::reconstruct {

struct RungExposure {
  double exposure_s = 0, attenuation = 1;  // read back
  Quantity ratio{1, 0};
  bool known = false;  // false: shares no pixel with the others; then as read back
};

class SessionExposures {
 public:
  // The rungs of the frames of filter positions; ratios 1 until Solve.
  explicit SessionExposures(std::span<const core::FrameRecord> frames);

  // A merged bracket's samples, on a grid of some 2048 pixels: 24 bytes a sample are kept.
  void Add(const SensorModel& sensor, std::span<const core::FrameRecord* const> records,
           std::span<const Exposure> exposures, const MergeOptions& options,
           const MergedFrame& merged);
  void Solve();

  const std::vector<RungExposure>& rungs() const { return rungs_; }
  double Ratio(const core::FrameRecord& record) const { return rungs_[Rung(record)].ratio.value; }

  // sigma^2 += X^2 sum share_n^2 sigma(r_n)^2. Parallel over pixels.
  void WidenSigma(const SensorModel& sensor, std::span<const core::FrameRecord* const> records,
                  std::span<const Exposure> exposures, const MergeOptions& options,
                  MergedFrame* merged) const;

 private:
  using Pixels = std::vector<std::vector<RungSample>>;  // of a bracket

  std::size_t Rung(const core::FrameRecord& record) const;
  ExposureRatios::Result SolveWithout(std::size_t bracket) const;

  std::vector<RungExposure> rungs_;  // by falling exposure
  std::vector<Pixels> brackets_;
};

}  // namespace luxfield::reconstruct
