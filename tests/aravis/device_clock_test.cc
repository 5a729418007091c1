#include "luxfield/hal/drivers/aravis/device_clock.h"

#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/core/random.h"

namespace luxfield::hal::aravis {
namespace {

// Frames of a camera whose clock runs fast by `drift`, begun up to `late_s` after their triggers
// and here `transfer_s` after their ends.
struct Link {
  double drift = 0, late_s = 2e-3, transfer_s = 0.03, exposure_s = 0.01;
  bool at_end = false;  // what the camera stamps
};

// Largest jump of reported less true times from frame to frame, and how many there are.
struct Jumps {
  double largest_s = 0;
  int count = 0;
};
Jumps JumpsOf(const Link& link, int frames) {
  core::Random random(4, 1);
  DeviceClock clock;
  Jumps jumps;
  double now_s = 1000, before_s = 0;
  for (int n = 0; n < frames; ++n) {
    const double sent_s = now_s, start_s = sent_s + link.late_s * random.Uniform();
    const double end_s = start_s + link.exposure_s, received_s = end_s + link.transfer_s;
    const double stamped_s = (link.at_end ? end_s : start_s) * (1 + link.drift) + 5e8;
    const double found_s = clock.StartOf(static_cast<std::uint64_t>(std::llround(1e9 * stamped_s)),
                                         sent_s, received_s - link.exposure_s);
    EXPECT_GE(found_s, sent_s);
    EXPECT_LE(found_s + link.exposure_s, received_s);
    const double error_s = found_s - start_s, jump_s = std::abs(error_s - before_s);
    if (n > 0 && jump_s > 1e-6 + std::abs(link.drift)) {
      jumps.largest_s = std::max(jumps.largest_s, jump_s);
      ++jumps.count;
    }
    before_s = error_s;
    now_s = received_s + 0.05 * random.Uniform();
  }
  return jumps;
}

TEST(DeviceClock, DifferencesAreTheCamerasOwn) {
  EXPECT_LE(JumpsOf({}, 500).count, 3) << "until the quickest trigger is known";
  Link at_end;
  at_end.at_end = true;
  EXPECT_LE(JumpsOf(at_end, 500).count, 3);
}

// No exposure began before its trigger was sent, though its frame should have come sooner than its
// exposure lasts; and every stamp but 0 is one, the first nanosecond too.
TEST(DeviceClock, BeginsNothingBeforeItsTriggerAndTakesEveryStamp) {
  DeviceClock clock;
  EXPECT_EQ(clock.StartOf(0, 9, 9.5), 9);
  EXPECT_EQ(clock.StartOf(1, 10, 9.9), 10);
  EXPECT_NEAR(clock.StartOf(1 + 1'000'000'000, 10.999, 11.5), 11, 1e-9);
}

TEST(DeviceClock, ClocksThatDriftApartAreBroughtTogetherNowAndThen) {
  for (const double drift : {-50e-6, 50e-6}) {
    Link link;
    link.drift = drift;
    const Jumps jumps = JumpsOf(link, 20'000);  // twenty minutes
    EXPECT_GT(jumps.count, 0);
    EXPECT_LT(jumps.count, 200);
    EXPECT_LT(jumps.largest_s, 0.04) << "never more than is possible";
  }
}

TEST(DeviceClock, ACameraWithoutOneHasTheTriggersTime) {
  DeviceClock clock;
  EXPECT_EQ(clock.StartOf(0, 12.5, 12.6), 12.5);
  EXPECT_EQ(clock.StartOf(0, 13.5, 13.4), 13.5);
}

TEST(DeviceClock, AClockThatStandsStillOrBeginsAnewIsNotBelieved) {
  DeviceClock clock;
  double sent_s = 0;
  for (const std::uint64_t stamp : {5'000'000'000UL, 5'000'000'000UL, 7UL, 0UL}) {
    sent_s += 10;
    const double start_s = clock.StartOf(stamp, sent_s, sent_s + 0.02);
    EXPECT_GE(start_s, sent_s);
    EXPECT_LE(start_s, sent_s + 0.02);
  }
}

}  // namespace
}  // namespace luxfield::hal::aravis
