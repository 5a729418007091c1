// Simulated labs that measure one lamp with noise, and what they state: few in the suite,
// $LUXFIELD_LABS in a proof (docs/testing.md).
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "luxfield/photometry/functional.h"

namespace luxfield::photometry {

inline int LabsOr(int few) {
  const char* text = std::getenv("LUXFIELD_LABS");
  return text ? std::atoi(text) : few;
}

using Quantities = std::map<std::string, Estimate>;

// Does a quantity's standard uncertainty state the scatter over the labs, and does its 95 % interval
// hold the truth in 95 % of them?
class LabsJudge {
 public:
  explicit LabsJudge(Quantities truth) : truth_(std::move(truth)) {}

  void Add(const Quantities& stated) {
    ++labs_;
    for (const auto& [name, one] : truth_) {
      const auto found = stated.find(name);
      if (found == stated.end() || !found->second.u) continue;
      Tally& tally = tallies_[name];
      const double error = found->second.value - one.value, u = *found->second.u;
      tally.sum += error;
      tally.squares += error * error;
      tally.u_squares += u * u;
      tally.covered += std::abs(error) <= kInterval * u;
      ++tally.labs;
    }
  }

  void ExpectHonest() {
    constexpr int kProofLabs = 400;
    constexpr double kCovered = 0.95, kStated = 0.9;
    const bool proof = labs_ >= kProofLabs;
    double covered = 0;
    for (const auto& [name, one] : truth_) {
      const Tally& tally = tallies_[name];
      // A lab that is too noisy for an uncertainty gives none.
      ASSERT_GE(tally.labs, kStated * labs_) << name;
      const double n = tally.labs, mean = tally.sum / n;
      const double spread = std::sqrt((tally.squares - n * mean * mean) / (n - 1)),
                   stated = std::sqrt(tally.u_squares / n), share = tally.covered / n;
      // The scatter's own standard deviation is spread / sqrt(2 n).
      EXPECT_NEAR(spread / stated, 1, proof ? 0.15 : 4.5 / std::sqrt(2 * n)) << name;
      if (proof) {
        EXPECT_GE(share, 0.91) << name;
        EXPECT_LE(share, 0.99) << name;
        std::printf("%-40s spread / u %.3f, covered %.3f\n", name.c_str(), spread / stated, share);
      }
      covered += share / double(truth_.size());
    }
    std::printf("%d labs, %d quantities: 95 %% intervals cover in %.2f %%\n", labs_,
                static_cast<int>(truth_.size()), 100 * covered);
    // Quantities of a lab share its noise: a handful of many are as if they were independent.
    constexpr double kIndependent = 4;
    constexpr std::size_t kMany = 10;
    if (truth_.size() < kMany) return;
    EXPECT_NEAR(covered, kCovered,
                proof ? 0.01 : 4.5 * std::sqrt(kCovered * (1 - kCovered) / (labs_ * kIndependent)));
  }

 private:
  static constexpr double kInterval = 1.959964;
  struct Tally {
    double sum = 0, squares = 0, u_squares = 0;  // of errors; of stated uncertainties
    int covered = 0, labs = 0;
  };

  Quantities truth_;
  std::map<std::string, Tally> tallies_;
  int labs_ = 0;
};

}  // namespace luxfield::photometry
