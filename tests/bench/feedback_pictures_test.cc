#include "luxfield/bench/feedback_pictures.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tests/core/memory_folder.h"

namespace luxfield::bench {
namespace {

// One row: the whole face +x, half +x and half -y, nothing hit.
Feedback ThreePixels() {
  constexpr float kMissed = std::numeric_limits<float>::quiet_NaN();
  Feedback feedback;
  feedback.width = 3;
  feedback.height = 1;
  feedback.radiance = core::Image(3, 1, 3);
  feedback.lights = {"environment"};
  feedback.light_shares = {core::Image(3, 1, 1)};
  feedback.light_share = feedback.variance_gain = feedback.lab_gain = core::Image(3, 1, 1);
  feedback.face_shares = core::Image(3, 1, 6);
  feedback.face_shares.plane(0)[0] = 1;
  feedback.face_shares.plane(0)[1] = feedback.face_shares.plane(3)[1] = 0.5f;
  for (int face = 0; face < 6; ++face) feedback.face_shares.plane(face)[2] = kMissed;
  return feedback;
}

TEST(FeedbackPictures, FacesAreMixedByTheirShares) {
  const auto folder = MemoryFolder() / ("luxfield_faces_" + std::to_string(::getpid()));
  WriteFeedback(ThreePixels(), folder);
  const cv::Mat shown = cv::imread((folder / "faces.png").string());
  std::filesystem::remove_all(folder);
  ASSERT_FALSE(shown.empty());
  // Red, green, blue of the legend's colours for +x and -y; a level for rounding.
  const cv::Vec3d x{0.9, 0.2, 0.2}, y{0.75, 0.3, 0.8};
  const auto expect = [&](int column, const cv::Vec3d& rgb) {
    const auto pixel = shown.at<cv::Vec3b>(0, column);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(pixel[2 - c], 255 * rgb[c], 1) << column << ", " << c;
  };
  expect(0, x);
  expect(1, 0.5 * x + 0.5 * y);
  expect(2, {0, 0, 0});
}

}  // namespace
}  // namespace luxfield::bench
