#include "luxfield/bench/undone_damage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::bench {
namespace {

constexpr int kResamples = 400;
constexpr double kMostWithout = 0.1;  // of the resamples, without damage
constexpr double kTail = 0.05;

struct Sums {
  double signed_c = 0, worse = 0, better = 0;

  void Add(const SquaredErrors& errors, std::size_t k) {
    signed_c += errors.signed_c[k];
    worse += errors.worse[k];
    better += errors.better[k];
  }
  double Share() const {
    if (!(worse > signed_c)) return std::numeric_limits<double>::quiet_NaN();
    return 1 - std::sqrt(std::max(better - signed_c, 0.0) / (worse - signed_c));
  }
};

}  // namespace

UndoneShare UndoneDamage(const SquaredErrors& errors, std::uint64_t seed) {
  const std::size_t count = errors.signed_c.size();
  Sums all;
  for (std::size_t k = 0; k < count; ++k) all.Add(errors, k);
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  UndoneShare result{all.Share(), kNone, kNone};
  std::vector<double> shares;
  for (int resample = 0; resample < kResamples; ++resample) {
    core::Random random(seed, 0x626f6f74, static_cast<std::uint32_t>(resample));
    Sums sums;
    for (std::size_t k = 0; k < count; ++k)
      sums.Add(errors, static_cast<std::size_t>(random.Uniform() * static_cast<double>(count)));
    if (const double share = sums.Share(); !std::isnan(share)) shares.push_back(share);
  }
  if (static_cast<double>(shares.size()) < (1 - kMostWithout) * kResamples) return result;
  std::sort(shares.begin(), shares.end());
  const auto last = static_cast<double>(shares.size() - 1);
  result.low = shares[static_cast<std::size_t>(std::lround(kTail * last))];
  result.high = shares[static_cast<std::size_t>(std::lround((1 - kTail) * last))];
  return result;
}

}  // namespace luxfield::bench
