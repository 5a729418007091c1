#include "luxfield/render/accuracy/cost_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/render/estimators/estimator.h"
#include "tests/cache_folder.h"

namespace luxfield::render {
namespace {

constexpr LightingWork kWork{
    .pixels = 1e5, .images = 1e7, .texels = 1e9, .samples = 1e6, .rays = 1e6};

// Fitted times follow the measured ones: the model is for choosing, a factor of 2 is its claim.
TEST(CostModel, FitsWhatItWasMeasuredOnAndIsKept) {
  const CacheFolder cache("cost_model");
  const auto device = Device::Open();
  std::vector<CalibrationRun> runs;
  const CostModel model = Calibrate(device, &runs);
  EXPECT_TRUE(model.Knows("exact"));
  EXPECT_FALSE(model.Knows("thesis"));
  ASSERT_FALSE(runs.empty());
  for (const auto& run : runs) {
    EXPECT_GT(run.measured_s, 0);
    EXPECT_GT(run.predicted_s, 0);
    EXPECT_DOUBLE_EQ(run.predicted_s, model.Seconds(run.estimator, run.work));
  }
  ASSERT_TRUE(KeepCostModel(device, model));
  const CostModel kept = CurrentCostModel(device);
  for (const auto& [name, coefficients] : model.coefficients_s)
    for (std::size_t a = 0; a < coefficients.size(); ++a)
      EXPECT_DOUBLE_EQ(kept.coefficients_s.at(name)[a], coefficients[a]);
}

TEST(CostModel, IsShippedForEveryEstimatorThatMayBeChosen) {
  const auto device = Device::Open();
  const CostModel shipped = ShippedCostModel(device);
  for (const auto& traits : EstimatorList()) {
    EXPECT_EQ(shipped.Knows(traits.name), traits.unbiased || traits.noise_free) << traits.name;
    if (!shipped.Knows(traits.name)) continue;
    for (const double coefficient : shipped.coefficients_s.at(traits.name))
      EXPECT_GE(coefficient, 0);
    EXPECT_GT(shipped.Seconds(traits.name, kWork), 0);
  }
}

// A picture moves one estimator's costs a quarter of the way, and one wild measurement, as of a
// machine that slept, by no more than a factor of 2.
TEST(CostModel, IsRefinedByWhatPicturesTake) {
  CostModel model;
  model.coefficients_s["exact"] = {1e-3, 1e-6, 1e-8, 1e-11, 0, 0};
  model.coefficients_s["windowed"] = {0, 0, 0, 0, 1e-7, 0};
  const double before_s = model.Seconds("exact", kWork);
  Refine(model, "exact", kWork, 1.5 * before_s);
  EXPECT_NEAR(model.Seconds("exact", kWork), std::pow(1.5, 0.25) * before_s, 1e-12 * before_s);
  for (int picture = 0; picture < 60; ++picture) Refine(model, "exact", kWork, 1.5 * before_s);
  EXPECT_NEAR(model.Seconds("exact", kWork), 1.5 * before_s, 1e-6 * before_s);
  const double settled_s = model.Seconds("exact", kWork);
  Refine(model, "exact", kWork, 1e6 * settled_s);
  EXPECT_NEAR(model.Seconds("exact", kWork), 2 * settled_s, 1e-9 * settled_s);
  Refine(model, "exact", kWork, 1e-9 * settled_s);
  EXPECT_NEAR(model.Seconds("exact", kWork), settled_s, 1e-9 * settled_s);
  EXPECT_DOUBLE_EQ(model.Seconds("windowed", kWork), 0.1);
  // Nothing is learnt of estimators that the model does not know, nor from no time at all.
  Refine(model, "thesis", kWork, 1);
  EXPECT_FALSE(model.Knows("thesis"));
  Refine(model, "windowed", kWork, 0);
  EXPECT_DOUBLE_EQ(model.Seconds("windowed", kWork), 0.1);
}

}  // namespace
}  // namespace luxfield::render
