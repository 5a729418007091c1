// What a capture does about a stage that loses its position, or its place, within a bracket.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/hal/error.h"
#include "luxfield/hal/lab/open_lab.h"
#include "tests/capture/capture_fixture.h"

namespace luxfield::capture {
namespace {

using hal::Devices;
using hal::StagePosition;
using hal::sim::SimulatedLab;
using session::FrameKind;
using session::FrameRecord;
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

  // How many frames an undisturbed capture has committed when the first one passes.
  int FramesUntil(const std::function<bool(const FrameRecord&)>& passes) {
    Run("whole", {}, -1);
    const session::SessionReader session(folder_);
    const auto& frames = session.frames();
    return 1 +
           static_cast<int>(std::find_if(frames.begin(), frames.end(), passes) - frames.begin());
  }
  // Of the session's third position.
  int WithinABracket() {
    std::set<std::pair<int, int>> begun;
    return FramesUntil([&](const FrameRecord& record) {
      if (record.kind == FrameKind::kPosition) begun.insert({record.i, record.j});
      return begun.size() == 3;
    });
  }

  void ExpectResumes(int complete) {
    CaptureOptions options;
    options.resume = true;
    Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
    EXPECT_EQ(RunCapture(plan_, devices, folder_, options).positions, 6 - complete);
    EXPECT_THAT(VerifySession(folder_).problems, testing::IsEmpty());
    int of_two_epochs = 0;
    std::map<std::pair<int, int>, int> epochs;
    const session::SessionReader session(folder_);
    for (const auto& record : session.frames())
      if (record.kind == FrameKind::kPosition)
        of_two_epochs +=
            epochs.try_emplace({record.i, record.j}, record.epoch).first->second != record.epoch;
    EXPECT_EQ(of_two_epochs, 0);
  }

  // After FramesUntil, disturbed once `frames` are committed: of what is taken then nothing counts.
  void ExpectNothingCounts(int frames, const DisturbedStage::Disturbance& disturbance,
                           hal::Fault fault, const std::string& problem) {
    const auto undisturbed = session::SessionReader(folder_).frames();
    ASSERT_LT(frames, undisturbed.size());
    std::set<std::string> whole;  // their files, until then
    for (int n = 0; n < frames; ++n) whole.insert(undisturbed[n].file);
    try {
      Run("disturbed", disturbance, frames);
      FAIL() << "the capture went on";
    } catch (const hal::HardwareError& error) {
      EXPECT_EQ(error.fault, fault) << error.what();
      EXPECT_TRUE(error.position_lost);
      EXPECT_THAT(error.what(), HasSubstr(problem));
    }
    const auto complete = static_cast<int>(RecordsOf(folder_, "position_complete").size());
    std::set<std::pair<int, int>> positions;
    const session::SessionReader disturbed(folder_);
    for (const auto& record : disturbed.frames()) {
      EXPECT_TRUE(whole.contains(record.file)) << record.file;
      if (record.kind == FrameKind::kPosition) positions.insert({record.i, record.j});
    }
    EXPECT_EQ(positions.size(), complete);
    ExpectResumes(complete);
  }

  Plan plan_ = [] {
    Plan plan = TestPlan();
    plan.exposure.repeats = 3;
    return plan;
  }();
  std::filesystem::path folder_;
};

TEST_F(DisturbedCapture, NothingCountsOnceThePositionIsLost) {
  ExpectNothingCounts(
      WithinABracket(), [](StagePosition& where) { where.homed = false; }, hal::Fault::kNotHomed,
      "has lost its position since it arrived (not homed);");
}

TEST_F(DisturbedCapture, WhatCostThePositionIsSaidAndJournalled) {
  ExpectNothingCounts(
      WithinABracket(),
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

// No completion stands behind references: they are not committed at all. The first answer is the
// one that completes the position before.
TEST_F(DisturbedCapture, NoReferenceIsKeptOnceThePositionIsLost) {
  const int frames = FramesUntil([references = 0](const FrameRecord& record) mutable {
    return record.kind == FrameKind::kReference && ++references == 2;
  });
  ExpectNothingCounts(
      frames - 1, [answers = 0](StagePosition& where) mutable { where.homed = ++answers == 1; },
      hal::Fault::kNotHomed, "has lost its position");
}

TEST_F(DisturbedCapture, NothingCountsOfAStageThatMoves) {
  ExpectNothingCounts(
      WithinABracket(), [](StagePosition& where) { where.moving = true; }, hal::Fault::kProtocol,
      "do not name one place");
}

// Somebody turned the knob: it stands, and says where, but not where the bracket began.
TEST_F(DisturbedCapture, NothingCountsOfAStageThatWasDisplaced) {
  ExpectNothingCounts(
      WithinABracket(), [](StagePosition& where) { where.readback.x += 1e-3; },
      hal::Fault::kProtocol, "where it had arrived");
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

// Controllers answer a few times a second (Grbl's document: five), cameras more often.
TEST_F(DisturbedCapture, AStageIsAskedTwiceABracketWhateverItsLength) {
  const auto answers_of = [this](int repeats) {
    plan_.exposure.repeats = repeats;
    int answers = 0;
    Run(
        "answers", [&](StagePosition&) { ++answers; }, 1);
    return answers;
  };
  const int of_few = answers_of(1);
  EXPECT_GT(of_few, 8);  // four positions
  EXPECT_EQ(answers_of(5), of_few);
}

}  // namespace
}  // namespace luxfield::capture
