#include "luxfield/bench/bench_capture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>

#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"

namespace luxfield::bench {
namespace {

TEST(BenchCapture, TakesEveryFrameOfBothSessions) {
  BenchCaptureOptions options;
  options.side = 32;
  options.exposures = 12;
  options.exposure_s = 0.002;
  options.stream_frames = 20;
  options.stream_fps = 100;
  options.folder = std::filesystem::path(testing::TempDir()) /
                   ("luxfield_bench_capture_" + std::to_string(::getpid()));
  const nlohmann::json rows = BenchCapture(options);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0]["case"], "overhead");
  EXPECT_EQ(rows[0]["frames"], 24);
  EXPECT_GT(rows[0]["overhead_ms"].get<double>(), 0);
  EXPECT_NEAR(rows[0]["overhead_share"].get<double>(), rows[0]["overhead_ms"].get<double>() / 2,
              1e-9);
  EXPECT_EQ(rows[1]["case"], "stream");
  EXPECT_EQ(rows[1]["frames"], 20);
  EXPECT_GE(rows[1]["missed"].get<int>(), 0);
  for (const auto& row : rows) {
    ASSERT_EQ(row["peaks_mib"].size(), 10u);
    for (const auto& peak : row["peaks_mib"]) EXPECT_GT(peak.get<double>(), 0);
  }
  EXPECT_TRUE(std::filesystem::is_empty(options.folder));
  options.side = 0;
  EXPECT_THROW(BenchCapture(options), InputError);
}

// A window that could not open watches nothing: no row is made of that.
TEST(BenchCapture, AWindowThatDoesNotStayOpenIsTold) {
  if (!std::filesystem::exists(LUXFIELD_BINARY_DIR "/luxfield-view"))
    GTEST_SKIP() << "luxfield-view is not built";
  BenchCaptureOptions options;
  options.side = 32;
  options.exposures = 12;
  options.exposure_s = 0.002;
  options.stream_frames = 30;  // 3 s, in which the window's program finds no display
  options.stream_fps = 10;
  options.watched = true;
  options.folder = std::filesystem::path(testing::TempDir()) /
                   ("luxfield_bench_watched_" + std::to_string(::getpid()));
  ::unsetenv("DISPLAY");
  ::unsetenv("WAYLAND_DISPLAY");
  EXPECT_THAT([&] { BenchCapture(options); },
              testing::ThrowsMessage<DeviceError>(testing::HasSubstr("did not stay open")));
}

}  // namespace
}  // namespace luxfield::bench
