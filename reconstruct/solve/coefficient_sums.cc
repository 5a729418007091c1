#include "luxfield/reconstruct/solve/coefficient_sums.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace luxfield::reconstruct {
namespace {

// A bin for each exponent and ten bits of the mantissa.
constexpr int kBinShift = 13;
constexpr std::size_t kBins = std::size_t{1} << (31 - kBinShift);

}  // namespace

CoefficientSums::CoefficientSums() : bins_(kBins) {}

void CoefficientSums::Bin::Add(float value, std::uint64_t times) {
  least = count == 0 ? value : std::min(least, value);
  largest = count == 0 ? value : std::max(largest, value);
  count += times;
}

void CoefficientSums::AddSigma(float sigma, std::uint64_t times) {
  variances_ += static_cast<double>(times) * sigma * sigma;
  sigmas_ += times;
  bins_[(std::bit_cast<std::uint32_t>(sigma) & 0x7FFFFFFFu) >> kBinShift].Add(sigma, times);
}

void CoefficientSums::Add(const lightfield::LightField& coefficients,
                          const lightfield::LightField& sigma, const std::vector<bool>& without) {
  const std::size_t texels = coefficients.geometry.plane_size();
  for (std::size_t k = 0; k < coefficients.data.size(); ++k) {
    if (!without.empty() && without[k % texels]) continue;
    const float c = coefficients.data[k];
    (c < 0 ? negative_ : positive_) += std::abs(c);
    squares_ += double{c} * c;
    min_ = count_ == 0 ? c : std::min(min_, c);
    max_ = count_ == 0 ? c : std::max(max_, c);
    ++count_;
  }
  for (std::size_t k = 0; k < sigma.data.size(); ++k)
    if (without.empty() || !without[k % texels]) AddSigma(sigma.data[k], 1);
}

void CoefficientSums::AddDark(std::size_t count, float sigma) {
  if (count == 0) return;
  min_ = count_ == 0 ? 0 : std::min(min_, 0.0f);
  max_ = count_ == 0 ? 0 : std::max(max_, 0.0f);
  count_ += count;
  AddSigma(sigma, count);
}

void CoefficientSums::Add(const CoefficientSums& more) {
  if (more.count_ > 0) {
    min_ = count_ == 0 ? more.min_ : std::min(min_, more.min_);
    max_ = count_ == 0 ? more.max_ : std::max(max_, more.max_);
  }
  positive_ += more.positive_;
  negative_ += more.negative_;
  squares_ += more.squares_;
  variances_ += more.variances_;
  count_ += more.count_;
  sigmas_ += more.sigmas_;
  for (std::size_t k = 0; k < bins_.size(); ++k) {
    const Bin& bin = more.bins_[k];
    if (bin.count == 0) continue;
    bins_[k].Add(bin.least, bin.count - 1);
    bins_[k].Add(bin.largest, 1);
  }
}

CoefficientStatistics CoefficientSums::Find() const {
  CoefficientStatistics result;
  if (count_ == 0) return result;
  result.min = min_;
  result.max = max_;
  result.mean = (positive_ - negative_) / static_cast<double>(count_);
  result.negative_energy = positive_ > 0 ? negative_ / positive_ : 0;
  result.sigma_relative = squares_ > 0 ? std::sqrt(variances_ / squares_) : 0;
  std::uint64_t rank = sigmas_ / 2;
  for (const Bin& bin : bins_) {
    if (rank < bin.count) {
      const double share =
          bin.count > 1 ? static_cast<double>(rank) / static_cast<double>(bin.count - 1) : 0;
      result.sigma_median = bin.least + share * (double{bin.largest} - bin.least);
      break;
    }
    rank -= bin.count;
  }
  return result;
}

}  // namespace luxfield::reconstruct
