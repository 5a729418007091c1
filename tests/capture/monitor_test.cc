// What a capture does about a lamp monitor that tells nothing, or something else after an exposure
// than before it: no reading makes a session unreadable, and one that was damaged on its way is not
// believed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <memory>
#include <utility>

#include "luxfield/capture/review/session_review.h"
#include "luxfield/hal/lab/open_lab.h"
#include "tests/capture/capture_fixture.h"

namespace luxfield::capture {
namespace {

using hal::Devices;
using hal::Reading;
using hal::sim::SimulatedLab;
using testing::HasSubstr;

// A monitor whose readings a test spoils.
class SpoiltMonitor : public hal::Meter {
 public:
  using Spoil = std::function<void(Reading&)>;
  explicit SpoiltMonitor(std::unique_ptr<hal::Meter> meter) : meter_(std::move(meter)) {}
  std::string identity() const override { return "spoilt monitor"; }
  Reading Read(double deadline_s) override {
    Reading reading = meter_->Read(deadline_s);
    if (spoil) spoil(reading);
    return reading;
  }

  Spoil spoil;

 private:
  std::unique_ptr<hal::Meter> meter_;
};

// The ways in which a reading says nothing.
const std::vector<std::pair<std::string, SpoiltMonitor::Spoil>>& Spoils() {
  static const std::vector<std::pair<std::string, SpoiltMonitor::Spoil>> spoils = {
      {"over_range", [](Reading& r) { r.over_range = true; }},
      {"infinite", [](Reading& r) { r.value = std::numeric_limits<double>::infinity(); }},
      {"nan", [](Reading& r) { r.value = std::numeric_limits<double>::quiet_NaN(); }},
      {"negative", [](Reading& r) { r.value = -r.value; }},
      // A bit of one digit, in one answer.
      {"exponent", [](Reading& r) { r.value *= 1e80; }},
      {"digit", [](Reading& r) { r.value += 0.02; }}};
  return spoils;
}

// Captures with readings spoilt from the first committed frame on, `times` of them.
std::filesystem::path CaptureSpoilt(const std::string& name, const SpoiltMonitor::Spoil& spoil,
                                    int times) {
  const auto folder = NewFolder(name);
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  auto owned = std::make_unique<SpoiltMonitor>(std::move(devices.monitor));
  SpoiltMonitor& monitor = *owned;
  devices.monitor = std::move(owned);
  CaptureOptions options;
  options.on_frame = [&](const CaptureSummary& s) {
    if (s.positions == 1 && !monitor.spoil)
      monitor.spoil = [&spoil, left = times](Reading& reading) mutable {
        if (left-- > 0) spoil(reading);
      };
  };
  RunCapture(TestPlan(), devices, folder, options);
  return folder;
}

TEST_F(Capture, AFrameBesideReadingsThatSayNothingOrDisagreeIsTakenAgain) {
  for (const auto& [name, spoil] : Spoils()) {
    SCOPED_TRACE(name);
    const auto folder = CaptureSpoilt(name, spoil, 1);
    const auto rejected = RecordsOf(folder, "frame_rejected");
    ASSERT_EQ(rejected.size(), 1u);
    EXPECT_THAT(rejected[0]["reason"].get<std::string>(), HasSubstr("spoilt monitor"));
    EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
    const session::SessionReader session(folder);
    for (const auto& frame : session.frames())
      if (frame.kind != session::FrameKind::kDark) {
        EXPECT_NEAR(frame.meter, 1, 0.01);
      }
  }
}

TEST_F(Capture, FramesOfAMonitorThatNeverSaysAnythingCertainAreFlaggedAndHaveNoReading) {
  auto spoils = Spoils();
  spoils.resize(4);  // those that say nothing
  spoils.emplace_back("unsteady", [up = false](Reading& r) mutable {
    if ((up = !up)) r.value *= 1.1;
  });
  for (const auto& [name, spoil] : spoils) {
    SCOPED_TRACE(name);
    const auto folder = CaptureSpoilt(name + "_ever", spoil, 1000000);
    EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
    int flagged = 0;
    const session::SessionReader session(folder);
    for (const auto& frame : session.frames()) {
      flagged += frame.flagged;
      EXPECT_EQ(frame.flagged, frame.kind != session::FrameKind::kDark && frame.meter == 0);
    }
    EXPECT_GT(flagged, 3);
    EXPECT_NO_THROW(ReviewSession(folder));
  }
}

}  // namespace
}  // namespace luxfield::capture
