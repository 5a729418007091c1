// Exposure times found from a session's frames, on a simulated lab whose shutter opens too long.
#include "luxfield/reconstruct/merge/session_exposures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/reconstruct/merge/merge_session.h"
#include "tests/core/chi_squared.h"
#include "tests/planning/lab_session.h"

namespace luxfield::planning {
namespace {

const std::string kLab = std::string(R"(
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.03
[lamp]
kind = "square"
side_m = 0.03
depth_m = 0.05
radiance = 1e7
[camera]
width = 96
height = 96
pitch_m = 0.004
responsivity_e_per_s_per_w_m2 = [1200]
)") + planning::kCameraCodes +
                         planning::kStage + planning::kCameraNoise;

constexpr const char* kPlan = R"(
[plan]
unit = "lm"
dark_repeats = 4
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.03
[grid]
width = 3
height = 3
[lattice]
width = 20
height = 20
ds_m = 0.016
[exposure]
min_s = 0.001
max_s = 4.2
floor_sigmas = 100
[reference]
every = 0
[warm_up]
window_s = 10
)";

planning::LabSession Capture(const std::string& name, const std::string& errors, bool ideal,
                             int seed = 12) {
  const std::string lab =
      fmt::format("[lab]\ndriver = \"sim\"\nseed = {}\nideal = {}\n", seed, ideal);
  return LabSession("session_exposures_" + name, lab + kLab + errors, kPlan);
}

struct Pulls {
  double mean = 0, rms = 0, relative = 0;  // relative: root mean square of the relative deviation
};

Pulls Compare(const lightfield::Measurements& m, const lightfield::Measurements& truth) {
  Pulls pulls;
  double n = 0;
  for (std::size_t k = 0; k < m.positions.size(); ++k)
    for (std::size_t p = 0; p < m.positions[k].mask.size(); ++p) {
      if (m.positions[k].mask[p] || truth.positions[k].mask[p]) continue;
      const double off = m.positions[k].irradiance[p] - truth.positions[k].irradiance[p],
                   pull = off / m.positions[k].sigma[p];
      pulls.mean += pull;
      pulls.rms += pull * pull;
      pulls.relative += std::pow(off / truth.positions[k].irradiance[p], 2);
      ++n;
    }
  return {pulls.mean / n, std::sqrt(pulls.rms / n), std::sqrt(pulls.relative / n)};
}

constexpr double kOffset_s = 5e-5;
constexpr const char* kOffset = "[errors.shutter]\noffset_s = 5e-5\n";

// (ratio - true ratio) / sigma of the rungs that were found.
std::vector<double> RatioPulls(const std::vector<reconstruct::RungExposure>& rungs) {
  const double longest_s = rungs.front().exposure_s;
  std::vector<double> pulls;
  for (const auto& rung : rungs) {
    const double expected = (1 + kOffset_s / rung.exposure_s) / (1 + kOffset_s / longest_s);
    if (rung.known && rung.ratio.sigma > 0)
      pulls.push_back((rung.ratio.value - expected) / rung.ratio.sigma);
  }
  return pulls;
}

TEST(SessionExposures, FindsAShutterThatOpensTooLong) {
  const planning::LabSession ideal_lab = Capture("truth", "", true),
                             lab = Capture("offset", kOffset, false);
  const auto truth = reconstruct::MergeSession(ideal_lab.Read());
  const session::SessionReader session = lab.Read();
  reconstruct::MergeSessionOptions options;
  const Pulls stated = Compare(reconstruct::MergeSession(session, options), truth);
  options.estimate_exposures = true;
  reconstruct::MergeSessionSummary summary;
  const Pulls estimated = Compare(reconstruct::MergeSession(session, options, &summary), truth);
  std::printf("relative error of E: as stated %.4f %%, estimated %.4f %% (pulls %.2f, %.2f)\n",
              100 * stated.relative, 100 * estimated.relative, stated.rms, estimated.rms);
  EXPECT_GE(RatioPulls(summary.exposures).size(), 4u);
  EXPECT_GT(stated.relative, 2 * estimated.relative);
  EXPECT_GT(stated.rms, 1.5);
  EXPECT_LT(estimated.rms, 1.15);
}

TEST(SessionExposures, RatiosErrAsTheirSigmasSay) {
  // Ratios of one lab share the longest exposure's noise, so that they correlate by about a half:
  // four of them and more are worth two degrees at least.
  constexpr int kLabs = 12, kDegrees = 2 * kLabs;
  double mean = 0;
  for (int n = 0; n < kLabs; ++n) {
    reconstruct::MergeSessionOptions options;
    options.estimate_exposures = true;
    reconstruct::MergeSessionSummary summary;
    reconstruct::MergeSession(Capture("pulls", kOffset, false, 100 + n).Read(), options, &summary);
    const std::vector<double> pulls = RatioPulls(summary.exposures);
    ASSERT_GE(pulls.size(), 4u);
    for (const double pull : pulls) mean += pull * pull / static_cast<double>(pulls.size()) / kLabs;
  }
  std::printf("ratios of %d labs: chi-squared per degree of freedom %.3f\n", kLabs, mean);
  EXPECT_GT(mean, ChiSquaredShare(kDegrees, -kRareZ));
  EXPECT_LT(mean, ChiSquaredShare(kDegrees, kRareZ));
}

TEST(SessionExposures, StandardErrorsKnowWhatFramesOfOneRungScatter) {
  // A jitter of 2e-5 s, 2 % of the shortest exposure: far above the noise of the pixels.
  const planning::LabSession lab = Capture("jitter", "[errors.shutter]\njitter_s = 2e-5\n", false);
  reconstruct::MergeSessionOptions options;
  options.estimate_exposures = true;
  reconstruct::MergeSessionSummary summary;
  reconstruct::MergeSession(lab.Read(), options, &summary);
  const auto& shortest = summary.exposures.back();
  ASSERT_TRUE(shortest.known);
  EXPECT_NEAR(shortest.ratio.value, 1, 4 * shortest.ratio.sigma);
  // Nine frames of it at most.
  EXPECT_GT(shortest.ratio.sigma * shortest.exposure_s, 2e-5 / 3 / 3);
  EXPECT_LT(shortest.ratio.sigma * shortest.exposure_s, 2e-5);
}

}  // namespace
}  // namespace luxfield::planning
