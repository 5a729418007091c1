// Debevec & Malik's published problem against another program's solutions.
#include "luxfield/reconstruct/calibrate/response/published_response.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "frobisher.h"

namespace luxfield::reconstruct {
namespace {

// colour-hdri's solution on a Canon 5D Mark II's JPEGs.
TEST(PublishedResponse, AgreesWithForeignCurvesOfTheFrobisherStack) {
  LUXFIELD_NEEDS_DATA(FrobisherFile(""));
  const PictureStack stack = FrobisherStack();
  const std::vector<double> exposures = {0.125, 1, 8};
  for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(stack.pictures[k].exposure_s, exposures[k]);
  for (int channel = 0; channel < 3; ++channel) {
    const auto expected = FrobisherCurve(channel);
    ASSERT_EQ(expected.size(), 256u);
    const auto curve =
        FitPublishedResponse(HistogramSamples(stack, channel, 1000), exposures, 128, "Frobisher")
            .curve;
    double largest = 0;
    for (std::size_t k = 0; k < curve.code.size(); ++k)
      largest = std::max(largest, std::abs(curve.log_exposure[k] -
                                           expected[static_cast<std::size_t>(curve.code[k])]));
    std::cout << fmt::format("channel {}: codes {} to {}, largest difference of g {:.2e}\n",
                             channel, curve.low_code(), curve.high_code(), largest);
    EXPECT_LT(largest, 1e-5);
    EXPECT_LE(curve.low_code(), 5);
    EXPECT_GE(curve.high_code(), 250);
  }
}

// The weights of the published problem, a hat over the codes from 1 % to 99 %.
double Hat(int code) {
  const double x = code / 255.0;
  return std::max(0.0, std::min(x - 0.01, 0.99 - x)) / 0.49;
}

// ln X of every sample by colour-hdri, solved for together with g: what minimises its squares,
// sum w^2 (g(z) - ln t) / sum w^2, with our g, t in units of the longest exposure. Samples that no
// exposure counts of are left out (it has 0 there), and those with a code at which ours is not
// calibrated.
TEST(PublishedResponse, AgreesWithForeignRadiancesOfTheFrobisherStack) {
  LUXFIELD_NEEDS_DATA(FrobisherFile(""));
  const PictureStack stack = FrobisherStack();
  const std::vector<double> exposures = {0.125, 1, 8};
  for (int channel = 0; channel < 3; ++channel) {
    const auto expected =
        core::ReadNpy(FrobisherFile(fmt::format("calibration__test_g_solve_lE_{}.npy", channel)));
    const ResponseSamples samples = HistogramSamples(stack, channel, 1000);
    ASSERT_EQ(expected.size(), 1000u);
    const ResponseCurve curve = FitPublishedResponse(samples, exposures, 128, "Frobisher").curve;
    double largest = 0;
    int compared = 0, left_out = 0;
    for (int i = 0; i < samples.count(); ++i) {
      double weights = 0, sum = 0;
      bool calibrated = true;
      for (int j = 0; j < samples.exposures; ++j) {
        const int code = samples.code[samples.index(i, j)];
        const double weight = std::pow(Hat(code), 2);
        if (weight == 0) continue;
        calibrated = calibrated && code >= curve.low_code() && code <= curve.high_code();
        weights += weight;
        sum += weight * (curve.LogExposure(code) -
                         std::log(exposures[static_cast<std::size_t>(j)] / exposures.back()));
      }
      if (weights == 0 || !calibrated) {
        ++left_out;
        continue;
      }
      ++compared;
      largest = std::max(largest, std::abs(sum / weights - expected[static_cast<std::size_t>(i)]));
    }
    std::cout << fmt::format(
        "channel {}: {} samples, {} left out, largest difference of ln X {:.2e}\n", channel,
        compared, left_out, largest);
    EXPECT_GT(compared, 950);
    EXPECT_LT(largest, 1e-5);
  }
}

// colour-hdri's exposures over codes: exp g up to a factor, where its weights are not 0. Beyond, at
// three codes on either side, it goes on with a polynomial, on the dark side below 0; ours ends.
TEST(PublishedResponse, AgreesWithForeignResponseFunctionsOfTheFrobisherStack) {
  LUXFIELD_NEEDS_DATA(FrobisherFile(""));
  const PictureStack stack = FrobisherStack();
  const std::vector<double> exposures = {0.125, 1, 8};
  const auto expected = core::ReadNpy(
      FrobisherFile("calibration__test_camera_response_function_Debevec1997_crfs.npy"));
  ASSERT_EQ(expected.size(), 3 * 256u);
  for (int channel = 0; channel < 3; ++channel) {
    const auto theirs = [&](double code) {
      return expected[3 * static_cast<std::size_t>(code) + static_cast<std::size_t>(channel)];
    };
    const ResponseCurve curve =
        FitPublishedResponse(HistogramSamples(stack, channel, 1000), exposures, 128, "Frobisher")
            .curve;
    double largest = 0;
    for (std::size_t k = 0; k < curve.code.size(); ++k)
      largest = std::max(
          largest,
          std::abs(std::exp(curve.log_exposure[k]) * theirs(128) / theirs(curve.code[k]) - 1));
    std::cout << fmt::format("channel {}: largest relative difference {:.2e}\n", channel, largest);
    EXPECT_LT(largest, 1e-5);
    EXPECT_DOUBLE_EQ(theirs(255), 1);
  }
}

TEST(PublishedResponse, RefusesWhatSettlesNoCurve) {
  const std::vector<double> times = {1, 2};
  // Nothing but black and white.
  EXPECT_THROW(FitPublishedResponse(
                   {2, std::vector<std::uint16_t>(400, 255), std::vector<std::uint8_t>(400, 0)},
                   times, 128, "test"),
               InputError);
  // Codes that fall with exposure.
  ResponseSamples falling{2, {}, {}};
  for (int n = 0; n < 200; ++n)
    for (const int code : {230 - n, 200 - n}) {
      falling.code.push_back(static_cast<std::uint16_t>(code));
      falling.usable.push_back(1);
    }
  EXPECT_THROW(FitPublishedResponse(falling, times, 128, "test"), InputError);
}

}  // namespace
}  // namespace luxfield::reconstruct
