// How much of what C >= 0 costs a better C >= 0 undoes, and how far that is known from a sample of
// receivers.
#pragma once

#include <cstdint>
#include <span>

namespace luxfield::bench {

// Squared errors at the same receivers, equally likely ones.
struct SquaredErrors {
  std::span<const double> signed_c;       // of the solution that is free to be negative
  std::span<const double> worse, better;  // of two C >= 0
};

// With e^2 the sums over receivers, the damage being the excess over signed C in quadrature,
//
//   share = 1 - d(better) / d(worse),   d(x)^2 = max(0, e(x)^2 - e(signed)^2)
//
// NaN where `worse` is no worse than signed C. A few receivers at the edge of a beam hold most of
// the errors, so that a share of few receivers says little: `low` and `high` are the 5th and 95th
// percentiles of 400 resamples of the receivers (the bootstrap's percentile interval: Efron,
// Tibshirani 1993, chapter 13), those without damage left out, and NaN where more than a tenth are
// without.
struct UndoneShare {
  double share = 0, low = 0, high = 0;
};
UndoneShare UndoneDamage(const SquaredErrors& errors, std::uint64_t seed);

}  // namespace luxfield::bench
