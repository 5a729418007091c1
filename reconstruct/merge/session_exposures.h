// Exposure times of a session from its frames instead of the camera's word (exposure_ratios.h;
// docs/lab.md, "Exposure times").
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
//
// To first order the ratios answer relative errors e_b of the light of bracket b's frames by
// d ln r = L^-1 sum_b L_b e_b (L of exposure_ratios.h, L_b the part of bracket b's pixels), and the
// pixels' noise by errors of covariance L^-1, independent of those of the merged pixels: X of
// efficient weights is uncorrelated with x - X.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "luxfield/reconstruct/bracket/exposure_ratios.h"
#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/rig/sensor_model.h"
#include "luxfield/session/session_store.h"

namespace luxfield::reconstruct {

struct RungExposure {
  double exposure_s = 0, attenuation = 1;  // read back
  core::Quantity ratio{1, 0};
  bool known = false;  // false: shares no pixel with the others; then as read back
};

// What estimated ratios do to a quantity.
struct ThroughRatios {
  std::map<const session::FrameRecord*, double> light;  // dQ per relative error of a frame's light
  double noise_variance = 0;                            // of the pixels that the ratios come from
};

class SessionExposures {
 public:
  // The rungs of the frames of filter positions; ratios 1 until Solve.
  explicit SessionExposures(std::span<const session::FrameRecord> frames);

  // A merged bracket's samples, on a grid of some 2048 pixels: 24 bytes a sample are kept.
  void Add(const rig::SensorModel& sensor, std::span<const session::FrameRecord* const> records,
           std::span<const Exposure> exposures, const MergeOptions& options,
           const MergedFrame& merged);
  void Solve();

  const std::vector<RungExposure>& rungs() const { return rungs_; }
  double Ratio(const session::FrameRecord& record) const {
    return rungs_[Rung(record)].ratio.value;
  }

  // Of a quantity that holds `light` of every frame, dQ per relative error of it with the ratios as
  // they are. Added to it, what is common to a rung's frames cancels but for the first's.
  ThroughRatios Propagate(const std::map<const session::FrameRecord*, double>& light) const;

  // sigma^2 += X^2 sum share_n^2 sigma(r_n)^2. Parallel over pixels.
  void WidenSigma(const rig::SensorModel& sensor,
                  std::span<const session::FrameRecord* const> records,
                  std::span<const Exposure> exposures, const MergeOptions& options,
                  MergedFrame* merged) const;

 private:
  struct Bracket {
    std::vector<const session::FrameRecord*> records;
    std::vector<std::vector<RungSample>> pixels;
    std::vector<double> information;  // L_b, rungs x rungs
  };

  std::size_t Rung(const session::FrameRecord& record) const;
  ExposureRatios::Result SolveWithout(std::size_t bracket) const;

  std::vector<RungExposure> rungs_;  // by falling exposure
  std::vector<Bracket> brackets_;
  std::vector<double> information_;  // L
};

}  // namespace luxfield::reconstruct
