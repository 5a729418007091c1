#include "luxfield/reconstruct/merge/merge_session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "luxfield/core/clock.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/reconstruct/calibrate/sensor/sensor_calibration_file.h"
#include "luxfield/reconstruct/merge/merge_session_json.h"
#include "luxfield/reconstruct/solve/reconstruct.h"
#include "luxfield/session/session_writer.h"

namespace luxfield::reconstruct {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using session::FrameKind;
using session::FrameRecord;
using session::RawFrame;

constexpr int kSensor = 48;          // pixels each way
constexpr double kPitch_m = 0.5e-3;  // of a pixel; texels are 1 mm
constexpr double kSpacing_m = 2e-3;  // whole texels, so that registration is exact
constexpr double kResponsivity = 40;

json Plan() {
  return {{"geometry",
           {{"delta_m", 0.1},
            {"basis", "bspline2"},
            {"basis_a", 0},
            {"grid_width", 3},
            {"grid_height", 2},
            {"u0_m", -5e-3},
            {"v0_m", -4e-3},
            {"spacing_m", kSpacing_m},
            {"lattice",
             {{"width", 12},
              {"height", 10},
              {"s0_m", -6e-3},
              {"t1_m", 5e-3},
              {"ds_m", 1e-3},
              {"dt_m", 1e-3}}},
            {"channels", 1},
            {"unit", "lm"}}},
          {"filter", {{"kind", "basis"}, {"scale", 16.0 / 9}}},
          {"rig", {{"kind", "lensless"}}}};
}

json Session() {
  return {
      {"camera",
       {{"width", kSensor},
        {"height", kSensor},
        {"bits", 32},
        {"black_dn", 100},
        {"saturation_dn", 1e9},
        {"gain_dn_per_e", 0.5},
        {"read_noise_dn", 0},
        {"dark_current_e_per_s", 3},
        {"prnu", 0},
        {"responsivity_e_per_s_per_w_m2", {kResponsivity}},
        {"defects", json::array()}}},
      {"calibration",
       {{"image_from_sensor",
         {kPitch_m, 0, -kPitch_m * kSensor / 2, 0, -kPitch_m, kPitch_m * kSensor / 2, 0, 0, 1}}}}};
}

// Irradiance on I in the luminaire frame behind the filter (i, j), constant over texels of 1 mm.
double Irradiance(int i, int j, double s_m, double t_m) {
  const double column = std::floor(s_m * 1e3), row = std::floor(t_m * 1e3);
  return 50 + 3 * i - 2 * j + column + 0.3 * row + 0.1 * column * row;
}

struct Case {
  json plan = Plan(), session = Session();
  std::function<double(double time_s)> lamp = [](double) { return 1.0; };
  std::function<double(int print)> print = [](int) {
    return 1.0;
  };  // relative light behind each print
  int prints = 1;
  int channels = 1;         // channel n shows 1 + n times the irradiance
  bool vignetting = false;  // sensitivity falls by 30 % from the left column to the right one
  bool references = false;
  bool darks = false;
  double warm_dn_per_s = 0;  // an extra dark signal that only dark frames know
  int missing_i = -1;        // column of positions that is not taken
  double displaced_m = 0;    // stage error, known to the read-back
  std::vector<double> exposures_s = {1, 4};
  // What a frame shows over what it should, and whether it is flagged.
  std::function<double(const FrameRecord&)> level = [](const FrameRecord&) { return 1.0; };
  std::function<bool(const FrameRecord&)> flagged = [](const FrameRecord&) { return false; };
  std::function<bool(const FrameRecord&)> reading = [](const FrameRecord&) { return true; };
};

// A camera that is exact: y = black + gain t (a E R + dark), as docs/formats/session.md has it.
std::filesystem::path Capture(const std::string& name, const Case& c) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("luxfield_merge_session_" + name);
  std::filesystem::remove_all(folder);
  std::vector<std::pair<std::string, std::string>> extra;
  const auto sensitivity = [&](int column) {
    return c.vignetting ? 1.15f - 0.3f * static_cast<float>(column) / kSensor : 1.0f;
  };
  if (c.vignetting) {
    core::Image image(kSensor, kSensor, 1);
    for (int row = 0; row < kSensor; ++row)
      for (int column = 0; column < kSensor; ++column)
        image.at(0, row, column) = sensitivity(column);
    const std::filesystem::path path = folder.string() + "_vignetting.exr";
    core::WriteExrImage(path, image);
    extra.emplace_back("vignetting.exr", core::ReadFile(path));
  }
  core::SimulatedClock clock;
  session::SessionWriter writer =
      session::SessionWriter::Create(folder, c.plan, c.session, extra, clock);
  writer.StartEpoch(json::object());
  const auto frame_of = [&](double exposure_s,
                            const std::function<double(double q_s, double q_t)>& e) {
    RawFrame frame{kSensor, kSensor, {}, {}};
    for (int r = 0; r < kSensor; ++r)
      for (int col = 0; col < kSensor; ++col) {
        const double q_s = (col + 0.5 - kSensor / 2.0) * kPitch_m,
                     q_t = (kSensor / 2.0 - r - 0.5) * kPitch_m;
        const double electrons = exposure_s * (sensitivity(col) * e(q_s, q_t) * kResponsivity + 3);
        frame.value.push_back(
            static_cast<float>(100 + 0.5 * electrons + c.warm_dn_per_s * exposure_s));
      }
    return frame;
  };
  double now_s = 1000;
  const auto reference = [&](int number) {
    if (!c.references) return;
    FrameRecord record;
    record.kind = FrameKind::kReference;
    record.repeat = number;
    record.exposure_s = record.requested_exposure_s = 2;
    record.t_start_s = now_s - 1;
    record.meter = c.reading(record) ? c.lamp(now_s) : 0;
    record.flagged = c.flagged(record);
    const double level = c.lamp(now_s) * c.level(record);
    writer.CommitFrame(record, frame_of(2, [&](double, double) { return 30 * level; }),
                       json::object());
  };
  if (c.darks)
    for (const double exposure_s : {1.0, 4.0, 2.0})
      for (int repeat = 0; repeat < 2; ++repeat) {
        FrameRecord record;
        record.kind = FrameKind::kDark;
        record.repeat = repeat;
        record.exposure_index = exposure_s == 1 ? 0 : exposure_s == 4 ? 1 : 2;
        record.exposure_s = record.requested_exposure_s = exposure_s;
        record.flagged = c.flagged(record);
        const double light = c.level(record) - 1;
        writer.CommitFrame(record, frame_of(exposure_s, [&](double, double) { return light; }),
                           json::object());
      }
  reference(0);
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 3; ++i) {
      if (i == c.missing_i) continue;
      FrameRecord record;
      record.i = i;
      record.j = j;
      record.stage_u_m = -5e-3 + (i + 1.5) * kSpacing_m + c.displaced_m;
      record.stage_v_m = -4e-3 + (j + 1.5) * kSpacing_m;
      for (record.channel = 0; record.channel < c.channels; ++record.channel)
        for (record.print = 0; record.print < c.prints; ++record.print)
          for (std::size_t rung = 0; rung < c.exposures_s.size(); ++rung) {
            record.exposure_index = static_cast<int>(rung);
            record.exposure_s = record.requested_exposure_s = c.exposures_s[rung];
            record.flagged = c.flagged(record);
            now_s += 10;
            record.t_start_s = now_s - record.exposure_s / 2;
            const auto e = [&](double q_s, double q_t) {
              return c.level(record) * c.lamp(now_s) * c.print(record.print) *
                     (1 + record.channel) *
                     Irradiance(i, j, record.stage_u_m + q_s, record.stage_v_m + q_t);
            };
            writer.CommitFrame(record, frame_of(record.exposure_s, e), json::object());
          }
      writer.CompletePosition(i, j);
    }
    now_s += 10;
    reference(j + 1);
  }
  writer.Seal("done");
  return folder;
}

class MergeSessionTest : public testing::Test {
 protected:
};

lightfield::Measurements Merge(const std::string& name, const Case& c,
                               MergeSessionSummary* summary = nullptr) {
  return MergeSession(session::SessionReader(Capture(name, c)), {}, summary);
}

// Largest relative deviation from factor * Irradiance over known texels.
double WorstError(const lightfield::Measurements& m, double factor) {
  double worst = 0;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 3; ++i)
      for (int r = 0; r < 10; ++r)
        for (int c = 0; c < 12; ++c) {
          const auto& position = m.positions[j * 3 + i];
          if (position.mask[r * 12 + c] != 0) continue;
          const lightfield::Vec2 s = m.geometry.lattice.centre(r, c);
          const double truth = factor * Irradiance(i, j, s.x, s.y);
          worst = std::max(worst, std::abs(position.irradiance[r * 12 + c] / truth - 1));
        }
  return worst;
}

TEST_F(MergeSessionTest, WritesPositionByPositionTheSameFile) {
  Case c;
  c.references = c.darks = true;
  c.missing_i = 1;
  c.displaced_m = 1e-5;
  const session::SessionReader session(Capture("stream", c));
  const fs::path folder = testing::TempDir();
  MergeSessionSummary whole, streamed;
  lightfield::WriteMeasurements(folder / "whole.meas.exr", MergeSession(session, {}, &whole));
  MergeSessionToFile(session, folder / "streamed.meas.exr", {}, &streamed);
  EXPECT_EQ(core::ReadFile(folder / "whole.meas.exr"),
            core::ReadFile(folder / "streamed.meas.exr"));
  EXPECT_EQ(ToJson(whole), ToJson(streamed));
  EXPECT_EQ(streamed.missing_positions, 2);
}

TEST_F(MergeSessionTest, BringsBackTheIrradianceOfAnExactCamera) {
  MergeSessionSummary summary;
  const lightfield::Measurements m = Merge("exact", {}, &summary);
  EXPECT_EQ(summary.frames, 12);
  EXPECT_EQ(summary.missing_positions, 0);
  EXPECT_LT(summary.largest_displacement, 1e-9);
  for (const auto& position : m.positions)
    for (std::size_t p = 0; p < position.mask.size(); ++p) {
      ASSERT_EQ(position.mask[p], 0u);
      EXPECT_GT(position.sigma[p], 0);
      EXPECT_GT(position.count[p], 1);
      EXPECT_LT(position.count[p], 2);
    }
  EXPECT_LT(WorstError(m, 9.0 / 16), 1e-6);  // float32 frames
  EXPECT_EQ(m.filter_scale, 16.0 / 9);
  EXPECT_EQ(m.geometry.unit, lightfield::FluxUnit::kLumen);
  EXPECT_EQ(m.provenance.at("merge_estimator"), "inverse-variance");
}

TEST_F(MergeSessionTest, CorrectsLampDriftBetweenReferences) {
  Case c;
  c.references = true;
  c.lamp = [](double time_s) {
    return 1 + 4e-4 * (time_s - 1000);
  };  // linear: interpolation is exact
  MergeSessionSummary summary;
  const lightfield::Measurements m = Merge("drift", c, &summary);
  EXPECT_LT(WorstError(m, 9.0 / 16), 2e-6);
  EXPECT_EQ(summary.reference_frames, 3);
  EXPECT_NEAR(summary.least_lamp_factor, 1.004, 1e-6);
  EXPECT_NEAR(summary.largest_lamp_factor, 1.052, 1e-6);
  c.references = false;
  EXPECT_GT(WorstError(Merge("drift_unseen", c), 9.0 / 16), 0.03);
}

TEST_F(MergeSessionTest, RefersToTheLampThatItsMonitorCallsOne) {
  Case c;
  c.references = true;
  c.lamp = [](double time_s) { return 1.05 - 4e-4 * (time_s - 1000); };
  const session::SessionReader session(Capture("monitor", c));
  MergeSessionOptions options;
  EXPECT_LT(WorstError(MergeSession(session, options), 9.0 / 16 * 1.05), 2e-6);
  options.lamp_level = LampLevel::kMonitorUnity;
  EXPECT_LT(WorstError(MergeSession(session, options), 9.0 / 16), 2e-6);
  const session::SessionReader without(Capture("no_monitor", {}));
  EXPECT_THROW(MergeSession(without, options), InputError);
}

TEST_F(MergeSessionTest, SubtractsDarkFrames) {
  Case c;
  c.warm_dn_per_s = 40;
  EXPECT_GT(WorstError(Merge("warm", c), 9.0 / 16), 0.01);
  c.darks = true;
  MergeSessionSummary summary;
  EXPECT_LT(WorstError(Merge("darks", c, &summary), 9.0 / 16), 2e-6);
  EXPECT_EQ(summary.dark_frames, 6);
}

TEST_F(MergeSessionTest, TakesACalibrationInPlaceOfTheStatedFigures) {
  Case c;
  const session::SessionReader session(Capture("calibration", c));
  SensorCalibration calibration;
  calibration.width = calibration.height = kSensor;
  calibration.bits = 32;
  // Half the stated gain: twice the electrons per DN. The black level and dark signal in DN stay.
  calibration.transfer.gain_dn_per_e = {0.25, 0};
  calibration.transfer.offset_dn = {100, 0};
  calibration.transfer.dark_current_e_per_s = {6, 0};
  calibration.prnu = {0.5, 0};
  MergeSessionOptions options;
  const fs::path file = fs::path(testing::TempDir()) / "luxfield_merge.cal.json";
  options.calibrations = {file};
  WriteSensorCalibration(file, calibration);
  const lightfield::Measurements m = MergeSession(session, options);
  EXPECT_LT(WorstError(m, 2 * 9.0 / 16), 2e-6);
  EXPECT_GT(m.positions[0].sigma[0], 0.2f * m.positions[0].irradiance[0]);
  EXPECT_EQ(m.provenance.at("sensor_calibration"), core::Sha256OfFile(file));
  calibration.width = kSensor + 1;
  WriteSensorCalibration(file, calibration);
  EXPECT_THROW(MergeSession(session, options), InputError);
}

TEST_F(MergeSessionTest, DividesByTheAlbedoOfTheReflector) {
  Case c;
  c.plan["rig"] = {{"kind", "reflector"}, {"albedo", 0.8}};
  EXPECT_LT(WorstError(Merge("reflector", c), 9.0 / 16 / 0.8), 1e-6);
}

TEST_F(MergeSessionTest, HandlesColourAndVignetting) {
  Case c;
  c.channels = 3;
  c.vignetting = true;
  c.plan["geometry"]["channels"] = 3;
  c.session["camera"]["vignetting"] = "vignetting.exr";
  c.session["camera"]["responsivity_e_per_s_per_w_m2"] = {kResponsivity, 2 * kResponsivity,
                                                          kResponsivity};
  const lightfield::Measurements m = Merge("colour", c);
  EXPECT_LT(WorstError(m, 9.0 / 16), 2e-6);
  for (const auto& position : m.positions)
    for (std::size_t p = 0; p < 120; ++p) {
      EXPECT_NEAR(position.irradiance[120 + p], position.irradiance[p],
                  2e-6 * position.irradiance[p]);  // 2 / 2
      EXPECT_NEAR(position.irradiance[240 + p], 3 * position.irradiance[p],
                  6e-6 * position.irradiance[p]);
    }
}

TEST_F(MergeSessionTest, CombinesDualPrintsToSignedIrradiance) {
  Case c;
  c.plan["filter"] = {{"kind", "dual"}, {"scale", 1}};
  c.plan["geometry"]["basis"] = "quadratic";
  c.plan["geometry"]["basis_a"] = 0.5;
  c.plan["geometry"]["u0_m"] = -4e-3;  // two cells: the centres stay where the frames have them
  c.plan["geometry"]["v0_m"] = -3e-3;
  c.prints = 2;
  c.print = [](int print) { return print == 0 ? 1.0 : 0.5; };
  const lightfield::Measurements m = Merge("dual", c);
  // Peaks 9 and 0.919 (docs/theory.md 3, "Filters"): D(x) = 3 (1 - x)(1 - 1.875 x) is least
  // at x = 0.7667, where it is -0.30625.
  EXPECT_LT(WorstError(m, 9 - 0.5 * 3 * 0.30625), 2e-6);
  EXPECT_EQ(m.filter, lightfield::FilterKind::kDual);
}

TEST_F(MergeSessionTest, MarksMissingPositionsAsUnknown) {
  Case c;
  c.missing_i = 1;
  MergeSessionSummary summary;
  const lightfield::Measurements m = Merge("missing", c, &summary);
  EXPECT_EQ(summary.missing_positions, 2);
  EXPECT_LT(WorstError(m, 9.0 / 16), 1e-6);
  for (const int position : {1, 4})
    for (const std::uint32_t mask : m.positions[position].mask)
      EXPECT_EQ(mask, lightfield::kOffSensor);
  const Reconstruction result = Reconstruct(m);
  EXPECT_EQ(result.report.incomplete.incomplete, 120u);
}

// The frames that entered.
class SeenFrames : public MergeObserver {
 public:
  void OnReferences(std::span<const MergedReference> references, const LampDrift&) override {
    for (const MergedReference& reference : references) signals_dn.push_back(reference.signal_dn);
    if (!references.empty()) pixels = *references.front().pixels;
  }
  void OnExposures(const SessionExposures&) override {}
  void OnBracket(const MergedBracket& bracket) override {
    EXPECT_EQ(bracket.records.size(), bracket.exposures.size());
    for (const FrameRecord* record : bracket.records) files.push_back(record->file);
  }
  std::vector<std::string> files;
  std::vector<double> signals_dn;  // of references
  std::vector<std::size_t> pixels;
};

bool IsOfPosition(const FrameRecord& record, int i, int j) {
  return record.kind == FrameKind::kPosition && record.i == i && record.j == j;
}

// Nothing but the pixels that are summed, less black level and dark current.
TEST_F(MergeSessionTest, TheSignalOfAReferenceIsTheSumOfItsPixels) {
  Case c;
  c.references = true;
  c.lamp = [](double time_s) { return 1 + 4e-4 * (time_s - 1000); };
  const session::SessionReader session(Capture("reference_sums", c));
  SeenFrames seen;
  MergeSessionOptions options;
  options.observer = &seen;
  MergeSession(session, options);
  ASSERT_FALSE(seen.pixels.empty());
  std::size_t n = 0;
  for (const FrameRecord& record : session.frames()) {
    if (record.kind != FrameKind::kReference) continue;
    const session::RawFrame frame = session.ReadFrame(record);
    double sum = 0;
    for (const std::size_t pixel : seen.pixels)
      sum += frame.at(pixel) - (100 + 0.5 * 3 * record.exposure_s);
    ASSERT_LT(n, seen.signals_dn.size());
    EXPECT_NEAR(seen.signals_dn[n++] / sum, 1, 1e-9);
  }
  EXPECT_EQ(n, 3u);
}

TEST_F(MergeSessionTest, LeavesOutAFrameWhoseLevelContradictsTheOthers) {
  // Whichever frame is wrong: capture sees the next longer one depart from it, or all longer ones
  // where it is the first.
  for (int wrong = 0; wrong < 3; ++wrong) {
    Case c;
    c.session["camera"]["saturation_dn"] = 1e5;
    c.exposures_s = {1, 2, 4};
    c.references = true;
    c.level = [&](const FrameRecord& r) {
      return IsOfPosition(r, 1, 0) && r.exposure_index == wrong ? 0.8 : 1.0;
    };
    EXPECT_GT(WorstError(Merge("level_unflagged", c), 9.0 / 16), 0.02) << wrong;
    c.flagged = [&](const FrameRecord& r) {
      return IsOfPosition(r, 1, 0) &&
             (wrong == 0 ? r.exposure_index > 0 : r.exposure_index == wrong);
    };
    MergeSessionSummary summary;
    const auto m = Merge("level", c, &summary);
    EXPECT_LT(WorstError(m, 9.0 / 16), 1e-6) << wrong;
    EXPECT_EQ(summary.flagged_frames, wrong == 0 ? 2 : 1);
    EXPECT_EQ(summary.frames_left_out, 1);
    EXPECT_EQ(summary.brackets_left_out, 0);
    EXPECT_EQ(summary.missing_positions, 0);
    EXPECT_EQ(summary.frames, 17);
    for (const auto& position : m.positions) EXPECT_EQ(position.mask[0], 0u);
    // What is carried through the merge for an error budget is of the same frames.
    const session::SessionReader session(Capture("level_seen", c));
    SeenFrames seen;
    MergeSessionOptions options;
    options.observer = &seen;
    MergeSession(session, options);
    std::size_t entered = 0;
    for (const FrameRecord& r : session.frames()) {
      if (r.kind != FrameKind::kPosition) continue;
      const bool there =
          std::find(seen.files.begin(), seen.files.end(), r.file) != seen.files.end();
      EXPECT_EQ(there, c.level(r) == 1) << r.file;
      entered += there;
    }
    EXPECT_EQ(entered, seen.files.size());
  }
}

TEST_F(MergeSessionTest, APositionWhereNoFrameIsToBeBelievedIsMissing) {
  // Two frames apart: either may be wrong. Behind dual prints the other print's bracket is whole.
  Case c;
  c.session["camera"]["saturation_dn"] = 1e5;
  c.prints = 2;
  c.plan["filter"] = {{"kind", "dual"}, {"scale", 1}};
  c.plan["geometry"]["basis"] = "quadratic";
  c.plan["geometry"]["u0_m"] = -4e-3;
  c.plan["geometry"]["v0_m"] = -3e-3;
  c.level = [](const FrameRecord& r) {
    return IsOfPosition(r, 2, 1) && r.print == 1 && r.exposure_index == 1 ? 1.3 : 1.0;
  };
  c.flagged = [&](const FrameRecord& r) { return c.level(r) != 1; };
  MergeSessionSummary summary;
  const lightfield::Measurements m = Merge("level_missing", c, &summary);
  EXPECT_EQ(summary.frames_left_out, 2);
  EXPECT_EQ(summary.brackets_left_out, 1);
  EXPECT_EQ(summary.missing_positions, 1);
  for (int k = 0; k < 6; ++k)
    for (const std::uint32_t mask : m.positions[k].mask)
      EXPECT_EQ(mask, k == 5 ? std::uint32_t{lightfield::kOffSensor} : 0u) << k;
  EXPECT_EQ(Reconstruct(m).report.incomplete.incomplete, 120u);
}

TEST_F(MergeSessionTest, AFlagForSaturationLeavesNothingOut) {
  Case c;
  c.exposures_s = {1, 2, 4};
  c.session["camera"]["saturation_dn"] = 1500;  // the brightest pixels in the shortest exposure
  c.flagged = [](const FrameRecord& r) {
    return r.kind == FrameKind::kPosition && r.exposure_index == 0;
  };
  MergeSessionSummary summary;
  const auto flagged = Merge("saturated_flagged", c, &summary);
  EXPECT_EQ(summary.flagged_frames, 6);
  EXPECT_EQ(summary.frames_left_out, 0);
  EXPECT_EQ(summary.frames, 18);
  c.flagged = [](const FrameRecord&) { return false; };
  const auto plain = Merge("saturated", c);
  for (std::size_t k = 0; k < plain.positions.size(); ++k) {
    EXPECT_EQ(flagged.positions[k].irradiance, plain.positions[k].irradiance);
    EXPECT_EQ(flagged.positions[k].mask, plain.positions[k].mask);
  }
}

TEST_F(MergeSessionTest, FlaggedDarksDoNotEnter) {
  Case c;
  c.darks = true;
  c.level = [](const FrameRecord& r) {  // light gets in
    return r.kind == FrameKind::kDark && r.repeat == 1 ? 21.0 : 1.0;
  };
  EXPECT_GT(WorstError(Merge("dark_unflagged", c), 9.0 / 16), 0.02);
  c.flagged = [&](const FrameRecord& r) { return c.level(r) != 1; };
  MergeSessionSummary summary;
  EXPECT_LT(WorstError(Merge("dark_flagged", c, &summary), 9.0 / 16), 1e-6);
  EXPECT_EQ(summary.flagged_darks, 3);
  EXPECT_EQ(summary.dark_frames, 3);
}

TEST_F(MergeSessionTest, AReferenceWithoutAReadingTellsTheLampsLevelAllTheSame) {
  Case c;
  c.references = true;
  c.lamp = [](double time_s) { return 1.05 + 4e-4 * (time_s - 1000); };
  const auto all = session::SessionReader(Capture("readings", c));
  MergeSessionOptions options;
  options.lamp_level = LampLevel::kMonitorUnity;
  EXPECT_LT(WorstError(MergeSession(all, options), 9.0 / 16), 2e-6);
  c.flagged = [](const FrameRecord& r) { return r.kind == FrameKind::kReference && r.repeat == 1; };
  c.reading = [](const FrameRecord& r) { return r.repeat != 1; };
  const auto one_lacks = session::SessionReader(Capture("reading_lacks", c));
  MergeSessionSummary summary;
  EXPECT_LT(WorstError(MergeSession(one_lacks, options, &summary), 9.0 / 16), 2e-6);
  EXPECT_EQ(summary.reference_frames, 3);
  c.flagged = [](const FrameRecord& r) { return r.kind == FrameKind::kReference; };
  c.reading = [](const FrameRecord&) { return false; };
  const auto all_lack = session::SessionReader(Capture("readings_lack", c));
  EXPECT_THROW(MergeSession(all_lack, options), InputError);
  EXPECT_LT(WorstError(MergeSession(all_lack), 9.0 / 16 * 1.05), 2e-6);
}

TEST_F(MergeSessionTest, UsesTheReadBackAndRefusesAFilterOutOfPlace) {
  Case c;
  c.displaced_m = 0.05 * kSpacing_m;  // 0.1 texels: the image shifts with it
  MergeSessionSummary summary;
  const lightfield::Measurements m = Merge("displaced", c, &summary);
  EXPECT_NEAR(summary.largest_displacement, 0.05, 1e-9);
  // The pattern is constant over texels, but pixels now straddle texel borders by 0.2 pixels: a few
  // percent of a step of about 2.
  EXPECT_LT(WorstError(m, 9.0 / 16), 0.02);
  c.displaced_m = 0.11 * kSpacing_m;
  try {
    Merge("far", c);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("position (0, 0)"), std::string::npos) << error.what();
  }
}

TEST_F(MergeSessionTest, NamesWhatIsWrongInThePlanAndTheSession) {
  const std::pair<const char*, std::function<void(Case&)>> damage[] = {
      {"spacing_m", [](Case& c) { c.plan["geometry"].erase("spacing_m"); }},
      {"delta_m", [](Case& c) { c.plan["geometry"]["delta_m"] = -1; }},
      {"nurbs", [](Case& c) { c.plan["geometry"]["basis"] = "nurbs"; }},
      {"width", [](Case& c) { c.plan["geometry"]["lattice"] = 5; }},
      {"scale", [](Case& c) { c.plan["filter"]["scale"] = 0; }},
      {"kind", [](Case& c) { c.plan["filter"]["kind"] = "triple"; }},
      {"rig", [](Case& c) { c.plan.erase("rig"); }},
      {"albedo",
       [](Case& c) {
         c.plan["rig"] = {{"kind", "reflector"}};
       }},
      {"image_from_sensor",
       [](Case& c) {
         c.session["calibration"]["image_from_sensor"] = {1, 2, 3};
       }},
      {"camera", [](Case& c) { c.session.erase("camera"); }},
      {"not in plan.json", [](Case& c) { c.plan["geometry"]["grid_width"] = 2; }},
      {"has 48 x 48 pixels, the session's camera has 47 x 48",
       [](Case& c) { c.session["camera"]["width"] = 47; }},
  };
  for (const auto& [text, spoil] : damage) {
    Case c;
    spoil(c);
    try {
      Merge("damaged", c);
      ADD_FAILURE() << text << " was accepted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos)
          << text << ": " << error.what();
    }
  }
}

}  // namespace
}  // namespace luxfield::reconstruct
