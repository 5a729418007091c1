// Which of two settings `render --time` prefers.
#include <gtest/gtest.h>

#include "luxfield/render/accuracy/accuracy.h"

namespace luxfield::render {
namespace {

Setting Predicted(double time_s, double error) {
  Setting setting;
  setting.predicted_s = time_s;
  setting.predicted_error = error;
  return setting;
}

TEST(IsBetter, TheLeastErrorWithinTheTimeAndElseTheLeastTime) {
  AccuracyRequest request;
  request.time_s = 2;
  const auto expect = [&](const Setting& better, const Setting& worse) {
    EXPECT_TRUE(IsBetter(request, better, worse));
    EXPECT_FALSE(IsBetter(request, worse, better));
  };
  expect(Predicted(1.9, 0.1), Predicted(1, 0.5));
  expect(Predicted(1, 0.1), Predicted(1.9, 0.5));
  expect(Predicted(1.9, 0.5), Predicted(2.1, 0.1));
  expect(Predicted(2.001, 0.1), Predicted(1.9, 0.5));  // but for rounding
  expect(Predicted(3, 0.5), Predicted(4, 0.1));
}

}  // namespace
}  // namespace luxfield::render
