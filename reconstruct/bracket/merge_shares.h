// How a merged pixel depends on its samples (merge_exposures.h): X = sum share_n x_n, the shares
// summing to 1. To first order they are constants: a weight's dependence on X multiplies
// sum w (x - X) = 0.
#pragma once

#include <span>
#include <vector>

#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/rig/sensor_model.h"

namespace luxfield::reconstruct {

struct SampleShare {
  double share = 0;            // 0: left out
  double k = 0;                // DN per electron per second of X
  double photon_variance = 0;  // of x, electrons^2 s^-2: the light's shot noise
  double own_variance = 0;     // of x: dark current's shot noise, read noise and rounding
  double dark_variance = 0;    // of x: the noise of the averaged dark frame
};

class MergeShares {
 public:
  // As given to MergeExposures, and what it returned. The exposures must outlive this.
  MergeShares(const rig::SensorModel& sensor, std::span<const Exposure> exposures,
              const MergeOptions& options, const MergedFrame& merged);

  // One entry per exposure, in their order. Which samples were left out is read off the merged
  // sigma: they are the longest, and each changes sigma.
  void At(std::size_t pixel, std::vector<SampleShare>* shares) const;

 private:
  rig::SensorModel sensor_;
  std::span<const Exposure> exposures_;
  MergeOptions options_;
  const MergedFrame& merged_;
  std::vector<std::size_t> longest_first_;
};

}  // namespace luxfield::reconstruct
