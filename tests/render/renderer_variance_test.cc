// What a frame states of its noise: by samples, by passes, with samples dealt out, and lit again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "tests/render/renderer_fixture.h"

namespace luxfield::render {
namespace {

using RendererVariance = RendererTest;

// The sum over a picture of two scaled lamps, two surface points a pixel, against the exact one,
// judged by the frame's own variance.
TEST_F(RendererVariance, SampledFramesMatchExactOnesWithinTheirVariance) {
  const auto file = WriteLamp("sampled", Lamp(3));
  const auto scene = Floor({Above(file, -0.5, 1), Above(file, 0.7, 2.5)});
  auto options = Unshadowed("windowed");
  options.antialias = 2;
  options.samples_per_pixel = 101;
  options.seed = 31;
  const Frame sampled = RenderWith(scene, options);
  options.estimator = "exact";
  const Frame exact = RenderWith(scene, options);
  double difference = 0, variance = 0, total = 0;
  for (int row = 0; row < exact.height; ++row)
    for (int column = 0; column < exact.width; ++column) {
      const double weights[3] = {0.2126, 0.7152, 0.0722};
      for (int c = 0; c < 3; ++c) {
        difference +=
            weights[c] * (sampled.radiance.at(c, row, column) - exact.radiance.at(c, row, column));
        total += weights[c] * exact.radiance.at(c, row, column);
      }
      variance += sampled.variance.at(0, row, column);
      if (exact.coverage.at(0, row, column) == 1 && exact.irradiance.at(1, row, column) > 0) {
        EXPECT_GT(sampled.samples.at(0, row, column), 0);
      }
    }
  SCOPED_TRACE(testing::Message() << "seed 31, total " << total << ", sigma "
                                  << std::sqrt(variance));
  EXPECT_LT(std::abs(difference), 4 * std::sqrt(variance));
  EXPECT_LT(std::sqrt(variance), 0.05 * total);
  EXPECT_GT(variance, 0);
}

// Dimming a lamp leaves the relative noise of its penumbra as it is. Where the squares of luminances
// fall below what float holds, the variance is 0 and no NaN.
TEST_F(RendererVariance, DimPicturesStateTheNoiseOfBrightOnes) {
  auto options = Unshadowed("exact");
  options.shadows = Shadows::kTraced;
  options.seed = 33;
  options.samples_per_pixel = 32;
  for (const char* estimator : {"exact", "gloss"}) {
    options.estimator = estimator;
    const auto lit = [&](float scale) {
      LightField lamp = Lamp(3);
      for (float& value : lamp.data) value *= scale;
      auto scene = Floor({Above(WriteLamp("dim", lamp), 0, 1)});
      scene::AppendQuad({0, -0.1, 0.9}, {0.2, 0, 0}, {0, 0.2, 0}, 0, scene.geometry);
      return RenderWith(scene, options);
    };
    const Frame bright = lit(1), dim = lit(0x1p-40f), dark = lit(0x1p-100f);
    int partly = 0;
    for (int row = 0; row < bright.height; ++row)
      for (int column = 0; column < bright.width; ++column) {
        const double variance = bright.variance.at(0, row, column);
        EXPECT_FALSE(std::isnan(dark.variance.at(0, row, column))) << row << ' ' << column;
        EXPECT_NEAR(dim.variance.at(0, row, column) * 0x1p80, variance, 1e-3 * variance)
            << row << ' ' << column;
        partly += variance > 0;
      }
    EXPECT_GT(partly, 5) << estimator;
  }
}

// With passes the variance is that of the mean between them, stratification included: over a
// picture the squared errors against `exact` must add up to it. Two rounds of passes are one longer
// one.
TEST_F(RendererVariance, VarianceOfPassesIsTheErrorSquared) {
  const auto file = WriteLamp("passes", Lamp(3));
  auto scene = Floor({Above(file, -0.5, 1), Above(file, 0.7, 2.5)});
  scene.camera = scene::Camera::LookAt({0.5, -2, 2}, {0, 0.3, 0}, {0, 0, 1}, 70, 96, 64);
  auto options = Unshadowed("exact");
  const Frame exact = RenderWith(scene, options);
  options.estimator = "windowed";
  options.samples_per_pixel = 256;
  options.seed = 32;
  options.passes = 16;
  const Frame first = RenderWith(scene, options);
  options.first_pass = 16;
  options.samples_per_pixel = 128;
  options.passes = 8;
  const Frame second = RenderWith(scene, options);
  for (const Frame& frame : {first, second, MeanFrame(first, 16, second, 8)}) {
    double square = 0, variance = 0, spread = 0;
    for (int row = 0; row < exact.height; ++row)
      for (int column = 0; column < exact.width; ++column) {
        const auto luminance = [&](const Frame& f) {
          return 0.2126 * f.radiance.at(0, row, column) + 0.7152 * f.radiance.at(1, row, column) +
                 0.0722 * f.radiance.at(2, row, column);
        };
        const double error = luminance(frame) - luminance(exact);
        const double stated = frame.variance.at(0, row, column);
        square += error * error;
        variance += stated;
        spread += (error * error - stated) * (error * error - stated);
      }
    std::printf("passes: squared error over stated variance %.3f +- %.3f, seed 32\n",
                square / variance, std::sqrt(spread) / variance);
    EXPECT_LT(std::abs(square - variance), 4 * std::sqrt(spread));
    EXPECT_LT(std::sqrt(spread), 0.2 * variance);
  }
}

// A density changes how many samples a pixel takes and not what is expected of them: pooled over
// each half, the difference to the closed form lies within what the picture states.
TEST_F(RendererVariance, SampleDensityDealsOutSamples) {
  const auto file = WriteLamp("density", Lamp(3));
  const auto scene = Floor({Above(file, -0.1, 1)});
  const Frame exact = RenderWith(scene, Unshadowed("exact"));
  for (const char* estimator : {"windowed", "cells", "exact"}) {
    SCOPED_TRACE(testing::Message() << estimator << ", seed 33");
    auto options = Unshadowed(estimator);
    options.seed = 33;
    options.passes = 3;
    const auto even = [&](int samples) {
      options.samples_per_pixel = samples;
      return RenderWith(scene, options);
    };
    const Frame few = even(24), many = even(192);
    options.samples_per_pixel = 48;
    options.sample_density = core::Image(2, 1, 1);
    options.sample_density.data = {0.5f, 4.0f};
    const Frame dealt = RenderWith(scene, options);
    double difference[2] = {}, variance[2] = {}, total[2] = {};
    for (int row = 0; row < dealt.height; ++row)
      for (int column = 0; column < dealt.width; ++column) {
        const int half = column < dealt.width / 2 ? 0 : 1;
        const Frame& same = half == 0 ? few : many;
        EXPECT_EQ(dealt.samples.at(0, row, column), same.samples.at(0, row, column));
        EXPECT_EQ(dealt.coverage.at(0, row, column), same.coverage.at(0, row, column));
        const auto luminance = [&](const Frame& frame) {
          return core::Luminance({frame.radiance.at(0, row, column),
                                  frame.radiance.at(1, row, column),
                                  frame.radiance.at(2, row, column)});
        };
        difference[half] += luminance(dealt) - luminance(exact);
        variance[half] += dealt.variance.at(0, row, column);
        total[half] += luminance(exact);
      }
    for (int half = 0; half < 2; ++half) {
      EXPECT_LE(std::abs(difference[half]), 4 * std::sqrt(variance[half]) + 1e-6 * total[half]);
      EXPECT_LT(std::sqrt(variance[half]), 0.05 * total[half]);
    }
  }
  auto options = Unshadowed("windowed");
  options.samples_per_pixel = 8;
  const Frame even = RenderWith(scene, options);
  options.sample_density = core::Image(1, 1, 1);
  options.sample_density.data = {0.01f};
  const Frame thin = RenderWith(scene, options);
  for (std::size_t i = 0; i < thin.samples.data.size(); ++i)
    EXPECT_EQ(thin.samples.data[i], even.samples.data[i] / 4) << "two of eight";
  options.sample_density.data = {1e-4f};
  EXPECT_THAT([&] { RenderWith(scene, options); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("sample density = ")));
}

// Pixels of density 0 are left dark and state no noise; pictures of parts add up to the whole one.
TEST_F(RendererVariance, PixelsOfNoSamplesStayDark) {
  const auto file = WriteLamp("left_out", Lamp(3));
  const auto scene = Floor({Above(file, -0.5, 1), Above(file, 0.7, 2.5)});
  auto options = Unshadowed("windowed");
  options.samples_per_pixel = 32;
  options.sample_density = core::Image(2, 1, 1);
  options.sample_density.data = {1, 0};
  const Frame half = RenderWith(scene, options);
  EXPECT_GT(half.variance_scale, 0);
  double lit = 0;
  for (int row = 0; row < half.height; ++row)
    for (int column = 0; column < half.width; ++column)
      for (const auto* image : {&half.radiance, &half.variance, &half.samples}) {
        if (column >= half.width / 2) {
          EXPECT_EQ(image->at(0, row, column), 0);
        }
        lit += image == &half.samples ? image->at(0, row, column) : 0;
      }
  EXPECT_GT(lit, 0);
  // Each pixel as one of them has it.
  core::Image left(half.width, half.height, 1), right = left;
  for (int row = 0; row < half.height; ++row)
    for (int column = 0; column < half.width; ++column)
      (column < half.width / 2 ? left : right).at(0, row, column) = 1;
  options.sample_density.data = {0, 1};
  const Frame other = RenderWith(scene, options), mean = MeanFrame(half, left, other, right);
  EXPECT_EQ(half.coverage.data, other.coverage.data);
  for (std::size_t i = 0; i < mean.samples.data.size(); ++i) {
    EXPECT_EQ(mean.samples.data[i], half.samples.data[i] + other.samples.data[i]);
    EXPECT_EQ(mean.radiance.data[i], half.radiance.data[i] + other.radiance.data[i]);
    EXPECT_EQ(mean.variance.data[i], half.variance.data[i] + other.variance.data[i]);
  }
  EXPECT_NEAR(mean.variance_scale * SumOf(mean.stated_variance), SumOf(mean.variance),
              1e-5 * SumOf(mean.variance));
}

// Passes together state what they state alone.
TEST_F(RendererVariance, PassesKeepWhatTheyStateThemselves) {
  const auto file = WriteLamp("stated", Lamp(3));
  const auto scene = Floor({Above(file, -0.5, 1), Above(file, 0.7, 2.5)});
  auto options = Unshadowed("windowed");
  options.samples_per_pixel = 20;
  options.relight = false;
  const Frame first = RenderWith(scene, options);
  EXPECT_EQ(first.stated_variance.data, first.variance.data);
  EXPECT_EQ(first.variance_scale, 1);
  options.first_pass = 1;
  const Frame second = RenderWith(scene, options);
  options.first_pass = 0;
  options.passes = 2;
  options.samples_per_pixel = 40;
  const Frame both = RenderWith(scene, options);
  const Frame mean = MeanFrame(first, 20, second, 20);
  double between = 0, stated = 0;
  for (std::size_t i = 0; i < both.variance.data.size(); ++i) {
    const float expected = (first.variance.data[i] + second.variance.data[i]) / 4;
    EXPECT_NEAR(both.stated_variance.data[i], expected, 1e-6 * expected);
    EXPECT_NEAR(mean.stated_variance.data[i], expected, 1e-6 * expected);
    between += both.variance.data[i];
    stated += both.stated_variance.data[i];
  }
  EXPECT_LT(between, stated);  // stratified
}

// Pixels that are lit again change what is said of the noise and nothing else, whatever the samples
// of a pixel and the surface points are.
TEST_F(RendererVariance, RelitPixelsScaleTheVarianceAlone) {
  const auto file = WriteLamp("relit", Lamp(3));
  const auto scene = Floor({Above(file, -0.5, 1), Above(file, 0.7, 2.5)});
  auto options = Unshadowed("windowed");
  options.samples_per_pixel = 128;
  options.antialias = 2;
  options.sample_density = core::Image(2, 1, 1);
  options.sample_density.data = {0.5f, 4.0f};
  const Frame relit = RenderWith(scene, options);
  options.relight = false;
  const Frame plain = RenderWith(scene, options);
  EXPECT_EQ(relit.radiance.data, plain.radiance.data);
  EXPECT_EQ(relit.samples.data, plain.samples.data);
  EXPECT_EQ(relit.stated_variance.data, plain.variance.data);
  EXPECT_LT(relit.variance_scale, 0.9);  // stratified
  EXPECT_GT(relit.scale_log_variance, 0);
  EXPECT_LT(relit.scale_log_variance, 0.1);
  for (std::size_t i = 0; i < plain.variance.data.size(); ++i)
    EXPECT_NEAR(relit.variance.data[i], relit.variance_scale * plain.variance.data[i],
                1e-5 * plain.variance.data[i]);
  // Means of two keep what both know.
  options.relight = true;
  options.first_pass = 1;
  const Frame other = RenderWith(scene, options), mean = MeanFrame(relit, 1, other, 1);
  EXPECT_NE(relit.variance_scale, other.variance_scale);
  EXPECT_LT(std::abs(std::log(other.variance_scale / relit.variance_scale)),
            4 * std::sqrt(relit.scale_log_variance + other.scale_log_variance));
  EXPECT_LT(mean.variance_scale, std::max(relit.variance_scale, other.variance_scale));
  EXPECT_GT(mean.variance_scale, std::min(relit.variance_scale, other.variance_scale));
  EXPECT_LT(mean.scale_log_variance,
            0.7 * std::max(relit.scale_log_variance, other.scale_log_variance));
  // Nothing random, nothing lit again.
  options.estimator = "exact";
  EXPECT_EQ(RenderWith(scene, options).variance_scale, 1);
}

}  // namespace
}  // namespace luxfield::render
