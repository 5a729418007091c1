#include "luxfield/render/accuracy/cost_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/render/accuracy/accuracy.h"
#include "luxfield/render/accuracy/choose_setting.h"
#include "luxfield/render/estimators/estimator.h"
#include "tests/cache_folder.h"
#include "tests/render/small_scene.h"

namespace luxfield::render {
namespace {

constexpr LightingWork kWork{
    .pixels = 1e5, .images = 1e7, .texels = 1e9, .samples = 1e6, .rays = 1e6};

// Fitted times follow the measured ones: the model is for choosing, a factor of 2 is its claim.
TEST(CostModel, FitsWhatItWasMeasuredOnAndIsKept) {
  const auto device = Device::Open();  // first: PoCL keeps kernels where the cache is then
  const CacheFolder cache("cost_model");
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
  for (const bool is_cpu : {true, false}) {
    DeviceInfo few, many;
    few.is_cpu = many.is_cpu = is_cpu;
    few.compute_units = 2;
    many.compute_units = 200;
    const CostModel of_few = ShippedCostModel(few), of_many = ShippedCostModel(many);
    for (const auto& traits : EstimatorList()) {
      ASSERT_EQ(of_few.Knows(traits.name), traits.unbiased || traits.noise_free) << traits.name;
      if (!of_few.Knows(traits.name)) continue;
      for (const double coefficient : of_few.coefficients_s.at(traits.name))
        EXPECT_GE(coefficient, 0);
      // A launch takes what it takes, the rest is shared by all units.
      const double launch_s = of_few.Seconds(traits.name, {}),
                   rest_s = of_few.Seconds(traits.name, kWork) - launch_s;
      EXPECT_GT(rest_s, 0);
      EXPECT_DOUBLE_EQ(of_many.Seconds(traits.name, {}), launch_s);
      EXPECT_NEAR(of_many.Seconds(traits.name, kWork) - launch_s, rest_s / 100, 1e-9 * rest_s);
    }
  }
  DeviceInfo unknown;  // some drivers state no units
  unknown.compute_units = 0;
  EXPECT_TRUE(std::isfinite(ShippedCostModel(unknown).Seconds("cells", kWork)));
}

// Processor time where other programs may hold the cores, the clock's of devices of their own.
TEST(CostModel, CountsTimesLikeTheDevice) {
  const Device device = Device::Open();
  RenderTimes times;
  times.lighting_s = 3;
  times.lighting_core_s = 5;
  EXPECT_DOUBLE_EQ(LightingSeconds(device, times),
                   device.info().is_cpu ? 5.0 / device.info().compute_units : 3.0);
}

// The device's own model begins with the shipped one, and has what a picture took afterwards.
TEST(CostModel, APictureOfAnErrorRefinesTheDevicesOwn) {
  LitScene scene(Device::Open(), LampOverFloor());
  const CacheFolder cache("refined");
  const auto cells = [&] { return CurrentCostModel(scene.device()).coefficients_s.at("cells"); };
  const auto shipped = ShippedCostModel(scene.device().info()).coefficients_s.at("cells");
  EXPECT_EQ(cells(), shipped);
  AccuracyRequest request;
  request.rel_error = 0.2;
  request.estimators = {"cells"};
  const AccurateFrame result = RenderToAccuracy(scene, request);
  EXPECT_TRUE(result.met);
  EXPECT_GT(result.first_s, 0);
  EXPECT_GT(result.first_work.samples, 0);
  CostModel expected = ShippedCostModel(scene.device().info());
  Refine(expected, "cells", result.first_work, result.first_s);
  EXPECT_NE(cells(), shipped);
  for (std::size_t a = 0; a < shipped.size(); ++a)
    EXPECT_DOUBLE_EQ(cells()[a], expected.coefficients_s.at("cells")[a]);
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
