#include "luxfield/hal/drivers/gphoto2/gphoto2_camera.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>
#include <thread>

#include "luxfield/core/random.h"
#include "luxfield/hal/error.h"
#include "tests/gphoto2/ptp_bench.h"
#include "tests/gphoto2/ptp_usb_host.h"
#include "tests/hal/error_of.h"
#include "tests/hal/fewer_rights.h"

namespace luxfield::hal::gphoto2 {
namespace {

using testing::HasSubstr;

class StillCamera : public testing::Test {
 protected:
  double Soon(double seconds) const { return clock_->MonotonicSeconds() + seconds; }
  void ExpectFrame(const Frame& frame, double exposure_s) const {
    ASSERT_EQ(frame.image.dn.size(), std::size_t{PtpBench::kWidth} * PtpBench::kHeight);
    for (std::size_t k = 0; k < frame.image.dn.size(); ++k)
      ASSERT_EQ(frame.image.dn[k], PtpBench::Pixel(k, exposure_s, bench_.camera.exposures())) << k;
  }

  PtpBench bench_;
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
};

TEST_F(StillCamera, FramesCarryThePixelsOfTheExposureTheyWereAskedWith) {
  Gphoto2Camera camera(bench_.Options(), clock_);
  EXPECT_THAT(camera.identity(), HasSubstr("LUX7"));
  EXPECT_THAT(camera.capabilities().exposures_s,
              testing::ElementsAre(1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2));
  EXPECT_THAT(camera.capabilities().choices.at("setting iso"),
              testing::ElementsAre("100", "200", "400"));
  EXPECT_EQ(camera.firmware(), "1.0");
  std::uint64_t last_id = 0;
  for (const double exposure_s : {0.02, 0.001, 0.02, 0.02}) {
    EXPECT_EQ(camera.Configure({exposure_s}, Soon(10)).exposure_s, exposure_s);
    const Frame frame = camera.Expose(Soon(10));
    EXPECT_GT(frame.frame_id, std::exchange(last_id, frame.frame_id));
    EXPECT_TRUE(std::isnan(frame.temperature_c));
    ExpectFrame(frame, exposure_s);
  }
  EXPECT_EQ(bench_.camera.files(), 0u) << "files stay in the camera until it is full";
}

TEST_F(StillCamera, StandardInputStaysOpen) {
  ASSERT_NE(fcntl(STDIN_FILENO, F_GETFD), -1) << "the test itself needs it open";
  { Gphoto2Camera camera(bench_.Options(), clock_); }
  EXPECT_NE(fcntl(STDIN_FILENO, F_GETFD), -1);
}

TEST_F(StillCamera, OnlyItsOwnShutterSpeedsAreSet) {
  Gphoto2Camera camera(bench_.Options(), clock_);
  const auto error = ErrorOf([&] { camera.Configure({0.03}, Soon(10)); });
  EXPECT_EQ(error.fault, Fault::kOutOfRange);
  EXPECT_THAT(error.what(), HasSubstr("0.03 s is none of the camera's shutter speeds"));
}

TEST_F(StillCamera, ASettingIsRepeatedUntilItReadsBack) {
  Gphoto2Camera camera(bench_.Options(), clock_);
  bench_.camera.Set({.deaf = 2});
  camera.Configure({0.05}, Soon(10));
  ExpectFrame(camera.Expose(Soon(10)), 0.05);
  bench_.camera.Set({.always_deaf = true});
  const auto error = ErrorOf([&] { camera.Configure({0.01}, Soon(20)); });
  EXPECT_EQ(error.fault, Fault::kRefused);
  EXPECT_THAT(error.what(), HasSubstr("reads back"));
}

TEST_F(StillCamera, ABusyCameraIsAskedAgainAndNotForEver) {
  Gphoto2Camera camera(bench_.Options(), clock_);
  camera.Configure({0.01}, Soon(10));
  bench_.camera.Set({.busy = 3});
  ExpectFrame(camera.Expose(Soon(10)), 0.01);
  bench_.camera.Set({.busy = 1 << 30});
  const double give_up_s = Soon(0.5);
  EXPECT_EQ(ErrorOf([&] { camera.Expose(give_up_s); }).fault, Fault::kTimeout);
  EXPECT_LT(clock_->MonotonicSeconds(), give_up_s + 0.5);
}

TEST_F(StillCamera, TheExposureBeginsWithTheTriggerThatABusyCameraTakes) {
  Gphoto2Camera camera(bench_.Options(), clock_);
  camera.Configure({0.01}, Soon(10));
  constexpr int kRefused = 10;
  constexpr double kBetween_s = 0.05;  // the driver lets at least that pass between triggers
  bench_.camera.Set({.busy = kRefused});
  const double asked_s = clock_->MonotonicSeconds();
  const Frame frame = camera.Expose(Soon(10));
  EXPECT_GE(frame.t_start_s - asked_s, kRefused * kBetween_s);
}

TEST_F(StillCamera, AFrameThatIsNotTheOneAskedForIsNotTaken) {
  struct Case {
    fakes::PtpCamera::Faults faults;
    const char* problem;
  };
  for (const Case& c : {Case{{.again = true}, "came again"},
                        Case{{.another_speed = true}, "the file says 0.001 s, set are 0.05 s"},
                        Case{{.cut = 1000}, "cut off"}}) {
    Gphoto2Camera camera(bench_.Options(), clock_);
    camera.Configure({0.05}, Soon(10));
    camera.Expose(Soon(10));
    bench_.camera.Set(c.faults);
    const auto error = ErrorOf([&] { camera.Expose(Soon(10)); });
    EXPECT_EQ(error.fault, Fault::kIncomplete) << c.problem;
    EXPECT_THAT(error.what(), HasSubstr(c.problem));
    bench_.camera.Set({});
    ExpectFrame(camera.Expose(Soon(10)), 0.05);
  }
}

TEST_F(StillCamera, TheFileOfAnExposureThatWasGivenUpIsNotTheNextOnes) {
  Gphoto2Camera camera(bench_.Options(), clock_);
  camera.Configure({0.2}, Soon(10));
  EXPECT_EQ(ErrorOf([&] { camera.Expose(Soon(0.1)); }).fault, Fault::kTimeout);
  camera.Configure({0.2}, Soon(10));
  ExpectFrame(camera.Expose(Soon(10)), 0.2);
  EXPECT_EQ(bench_.camera.exposures(), 2);
  EXPECT_EQ(bench_.camera.files(), 0u);
}

TEST_F(StillCamera, AFrameThatNeverComesEndsByItsDeadline) {
  Gphoto2Camera camera(bench_.Options(), clock_);
  camera.Configure({0.01}, Soon(10));
  bench_.camera.Set({.lost = true});
  EXPECT_EQ(ErrorOf([&] { camera.Expose(Soon(0.3)); }).fault, Fault::kTimeout);
}

TEST_F(StillCamera, AnAbortEndsAnExposureThatWaits) {
  Gphoto2Camera camera(bench_.Options(), clock_);
  camera.Configure({0.2}, Soon(10));
  const int before = bench_.camera.exposures();
  std::thread aborter([&] {
    while (bench_.camera.exposures() == before) std::this_thread::yield();
    camera.Abort();
  });
  const auto error = ErrorOf([&] { camera.Expose(Soon(10)); });
  aborter.join();
  EXPECT_EQ(error.fault, Fault::kStopped);
}

TEST_F(StillCamera, ACutConnectionIsADisconnectedDevice) {
  Gphoto2Camera camera(bench_.Options(), clock_);
  camera.Configure({0.01}, Soon(10));
  bench_.host.Drop();
  EXPECT_EQ(ErrorOf([&] { camera.Expose(Soon(10)); }).fault, Fault::kDisconnected);
}

TEST_F(StillCamera, OnUsbIsListedAndItsUnpluggingIsNamed) {
  UMockdevTestbed* testbed = umockdev_testbed_new();
  {
    PtpUsbHost host(testbed, 6, bench_.camera);
    const auto devices = ListGphoto2Devices();
    ASSERT_EQ(devices.size(), 1u);
    EXPECT_EQ(devices[0].port, host.port());
    EXPECT_THAT(devices[0].model, HasSubstr("PTP"));
    Gphoto2Options options = bench_.Options();
    options.port = "usb:001,099";
    EXPECT_EQ(ErrorOf([&] { Gphoto2Camera camera(options, clock_); }).fault, Fault::kDisconnected);
    options.port = host.port();
    Gphoto2Camera camera(options, clock_);
    camera.Configure({0.02}, Soon(10));
    ExpectFrame(camera.Expose(Soon(10)), 0.02);
    host.Unplug();
    EXPECT_EQ(ErrorOf([&] { camera.Expose(Soon(10)); }).fault, Fault::kDisconnected);
  }
  g_object_unref(testbed);
}

TEST_F(StillCamera, OnUsbOfOthersIsRefusedWithTheGroupToJoin) {
  UMockdevTestbed* testbed = umockdev_testbed_new();
  {
    PtpUsbHost host(testbed, 6, bench_.camera);
    Gphoto2Options options = bench_.Options();
    options.port = host.port();
    const Forbidden node("/dev/bus/usb/001/007");
    const HardwareError error = ErrorOf([&] { Gphoto2Camera camera(options, clock_); });
    EXPECT_EQ(error.fault, Fault::kRefused) << error.what();
    EXPECT_THAT(error.what(), testing::AllOf(HasSubstr(host.port()), HasSubstr("group plugdev"),
                                             HasSubstr("docs/how-to/permissions.md")));
    const auto devices = ListGphoto2Devices();
    ASSERT_EQ(devices.size(), 1u);
    EXPECT_EQ(devices[0].problem, error.what());
  }
  g_object_unref(testbed);
}

TEST_F(StillCamera, AMuteCameraIsATimeoutByTheDeadline) {
  Gphoto2Camera camera(bench_.Options(), clock_);
  bench_.host.Mute(true);
  const double give_up_s = Soon(0.5);
  EXPECT_EQ(ErrorOf([&] { camera.Configure({0.01}, give_up_s); }).fault, Fault::kTimeout);
  EXPECT_LT(clock_->MonotonicSeconds(), give_up_s + 0.5);
  bench_.host.Drop();  // lets the call end that still waits, and the camera be closed
}

TEST_F(StillCamera, WhatTheLabSaysOfFramesIsHeldAgainstThem) {
  struct Case {
    std::function<void(Gphoto2Options&)> change;
    const char* problem;
  };
  for (const Case& c :
       {Case{[](Gphoto2Options& o) { o.width = 96; }, "48 x 32 pixels came, the lab says 96 x 32"},
        Case{[](Gphoto2Options& o) { o.cfa = "RGGB"; },
             "mosaic is \"GRBG\", the lab says \"RGGB\""},
        Case{[](Gphoto2Options& o) { o.bits = 10; }, "more than 10 bits hold"}}) {
    Gphoto2Options options = bench_.Options();
    c.change(options);
    Gphoto2Camera camera(options, clock_);
    camera.Configure({0.1}, Soon(10));
    const auto error = ErrorOf([&] { camera.Expose(Soon(10)); });
    EXPECT_EQ(error.fault, Fault::kProtocol);
    EXPECT_THAT(error.what(), HasSubstr(c.problem));
  }
}

TEST_F(StillCamera, SettingsThatTheCameraHasNotAreRefusedByName) {
  Gphoto2Options options = bench_.Options();
  options.settings = {{"imagefidelity", "RAW"}};
  EXPECT_THAT(ErrorOf([&] { Gphoto2Camera camera(options, clock_); }).what(),
              HasSubstr("has no setting \"imagefidelity\""));
  options.settings = {{"iso", "123"}};
  EXPECT_THAT(ErrorOf([&] { Gphoto2Camera camera(options, clock_); }).what(),
              HasSubstr("\"iso\" cannot be \"123\"; it can be 100, 200, 400"));
}

// The library writes to the connection once more when the camera is closed.
TEST_F(StillCamera, AConnectionThatIsResetWhileItIsOpenedEndsInAnError) {
  signal(SIGPIPE, SIG_DFL);
  bool opens = false;
  for (int replies = 0; !opens; ++replies) {
    SCOPED_TRACE(fmt::format("after {} packets", replies));
    ASSERT_LT(replies, 1000);
    bench_.host.SetDamage([left = replies](std::string& packet) mutable {
      if (left-- == 0) packet.clear();
    });
    try {
      const Gphoto2Camera camera(bench_.Options(), clock_);
      opens = true;
    } catch (const HardwareError& error) {
      EXPECT_THAT(error.what(), HasSubstr("; ")) << "names no remedy";
    }
  }
}

// Libgphoto2 asks about every picture on the card before it hands over the first new one.
TEST_F(StillCamera, APictureOfACardFullOfOthersIsTheOneJustTaken) {
  bench_.camera.Leave(1000);
  Gphoto2Camera camera(bench_.Options(), clock_);
  camera.Configure({0.001}, Soon(10));
  ExpectFrame(camera.Expose(Soon(10)), 0.001);
  EXPECT_EQ(bench_.camera.files(), 1000u);
}

// One reply, or some, of a camera that is damaged or means harm: lengths, counts and texts of any
// value, packets that end early or go on.
fakes::PtpIpHost::Damage Hostile(core::Random random) {
  return [random, left = static_cast<int>(random() % 60)](std::string& packet) mutable {
    if (left-- > 0) return;
    left = static_cast<int>(random() % 20);
    constexpr std::size_t kHead = 8;  // length and kind
    const bool keeps_length = random() % 4 > 0;
    for (std::uint32_t n = 1 + random() % 3; n > 0; --n) {
      const std::size_t at =
          keeps_length ? kHead + random() % (packet.size() - kHead + 1) : random() % packet.size();
      switch (random() % 4) {
        case 0:
          packet.resize(at);
          break;
        case 1:
          packet.insert(at, random() % 64, static_cast<char>(random()));
          break;
        case 2:
          for (std::size_t k = at; k < std::min(at + 4, packet.size()); ++k) packet[k] = '\xff';
          break;
        default:
          if (at < packet.size()) packet[at] = static_cast<char>(random());
      }
      packet.resize(std::max(packet.size(), kHead));
    }
    if (keeps_length)
      for (int k = 0; k < 4; ++k) packet[k] = static_cast<char>(packet.size() >> 8 * k);
  };
}

// Libgphoto2 reads the packets; what it makes of them is a frame as the lab says or an error that
// names a remedy, and the next camera works. LUXFIELD_FAULTS=n has n cameras instead of 5.
TEST_F(StillCamera, HostileRepliesEndInAnErrorOrAFrame) {
  constexpr std::uint64_t kSeed = 20261122;
  const char* asked = std::getenv("LUXFIELD_FAULTS");
  const int cameras = asked ? std::atoi(asked) : 5;
  int frames = 0;
  std::map<Fault, int> errors;
  for (int n = 0; n < cameras; ++n) {
    SCOPED_TRACE("camera " + std::to_string(n) + ", seed " + std::to_string(kSeed));
    bench_.host.SetDamage(Hostile(core::Random(kSeed, static_cast<std::uint64_t>(n))));
    try {
      Gphoto2Camera camera(bench_.Options(), clock_);
      camera.Configure({0.001}, Soon(2));
      const Frame frame = camera.Expose(Soon(2));
      ASSERT_EQ(frame.image.dn.size(), std::size_t{PtpBench::kWidth} * PtpBench::kHeight);
      ++frames;
    } catch (const HardwareError& error) {
      EXPECT_THAT(error.what(), HasSubstr("; ")) << "names no remedy";
      ++errors[error.fault];
    }
  }
  std::cout << frames << " frames";
  for (const auto& [fault, count] : errors)
    std::cout << ", " << count << " of fault " << int(fault);
  std::cout << "\n";
  EXPECT_GT(errors.size(), 0u) << "the replies were too good to show anything";
  bench_.host.SetDamage({});
  Gphoto2Camera camera(bench_.Options(), clock_);
  camera.Configure({0.001}, Soon(10));
  ExpectFrame(camera.Expose(Soon(10)), 0.001);
}

}  // namespace
}  // namespace luxfield::hal::gphoto2
