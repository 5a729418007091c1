// What a capture does about a stage that loses its position, or its place, within a bracket.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <utility>

#include "hal/error.h"
#include "tests/capture/capture_fixture.h"

namespace luxfield::capture {
namespace {

using hal::Devices;
using hal::StagePosition;
using hal::sim::SimulatedLab;
using testing::HasSubstr;

// A stage whose answers a test falsifies; homing ends that.
class DisturbedStage : public hal::Stage {
 public:
  using Disturbance = std::function<void(StagePosition&)>;
  explicit DisturbedStage(std::unique_ptr<hal::Stage> stage) : stage_(std::move(stage)) {}
  std::string identity() const override { return "disturbed stage"; }
  hal::StageLimits limits() const override { return stage_->limits(); }
  void Home(double deadline_s) override {
    stage_->Home(deadline_s);
    disturbance = {};
  }
  void MoveTo(hal::Vec2 centre, double deadline_s) override { stage_->MoveTo(centre, deadline_s); }
  StagePosition Where() override {
    StagePosition where = stage_->Where();
    if (disturbance) disturbance(where);
    return where;
  }
  void Stop() override { stage_->Stop(); }

  Disturbance disturbance;

 private:
  std::unique_ptr<hal::Stage> stage_;
};

// Captures the test plan; the disturbance begins once `frames` frames are committed.
class DisturbedCapture : public Capture {
 protected:
  void Run(const std::string& name, const DisturbedStage::Disturbance& disturbance, int frames) {
    folder_ = NewFolder(name);
    Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
    auto owned = std::make_unique<DisturbedStage>(std::move(devices.stage));
    DisturbedStage& stage = *owned;
    devices.stage = std::move(owned);
    CaptureOptions options;
    options.on_frame = [&](const CaptureSummary& s) {
      if (s.frames == frames) stage.disturbance = disturbance;
    };
    RunCapture(plan_, devices, folder_, options);
  }

  // Behind the darks and two positions: within the bracket of the third.
  int WithinABracket() {
    const auto whole = NewFolder("whole");
    Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
    int frames = 0;
    CaptureOptions options;
    options.on_frame = [&](const CaptureSummary& s) {
      if (s.positions == 2 && frames == 0) frames = s.frames;
    };
    RunCapture(plan_, devices, whole, options);
    return frames;
  }

  void ExpectResumes() {
    CaptureOptions options;
    options.resume = true;
    Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
    EXPECT_EQ(RunCapture(plan_, devices, folder_, options).positions, 4);
    EXPECT_THAT(VerifySession(folder_).problems, testing::IsEmpty());
    int of_two_epochs = 0;
    std::map<std::pair<int, int>, int> epochs;
    const core::SessionReader session(folder_);
    for (const auto& record : session.frames())
      if (record.kind == core::FrameKind::kPosition)
        of_two_epochs +=
            epochs.try_emplace({record.i, record.j}, record.epoch).first->second != record.epoch;
    EXPECT_EQ(of_two_epochs, 0);
  }

  void ExpectNothingIsKept(const std::string& name, const DisturbedStage::Disturbance& disturbance,
                           hal::Fault fault, const std::string& problem) {
    const int frames = WithinABracket();
    ASSERT_GT(frames, 0);
    try {
      Run(name, disturbance, frames);
      FAIL() << "the bracket went on";
    } catch (const hal::HardwareError& error) {
      EXPECT_EQ(error.fault, fault) << error.what();
      EXPECT_TRUE(error.position_lost);
      EXPECT_THAT(error.what(), HasSubstr(problem));
    }
    EXPECT_EQ(RecordsOf(folder_, "frame").size(), static_cast<std::size_t>(frames));
    EXPECT_EQ(RecordsOf(folder_, "position_complete").size(), 2u);
    ExpectResumes();
  }

  Plan plan_ = [] {
    Plan plan = TestPlan();
    plan.exposure.repeats = 3;
    return plan;
  }();
  std::filesystem::path folder_;
};

TEST_F(DisturbedCapture, NoFrameIsKeptOnceThePositionIsLost) {
  ExpectNothingIsKept(
      "lost", [](StagePosition& where) { where.homed = false; }, hal::Fault::kNotHomed,
      "has lost its position since it arrived (not homed);");
}

TEST_F(DisturbedCapture, WhatCostThePositionIsSaidAndJournalled) {
  ExpectNothingIsKept(
      "reason",
      [](StagePosition& where) {
        where.homed = false;
        where.lost = "ALARM:1, a switch";
      },
      hal::Fault::kNotHomed,
      "has lost its position since it arrived: ALARM:1, a switch (not homed);");
  const auto pauses = RecordsOf(folder_, "paused");
  ASSERT_EQ(pauses.size(), 1u);
  EXPECT_THAT(pauses[0]["reason"].get<std::string>(), HasSubstr("ALARM:1, a switch"));
}

TEST_F(DisturbedCapture, NoFrameIsKeptOfAStageThatMoves) {
  ExpectNothingIsKept(
      "moving", [](StagePosition& where) { where.moving = true; }, hal::Fault::kProtocol,
      "do not name one place");
}

// Somebody turned the knob: it stands, and says where, but not where the bracket began.
TEST_F(DisturbedCapture, NoFrameIsKeptOfAStageThatWasDisplaced) {
  ExpectNothingIsKept(
      "displaced", [](StagePosition& where) { where.readback.x += 1e-3; }, hal::Fault::kProtocol,
      "where it had arrived");
}

TEST_F(DisturbedCapture, OneGarbledAnswerIsAskedAgain) {
  int answers = 0;
  Run(
      "garbled",
      [&](StagePosition& where) {
        if (++answers == 1) where.readback.x += 1e-3;
        if (answers == 4) where.moving = true;
      },
      WithinABracket());
  EXPECT_GT(answers, 4);
  EXPECT_THAT(VerifySession(folder_).problems, testing::IsEmpty());
}

}  // namespace
}  // namespace luxfield::capture
