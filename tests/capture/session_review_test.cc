#include "luxfield/capture/review/session_review.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/session/folder_lock.h"
#include "luxfield/session/session_writer.h"
#include "tests/capture/capture_fixture.h"
#include "tests/capture/faulty_camera.h"

namespace luxfield::capture {
namespace {

namespace fs = std::filesystem;
using hal::Devices;
using hal::sim::SimulatedLab;
using hal::sim::TestLab;
using testing::HasSubstr;

class SessionReviewed : public Capture {};

Devices With(const TestLab& lab, FaultyCamera::Mischief mischief) {
  Devices devices = SimulatedLab(lab.Config()).MakeDevices();
  devices.camera = std::make_unique<FaultyCamera>(std::move(devices.camera), std::move(mischief));
  return devices;
}

// But that the lamp reaches the outer filters, as it does on the tiny grid of these tests
// (tests/planning/planned_edges_test.cc is about that).
std::vector<Judgement> NotGood(const SessionReview& review) {
  std::vector<Judgement> list = Judge(review);
  std::erase_if(list, [](const Judgement& j) {
    return j.verdict == Verdict::kGood || j.text.starts_with("Light reaches the outer filters");
  });
  return list;
}

std::string Sentences(const SessionReview& review) {
  std::string text;
  for (const Judgement& judgement : Judge(review)) text += judgement.text + "\n";
  return text;
}

TEST_F(SessionReviewed, AHealthySessionIsGoodThroughout) {
  const auto folder = NewFolder("healthy");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  const CaptureSummary summary = RunCapture(TestPlan(), devices, folder);
  const SessionReview review = ReviewSession(folder, /*verify=*/true);
  EXPECT_THAT(NotGood(review), testing::IsEmpty()) << Sentences(review);
  EXPECT_TRUE(review.state.sealed);
  EXPECT_FALSE(review.state.in_use);
  EXPECT_EQ(review.plan.kind, "light-field");
  EXPECT_EQ(review.plan.positions, 6);
  EXPECT_EQ(review.counts.missing, 0);
  EXPECT_EQ(review.counts.frames, summary.frames);
  EXPECT_EQ(review.counts.superseded, 0);
  EXPECT_EQ(review.counts.rejected, 0);
  EXPECT_EQ(review.counts.probes, static_cast<int>(RecordsOf(folder, "probe").size()));
  EXPECT_NEAR(review.duration_s, summary.rig_s, 1e-9 * summary.rig_s);
  ASSERT_EQ(review.epochs.size(), 1u);
  EXPECT_TRUE(review.epochs[0].sealed);
  EXPECT_EQ(review.epochs[0].frames, summary.frames);
  // Exposures and positions share out the same frames.
  const int of_positions = std::accumulate(review.positions.begin(), review.positions.end(), 0,
                                           [](int sum, const auto& p) { return sum + p.frames; });
  const int of_exposures = std::accumulate(review.exposures.begin(), review.exposures.end(), 0,
                                           [](int sum, const auto& e) { return sum + e.frames; });
  EXPECT_EQ(of_positions, of_exposures);
  double last_s = 0;
  for (const ReviewedExposure& e : review.exposures) {
    EXPECT_GT(e.exposure_s, std::exchange(last_s, e.exposure_s));
    ASSERT_TRUE(e.brightest && e.mean);
    EXPECT_LE((*e.brightest)[0], (*e.brightest)[1]);
    EXPECT_LE((*e.brightest)[1], (*e.brightest)[2]);
    EXPECT_LT(*e.mean, (*e.brightest)[2]);
  }
  EXPECT_LT((*review.exposures[0].brightest)[2], 0.95) << "saturation_share";
  for (const ReviewedPosition& p : review.positions) {
    EXPECT_TRUE(p.whole);
    EXPECT_EQ(p.saturated_share, 0);
    ASSERT_TRUE(p.residual_m);
    EXPECT_NEAR(std::hypot((*p.residual_m)[0], (*p.residual_m)[1]), 0, 1e-12);
  }
  for (const TimedValue& v : review.sensor.temperature_c) EXPECT_EQ(v.value, 25);
  EXPECT_EQ(review.sensor.temperature_c.size(), static_cast<std::size_t>(summary.frames));
  for (const TimedValue& v : review.lamp.current_a) EXPECT_EQ(v.value, 2);
  for (const TimedValue& v : review.sensor.dark_dn) EXPECT_NEAR(v.value, 0, 1) << "noise is 2 DN";
}

TEST_F(SessionReviewed, DriftRejectedFramesAndWarmthAreFound) {
  const auto folder = NewFolder("faults");
  TestLab lab = Noisy();
  lab.errors += "[errors.drift]\nper_hour = 0\namplitude = 0.05\nperiod_s = 60\n";
  Plan plan = TestPlan();
  plan.reference.max_drift = 0.001;
  plan.warm_up.variation = 0.1;
  int stale = 0;
  double last_c = 0;
  Devices devices = With(lab, [&](int n, hal::Frame& f, const hal::Frame& old) {
    f.temperature_c = last_c = 20 + 0.5 * n;
    if (n % 10 == 9) {
      f = old;
      ++stale;
    }
  });
  CaptureOptions options;
  options.accept_drift = true;
  const CaptureSummary summary = RunCapture(plan, devices, folder, options);
  const SessionReview review = ReviewSession(folder);
  EXPECT_EQ(review.counts.rejected, stale);
  EXPECT_EQ(review.counts.rejected, summary.rejected);
  int here = review.counts.rejected_elsewhere;
  for (const ReviewedPosition& p : review.positions) here += p.rejected;
  EXPECT_EQ(here, stale);
  ASSERT_EQ(review.reasons.size(), 1u);
  EXPECT_EQ(review.reasons[0].reason, "stale: frame id # after #");
  EXPECT_EQ(review.reasons[0].frames, stale);
  EXPECT_THAT(review.reasons[0].example, testing::ContainsRegex("frame id [0-9]+ after [0-9]+"));

  const TimeSeries& ratio = review.lamp.reference_ratio.at(0);
  const auto recorded = RecordsOf(folder, "reference");
  ASSERT_EQ(ratio.size(), recorded.size());
  double least = 1, most = 1;
  for (std::size_t n = 0; n < ratio.size(); ++n) {
    EXPECT_EQ(ratio[n].value, recorded[n].at("ratio"));
    least = std::min(least, ratio[n].value);
    most = std::max(most, ratio[n].value);
  }
  EXPECT_EQ(least, summary.lamp_ratio_min);
  EXPECT_EQ(most, summary.lamp_ratio_max);
  EXPECT_GT(most - least, 0.01) << "a drift that can be told from noise";
  for (const TimedValue& v : review.lamp.reference_over_meter)
    EXPECT_NEAR(v.value, 1, 0.01) << "the light meter sees the same";

  const auto [coldest, warmest] = std::minmax_element(
      review.sensor.temperature_c.begin(), review.sensor.temperature_c.end(),
      [](const TimedValue& a, const TimedValue& b) { return a.value < b.value; });
  EXPECT_GE(coldest->value, 20);
  EXPECT_NEAR(warmest->value, last_c, 0.5);
  const std::string text = Sentences(review);
  EXPECT_THAT(text, testing::ContainsRegex("The lamp went [0-9.]+ % from its first reference"));
  EXPECT_THAT(text, HasSubstr("failed the checks and were taken again"));
  EXPECT_THAT(text, HasSubstr("darks of one end do not fit frames of the other"));
  for (const Judgement& judgement : Judge(review)) EXPECT_NE(judgement.verdict, Verdict::kBad);
}

TEST_F(SessionReviewed, FramesThatStayWrongAreFlaggedWhereTheyAre) {
  const auto folder = NewFolder("flagged");
  // Frames in the light are saturated in a corner from some moment on.
  int position_frames = 0;
  Devices devices = With(Noisy(), [&](int n, hal::Frame& f, const hal::Frame&) {
    const bool lit = std::any_of(f.image.dn.begin(), f.image.dn.end(),
                                 [](std::uint16_t dn) { return dn > 300; });
    if (n > 8 && lit && ++position_frames > 8)
      std::fill_n(f.image.dn.begin(), 24, static_cast<std::uint16_t>(4095));
  });
  Plan plan = TestPlan();
  plan.reference.max_drift = 0.9;
  const CaptureSummary summary = RunCapture(plan, devices, folder);
  ASSERT_GT(summary.flagged, 0);
  const SessionReview review = ReviewSession(folder);
  EXPECT_EQ(review.counts.flagged, summary.flagged);
  int flagged = 0, saturated = 0;
  for (const ReviewedPosition& p : review.positions) {
    flagged += p.flagged;
    saturated += p.saturated_share > 0;
    if (p.flagged > 0) {
      EXPECT_NEAR(p.saturated_share.value(), 24.0 / (32 * 24), 0.01);
    }
  }
  EXPECT_EQ(flagged, summary.flagged);
  EXPECT_GT(saturated, 0);
  EXPECT_LT(saturated, 6);
  EXPECT_THAT(Sentences(review),
              HasSubstr("saturated pixels even in the shortest exposure of a bracket"));
}

TEST_F(SessionReviewed, PausesAndCrashesAreTold) {
  const auto folder = NewFolder("interrupted");
  Plan plan = TestPlan();
  plan.exposure.repeats = 3;  // so that the stop falls into a bracket
  CaptureOptions options;
  options.on_frame = [](const CaptureSummary& s) {
    if (s.positions == 1) core::SetInterruptCountForTest(2);
  };
  Devices first = SimulatedLab(Noisy().Config()).MakeDevices();
  EXPECT_THROW(RunCapture(plan, first, folder, options), Interrupted);
  core::SetInterruptCountForTest(0);
  SessionReview review = ReviewSession(folder);
  EXPECT_FALSE(review.state.sealed);
  EXPECT_EQ(review.counts.missing, 5);
  EXPECT_GT(review.counts.superseded, 0) << "the broken bracket";
  EXPECT_EQ(std::count_if(review.positions.begin(), review.positions.end(),
                          [](const auto& p) { return p.whole; }),
            1);
  EXPECT_EQ(Judge(review)[0].verdict, Verdict::kBad);
  EXPECT_THAT(Judge(review)[0].text, HasSubstr("5 of 6 positions are missing"));
  {
    const session::FolderLock lock(folder);  // a capture that goes on
    const SessionReview running = ReviewSession(folder);
    EXPECT_TRUE(running.state.in_use);
    EXPECT_EQ(Judge(running)[0].verdict, Verdict::kLook);
  }

  options = {};
  options.resume = true;
  options.on_frame = [](const CaptureSummary& s) {  // dies
    if (s.positions == 2) throw std::runtime_error("dead");
  };
  Devices second = SimulatedLab(Noisy().Config()).MakeDevices();
  EXPECT_THROW(RunCapture(plan, second, folder, options), std::runtime_error);
  options.on_frame = {};
  Devices third = SimulatedLab(Noisy().Config()).MakeDevices();
  RunCapture(plan, third, folder, options);
  review = ReviewSession(folder);
  EXPECT_TRUE(review.state.sealed);
  EXPECT_EQ(review.counts.missing, 0);
  ASSERT_EQ(review.epochs.size(), 3u);
  EXPECT_TRUE(review.epochs[0].paused);
  EXPECT_FALSE(review.epochs[1].paused);
  EXPECT_TRUE(review.epochs[2].sealed);
  double before_s = 0;
  int frames = 0;
  for (const ReviewedEpoch& epoch : review.epochs) {
    EXPECT_GE(epoch.begin_s, before_s);
    EXPECT_GT(epoch.end_s, epoch.begin_s);
    before_s = epoch.end_s;
    frames += epoch.frames;
  }
  EXPECT_EQ(frames, review.counts.frames);
  EXPECT_THAT(
      Sentences(review),
      HasSubstr("Captured in 3 epochs: paused 1 time, suspended 0 times, cut short 1 time"));
  std::string events;
  for (const SessionEvent& event : review.events) events += event.what + "\n";
  EXPECT_THAT(events, testing::AllOf(HasSubstr("paused: asked to stop"),
                                     HasSubstr("epoch 1 was cut short"), HasSubstr("sealed: ")));
  EXPECT_THAT(NotGood(review), testing::IsEmpty()) << "a resumed session is a good one";
}

TEST_F(SessionReviewed, SuspensionsAreTold) {
  const auto folder = NewFolder("suspended");
  TestLab lab = Noisy();
  lab.errors += "[errors.drift]\nper_hour = 0\namplitude = 0.05\nperiod_s = 60\n";
  Plan plan = TestPlan();
  plan.reference = {.every = 3, .max_drift = 0.03, .resume_share = 0.5, .interval_s = 5};
  plan.warm_up.variation = 0.1;
  Devices devices = SimulatedLab(lab.Config()).MakeDevices();
  const CaptureSummary summary = RunCapture(plan, devices, folder);
  ASSERT_GT(summary.suspensions, 0);
  const SessionReview review = ReviewSession(folder);
  EXPECT_EQ(static_cast<int>(review.epochs.size()), 1 + summary.suspensions);
  EXPECT_TRUE(review.epochs[0].suspended);
  EXPECT_FALSE(review.epochs[0].paused);
  EXPECT_GE(review.lamp.suspended_ratio.size(), 2u) << "that which suspended, and the looks since";
  EXPECT_GT(std::abs(review.lamp.suspended_ratio[0].value - 1), 0.03);
  EXPECT_EQ(review.counts.missing, 0);
  EXPECT_TRUE(review.state.sealed);
  std::string events;
  for (const SessionEvent& event : review.events) events += event.what + "\n";
  EXPECT_THAT(events, testing::AllOf(HasSubstr("suspended: a reference is at 0."),
                                     HasSubstr("goes on after waiting ")));
  EXPECT_THAT(events, testing::Not(HasSubstr("cut short")));
}

TEST_F(SessionReviewed, MissingAndShortenedFilesAreBad) {
  const auto folder = NewFolder("files");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  RunCapture(TestPlan(), devices, folder);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder / "frames")) files.push_back(entry.path());
  fs::remove(files[0]);
  fs::resize_file(files[1], fs::file_size(files[1]) - 1);
  const SessionReview quick = ReviewSession(folder);
  EXPECT_EQ(quick.counts.files_missing, 1);
  EXPECT_EQ(quick.counts.files_other_size, 1);
  EXPECT_EQ(Judge(quick)[0].verdict, Verdict::kBad);
  const SessionReview verified = ReviewSession(folder, /*verify=*/true);
  ASSERT_TRUE(verified.check);
  EXPECT_GE(verified.check->problems.size(), 2u);
  EXPECT_EQ(Judge(verified)[0].verdict, Verdict::kBad);
}

// A clock whose monotonic time begins anew with each process.
class BootClock : public core::SimulatedClock {
 public:
  explicit BootClock(std::string utc) : utc_(std::move(utc)) {}
  std::string UtcIso8601() override { return utc_; }

 private:
  std::string utc_;
};

TEST_F(SessionReviewed, TimeBetweenEpochsIsThatOfTheCalendar) {
  const auto folder = NewFolder("clock");
  const core::Json plan = {{"positions", {{{"i", 0}, {"j", 0}, {"u_m", 0.0}, {"v_m", 0.0}}}}};
  BootClock before("2026-02-28T23:30:00.000Z"), after("2026-03-01T00:30:00.500Z");
  {
    auto writer = session::SessionWriter::Create(folder, plan, {{"camera", core::Json::object()}},
                                                 {}, before);
    writer.StartEpoch({{"camera", "one"}});
    before.SleepSeconds(100);
    writer.Append("paused", {{"reason", "asked to pause"}});
  }
  {
    auto writer = session::SessionWriter::Resume(folder, plan, after);
    writer.StartEpoch({{"camera", "another"}});
    after.SleepSeconds(7);
    writer.Append("paused", {{"reason", "asked to pause"}});
  }
  const SessionReview review = ReviewSession(folder);
  ASSERT_EQ(review.epochs.size(), 2u);
  EXPECT_DOUBLE_EQ(review.epochs[0].end_s, 100);
  EXPECT_DOUBLE_EQ(review.epochs[1].begin_s, 3600.5);
  EXPECT_DOUBLE_EQ(review.duration_s, 3607.5);
  EXPECT_THAT(Sentences(review), HasSubstr("devices changed between epochs"));
}

// A frequency without its standard error is none.
TEST_F(SessionReviewed, PulsesAreThoseThatHaveAFrequencyAndItsError) {
  const core::Json plan = {{"positions", {{{"i", 0}, {"j", 0}, {"u_m", 0.0}, {"v_m", 0.0}}}}};
  const auto pulses = [&](double hz, double sigma_hz) {
    const auto folder = NewFolder("pulses");
    BootClock clock("2026-03-01T00:30:00.000Z");
    {
      auto writer = session::SessionWriter::Create(folder, plan, {{"camera", core::Json::object()}},
                                                   {}, clock);
      writer.StartEpoch({{"camera", "one"}});
      writer.Append("flicker", {{"scatter", 0.02},
                                {"noise", 0.001},
                                {"hz", hz},
                                {"sigma_hz", sigma_hz},
                                {"stated_hz", 100.0}});
      writer.Append("paused", {{"reason", "asked to pause"}});
    }
    return ReviewSession(folder).lamp.pulses;
  };
  const auto found = pulses(217.3, 0.01);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->hz, 217.3);
  EXPECT_EQ(found->sigma_hz, 0.01);
  EXPECT_EQ(found->whole_periods_of_hz, 100);
  EXPECT_FALSE(pulses(217.3, 0));
  EXPECT_FALSE(pulses(0, 0.01));
}

// Frames whose checks hold no numbers tell nothing of the light at the edges.
TEST_F(SessionReviewed, ChecksThatAreNoNumbersAreNone) {
  const auto healthy = NewFolder("checked"), spoilt = NewFolder("unchecked");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  RunCapture(TestPlan(), devices, healthy);
  const session::SessionReader from(healthy);
  core::SimulatedClock clock;
  {
    auto writer = session::SessionWriter::Create(spoilt, from.plan(), from.session(), {}, clock);
    writer.StartEpoch({{"camera", "one"}});
    const core::Json words = {{"mean_dn", "much"}, {"saturated_share", 0.1}};
    for (const session::FrameRecord& record : from.frames())
      writer.CommitFrame(record, from.ReadFrame(record),
                         record.i % 2 ? words : core::Json("unseen"));
  }
  EXPECT_TRUE(ReviewSession(healthy).edges);
  EXPECT_FALSE(ReviewSession(spoilt).edges);
}

TEST_F(SessionReviewed, SessionsThatCalibrateACameraHaveNoPositions) {
  const auto folder = NewFolder("plain");
  const core::Json plan = {{"kind", "sensor"},
                           {"name", "flats"},
                           {"channels", 1},
                           {"exposure", {{"ladder_s", {0.1}}, {"pairs", 1}}}};
  core::SimulatedClock clock;
  auto writer =
      session::SessionWriter::Create(folder, plan, {{"camera", core::Json::object()}}, {}, clock);
  writer.StartEpoch({{"camera", "one"}});
  session::FrameRecord record;
  record.kind = session::FrameKind::kFlat;
  record.exposure_s = record.requested_exposure_s = 0.1;
  session::RawFrame frame;
  frame.width = frame.height = 1;
  frame.dn = {7};
  writer.CommitFrame(record, frame, {{"mean_dn", 7}});
  const SessionReview review = ReviewSession(folder);
  EXPECT_EQ(review.counts.missing, 3) << "one flat and two darks of the pairs";
  EXPECT_TRUE(review.positions.empty());
  ASSERT_EQ(review.exposures.size(), 1u);
  EXPECT_EQ(review.exposures[0].exposure_s, 0.1);
  EXPECT_FALSE(review.exposures[0].mean) << "the session states no range";
}

// One position or frame that is missing is as bad as all of them.
TEST(Judged, NothingMissingIsWhole) {
  for (const char* kind : {"light-field", "sensor"})
    for (const int missing : {0, 1, 5, 6}) {
      SessionReview review;
      review.plan.kind = kind;
      review.plan.positions = 6;
      review.counts.missing = missing;
      for (const bool sealed : {false, true})
        for (const bool in_use : {false, true}) {
          review.state.sealed = sealed;
          review.state.in_use = in_use;
          const Judgement first = Judge(review)[0];
          EXPECT_EQ(first.verdict, missing > 0 && !in_use   ? Verdict::kBad
                                   : missing > 0 || !sealed ? Verdict::kLook
                                                            : Verdict::kGood)
              << kind << ", " << missing << " missing, sealed " << sealed << ", in use " << in_use
              << ": " << first.text;
          if (missing > 0) {
            EXPECT_THAT(first.text, HasSubstr(std::to_string(missing) + " of "));
          }
        }
    }
}

TEST(Binned, KeepsMeansAndExtremes) {
  TimeSeries series;
  for (int n = 0; n < 1000; ++n) series.push_back({static_cast<double>(n), n == 437 ? 50.0 : 1.0});
  const auto bins = Binned(series, 10);
  ASSERT_EQ(bins.size(), 10u);
  for (std::size_t n = 0; n < bins.size(); ++n) {
    EXPECT_EQ(bins[n].min, 1);
    EXPECT_EQ(bins[n].max, n == 4 ? 50 : 1);
    EXPECT_NEAR(bins[n].t_s, 99.9 * static_cast<double>(n) + 49.5, 1);
  }
  EXPECT_NEAR(bins[4].mean, 1 + 49.0 / 100, 0.01);
  const auto single = Binned({{3, 4}, {3, 6}}, 5);
  ASSERT_EQ(single.size(), 1u);
  EXPECT_EQ(single[0].mean, 5);
  EXPECT_TRUE(Binned({}, 5).empty());
}

}  // namespace
}  // namespace luxfield::capture
