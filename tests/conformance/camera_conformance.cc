#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <limits>

#include "tests/conformance/device_bench.h"

namespace luxfield::hal {
namespace {

constexpr double kLong_s = 30;  // more than any operation of a bench takes

// An exposure in the lower part of the camera's range: of its list, or whole microseconds.
double SomeExposure(const CameraCapabilities& can, double factor) {
  const double exposure_s = std::max(can.min_exposure_s, 1e-3) * factor;
  const auto& list = can.exposures_s;
  if (!list.empty())
    return *std::min(std::lower_bound(list.begin(), list.end(), exposure_s), list.end() - 1);
  return 1e-6 * std::ceil(1e6 * exposure_s);
}

}  // namespace

TEST_P(CameraConformance, SaysWhatItIs) {
  EXPECT_FALSE(device().identity().empty());
  const CameraCapabilities can = device().capabilities();
  EXPECT_GT(can.width, 0);
  EXPECT_GT(can.height, 0);
  EXPECT_GE(can.bits, 8);
  EXPECT_GT(can.min_exposure_s, 0);
  EXPECT_GT(can.max_exposure_s, can.min_exposure_s);
  EXPECT_GE(can.readout_s, 0);
}

TEST_P(CameraConformance, DoesNotExposeBeforeItIsConfigured) {
  EXPECT_EQ(FaultOf([&] { device().Expose(In(kLong_s)); }), Fault::kRefused);
}

TEST_P(CameraConformance, RefusesExposuresBeyondItsRange) {
  const CameraCapabilities can = device().capabilities();
  for (const double wrong_s : {0.5 * can.min_exposure_s, 2 * can.max_exposure_s, -1.0,
                               std::numeric_limits<double>::quiet_NaN()})
    EXPECT_EQ(FaultOf([&] { device().Configure({wrong_s}, In(kLong_s)); }), Fault::kOutOfRange)
        << wrong_s;
}

TEST_P(CameraConformance, ReadsBackWhatItIsSetTo) {
  const CameraCapabilities can = device().capabilities();
  std::uint64_t last_epoch = 0;
  for (const double factor : {2.0, 5.0, 1.0, 5.0}) {
    const double wanted_s = SomeExposure(can, factor);
    const AppliedSettings applied = device().Configure({wanted_s}, In(kLong_s));
    EXPECT_NEAR(applied.exposure_s, wanted_s, std::max(can.exposure_step_s, 1e-6));
    EXPECT_GT(applied.settings_epoch, std::exchange(last_epoch, applied.settings_epoch));
  }
}

TEST_P(CameraConformance, FramesAreNewOnesAndCarryTheirSettings) {
  const CameraCapabilities can = device().capabilities();
  std::uint64_t last_id = 0;
  for (const double factor : {2.0, 2.0, 1.0, 5.0}) {
    const AppliedSettings applied = device().Configure({SomeExposure(can, factor)}, In(kLong_s));
    const double asked_s = In(0);
    const Frame frame = device().Expose(In(kLong_s));
    EXPECT_GT(frame.frame_id, std::exchange(last_id, frame.frame_id));
    EXPECT_EQ(frame.settings.exposure_s, applied.exposure_s);
    EXPECT_EQ(frame.settings.settings_epoch, applied.settings_epoch);
    EXPECT_GE(frame.t_start_s, asked_s);
    EXPECT_GE(frame.t_end_s, frame.t_start_s);
    EXPECT_EQ(frame.image.width, can.width);
    EXPECT_EQ(frame.image.height, can.height);
    EXPECT_EQ(can.bits == 32 ? frame.image.value.size() : frame.image.dn.size(),
              frame.image.size());
  }
}

TEST_P(CameraConformance, AnExposureLongerThanItsDeadlineIsATimeoutAndNotTheEnd) {
  const CameraCapabilities can = device().capabilities();
  device().Configure({SomeExposure(can, 20)}, In(kLong_s));
  EXPECT_EQ(FaultOf([&] { device().Expose(In(1e-3)); }), Fault::kTimeout);
  // What was given up may take a moment to end.
  const double give_up_s = In(kLong_s);
  while (FaultOf([&] { device().Configure({SomeExposure(can, 1)}, In(kLong_s)); }) &&
         In(0) < give_up_s) {
  }
  EXPECT_EQ(device().Expose(In(kLong_s)).settings.exposure_s, SomeExposure(can, 1));
}

TEST_P(CameraConformance, AMuteCameraIsAnErrorByTheDeadline) {
  const CameraCapabilities can = device().capabilities();
  device().Configure({SomeExposure(can, 1)}, In(kLong_s));
  if (!bench_->Mute(true)) GTEST_SKIP() << "this bench cannot make it mute";
  constexpr double kPatience_s = 1;
  const auto is_loss = [](std::optional<Fault> fault) {
    return fault == Fault::kTimeout || fault == Fault::kDisconnected;
  };
  EXPECT_TRUE(is_loss(FaultOf([&] { device().Expose(In(kPatience_s)); })));
  EXPECT_TRUE(
      is_loss(FaultOf([&] { device().Configure({SomeExposure(can, 2)}, In(kPatience_s)); })));
  bench_->Mute(false);
  // It is found again, or stays lost and says so; what was given up may take a moment to end.
  const double give_up_s = In(kLong_s);
  std::optional<Fault> fault;
  do {
    fault = FaultOf([&] {
      device().Configure({SomeExposure(can, 5)}, In(kLong_s));
      EXPECT_EQ(device().Expose(In(kLong_s)).settings.exposure_s, SomeExposure(can, 5));
    });
  } while (fault && fault != Fault::kDisconnected && In(0) < give_up_s);
  EXPECT_TRUE(!fault || fault == Fault::kDisconnected) << int(*fault);
}

// One that nobody waits for is forgotten; one during an exposure ends it without a frame, unless
// the frame is there already. The next exposure is a new one either way.
TEST_P(CameraConformance, AnAbortEndsTheExposureAndNotTheNextOne) {
  const CameraCapabilities can = device().capabilities();
  const auto exposed = [&] {
    device().Configure({SomeExposure(can, 1)}, In(kLong_s));
    const double asked_s = In(0);
    const Frame frame = device().Expose(In(kLong_s));
    EXPECT_EQ(frame.settings.exposure_s, SomeExposure(can, 1));
    EXPECT_GE(frame.t_start_s, asked_s);
    return frame.frame_id;
  };
  const std::uint64_t first = exposed();
  device().Abort();
  const std::uint64_t second = exposed();
  EXPECT_GT(second, first);
  if (!bench_->in_real_time()) return;
  device().Configure({SomeExposure(can, 500)}, In(kLong_s));
  auto fault = std::async(std::launch::async,
                          [&] { return FaultOf([&] { device().Expose(In(kLong_s)); }); });
  while (fault.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready)
    device().Abort();
  EXPECT_EQ(fault.get().value_or(Fault::kStopped), Fault::kStopped);
  const double give_up_s = In(kLong_s);  // what was broken off may take a moment to end
  while (FaultOf([&] { device().Configure({SomeExposure(can, 1)}, In(kLong_s)); }) &&
         In(0) < give_up_s) {
  }
  EXPECT_GT(exposed(), second);
}

}  // namespace luxfield::hal
