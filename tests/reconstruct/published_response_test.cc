// Debevec & Malik's published problem against another program's solutions.
#include "reconstruct/published_response.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "frobisher.h"

namespace luxfield::reconstruct {
namespace {

// colour-hdri's solution on a Canon 5D Mark II's JPEGs.
TEST(PublishedResponse, AgreesWithForeignCurvesOfTheFrobisherStack) {
  if (!FrobisherExists()) GTEST_SKIP() << "no Frobisher stack in " << FrobisherFile("");
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
