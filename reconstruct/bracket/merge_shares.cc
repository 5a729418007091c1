#include "luxfield/reconstruct/bracket/merge_shares.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace luxfield::reconstruct {
namespace {

double Strength(const Exposure& e) { return e.exposure_s * e.attenuation * e.lamp_factor; }

}  // namespace

MergeShares::MergeShares(const rig::SensorModel& sensor, std::span<const Exposure> exposures,
                         const MergeOptions& options, const MergedFrame& merged)
    : sensor_(sensor),
      exposures_(exposures),
      options_(options),
      merged_(merged),
      longest_first_(exposures.size()) {
  std::iota(longest_first_.begin(), longest_first_.end(), 0);
  std::stable_sort(longest_first_.begin(), longest_first_.end(), [&](std::size_t a, std::size_t b) {
    return Strength(exposures[a]) > Strength(exposures[b]);
  });
}

void MergeShares::At(std::size_t pixel, std::vector<SampleShare>* shares) const {
  const double gain = sensor_.gain_dn_per_e, x = merged_.rate_e_per_s[pixel];
  const double read_variance =
      sensor_.read_noise_dn * sensor_.read_noise_dn + sensor_.quantisation_variance_dn2();
  shares->assign(exposures_.size(), {});
  for (std::size_t n = 0; n < exposures_.size(); ++n) {
    const Exposure& exposure = exposures_[n];
    SampleShare& s = (*shares)[n];
    s.k = gain * Strength(exposure);
    double dark_dn = gain * sensor_.dark_current_e_per_s * exposure.exposure_s, dark_variance = 0;
    if (exposure.dark) {
      dark_variance = (gain * dark_dn + read_variance) / exposure.dark->count;
      dark_dn = std::max(dark_dn, exposure.dark->mean_dn[pixel] - sensor_.black_dn -
                                      4 * std::sqrt(dark_variance));  // a warm pixel
    }
    const double per_square = 1 / (s.k * s.k);
    s.photon_variance = gain * s.k * std::max(x, 0.0) * per_square;
    s.own_variance = (gain * dark_dn + read_variance) * per_square;
    s.dark_variance = dark_variance * per_square;
  }

  const bool poisson = options_.estimator == Estimator::kPoisson;
  const double prnu = sensor_.prnu * x, merged_variance = double{merged_.sigma_e_per_s[pixel]} *
                                                          merged_.sigma_e_per_s[pixel];
  double weights = 0, moment = 0, closest = 0;
  std::size_t first = longest_first_.size();
  std::vector<double> weight(longest_first_.size());
  for (std::size_t rank = longest_first_.size(); rank-- > 0;) {
    const SampleShare& s = (*shares)[longest_first_[rank]];
    const double variance = s.photon_variance + s.own_variance + s.dark_variance;
    weight[rank] = poisson ? s.k : 1 / variance;
    weights += weight[rank];
    moment += weight[rank] * weight[rank] * variance;
    const double off =
        std::abs(std::log((moment / (weights * weights) + prnu * prnu) / merged_variance));
    if (first == longest_first_.size() || off < closest) {
      closest = off;
      first = rank;
    }
  }
  double sum = 0;
  for (std::size_t rank = first; rank < weight.size(); ++rank) sum += weight[rank];
  for (std::size_t rank = first; rank < weight.size(); ++rank)
    (*shares)[longest_first_[rank]].share = weight[rank] / sum;
}

}  // namespace luxfield::reconstruct
