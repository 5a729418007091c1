#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/hal/sim/world.h"
#include "tests/hal/test_lab.h"

namespace luxfield::hal::sim {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr double kSoon = 1e9;  // a deadline that is never reached

std::string MessageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

std::string ErrorOf(const TestLab& lab) {
  return MessageOf([&] { SimulatedLab made(lab.Config()); });
}

// One exposure of the lamp through the filter at `centre`, and nothing else.
session::RawFrame FrameOf(const TestLab& lab, double exposure_s = 0.01, Vec2 centre = {0.02, 0},
                          double wait_s = 0) {
  Devices devices = SimulatedLab(lab.Config()).MakeDevices();
  devices.supply->SetOutput(true, kSoon);
  devices.clock->SleepSeconds(wait_s);
  devices.stage->Home(kSoon);
  devices.stage->MoveTo(centre, kSoon);
  devices.camera->Configure({exposure_s}, kSoon);
  return devices.camera->Expose(kSoon).image;
}

double SignalOf(const session::RawFrame& frame) {
  double sum = 0;
  for (std::size_t k = 0; k < frame.size(); ++k) sum += frame.at(k) - 100;
  return sum;
}

TestLab WithError(const std::string& error, const std::string& text) {
  TestLab lab;
  lab.lab = "";
  lab.errors = "[errors." + error + "]\n" + text;
  return lab;
}

TEST(Lab, EveryMistakeNamesFileAndField) {
  TestLab lab;
  EXPECT_EQ(ErrorOf(lab), "no error");
  lab.rig = "kind = \"pinhole\"";
  EXPECT_THAT(ErrorOf(lab), testing::AllOf(HasSubstr("lab.toml"), HasSubstr("rig.kind")));
  lab = {};
  lab.filter = "spacing_m = -1";
  EXPECT_THAT(ErrorOf(lab), testing::AllOf(HasSubstr("lab.toml"), HasSubstr("filter.spacing_m")));
  lab.filter = "spacing_m = 0.02\nscale = 2";
  EXPECT_THAT(ErrorOf(lab), HasSubstr("filter.scale"));
  lab.filter = "spacing_m = 0.02\nkind = \"dual\"";
  EXPECT_THAT(ErrorOf(lab), testing::AllOf(HasSubstr("filter.basis"), HasSubstr("no dual filter")));
  lab = {};
  lab.lamp = "kind = \"candle\"";
  EXPECT_THAT(ErrorOf(lab), HasSubstr("lamp.kind"));
  lab.lamp = "kind = \"lightfield\"\nfile = \"nowhere.lf.exr\"";
  EXPECT_THAT(ErrorOf(lab), HasSubstr("nowhere.lf.exr"));
  lab = {};
  lab.camera = "width = 0\nheight = 3\npitch_m = 1";
  EXPECT_THAT(ErrorOf(lab), HasSubstr("camera.width"));
  lab.camera = "width = 4\nheight = 3\npitch_m = 1\ncolour = true";
  EXPECT_THAT(ErrorOf(lab), HasSubstr("camera.colour"));
  lab = {};
  lab.rig = "kind = \"reflector\"\nalbedo = 0.9";
  lab.camera = "width = 4\nheight = 3\ncorners_m = [0,0, 1,0, 1,1, 0,1]";  // anticlockwise seen
                                                                           // from the receivers
  EXPECT_THAT(ErrorOf(lab), HasSubstr("camera.corners_m"));
  EXPECT_THAT(ErrorOf(WithError("read_noise", "rms_dn = -1")),
              HasSubstr("errors.read_noise.rms_dn"));
  EXPECT_THAT(ErrorOf(WithError("gravity", "g = 9.81")), HasSubstr("errors.gravity"));
}

TEST(Lab, OtherDriversAreRefusedByName) {
  const auto path =
      fs::path(testing::TempDir()) / ("driver_" + std::to_string(::getpid()) + ".toml");
  std::ofstream(path) << "[lab]\ndriver = \"aravis\"\n";
  EXPECT_THAT(MessageOf([&] { MakeDevices(path); }),
              testing::AllOf(HasSubstr("lab.driver"), HasSubstr("aravis"),
                             HasSubstr("use one of: sim, devices")));
}

TEST(Lab, StageKeepsItsRules) {
  Devices devices = SimulatedLab(TestLab{}.Config()).MakeDevices();
  EXPECT_THAT(MessageOf([&] { devices.stage->MoveTo({0, 0.01}, kSoon); }), HasSubstr("not homed"));
  devices.stage->Home(kSoon);
  EXPECT_THAT(MessageOf([&] {
                devices.stage->MoveTo({0, 0.11}, kSoon);
              }),
              HasSubstr("out of range"));
  EXPECT_THAT(MessageOf([&] {
                devices.stage->MoveTo({NAN, 0}, kSoon);
              }),
              HasSubstr("out of range"));
  const double start = devices.clock->MonotonicSeconds();
  devices.stage->MoveTo({0.05, -0.1}, kSoon);
  EXPECT_NEAR(devices.clock->MonotonicSeconds() - start, 0.1 / 0.05 + 0.5, 1e-9);
  EXPECT_EQ(devices.stage->Where().readback.y, -0.1);
  const double now = devices.clock->MonotonicSeconds();
  EXPECT_THAT(MessageOf([&] { devices.stage->MoveTo({0, 0}, now + 0.1); }), HasSubstr("timeout"));
  EXPECT_NEAR(devices.clock->MonotonicSeconds(), now + 0.1, 1e-9);
}

TEST(Lab, CameraReadsBackAndNumbersItsFrames) {
  TestLab lab;
  lab.camera += "\nexposure_step_s = 0.001\nreadout_s = 0.25";
  Devices devices = SimulatedLab(lab.Config()).MakeDevices();
  EXPECT_THAT(MessageOf([&] { devices.camera->Expose(kSoon); }), HasSubstr("never configured"));
  EXPECT_THAT(MessageOf([&] { devices.camera->Configure({100}, kSoon); }),
              HasSubstr("out of range"));
  const AppliedSettings applied = devices.camera->Configure({0.0123}, kSoon);
  EXPECT_NEAR(applied.exposure_s, 0.012, 1e-12);
  const Frame a = devices.camera->Expose(kSoon), b = devices.camera->Expose(kSoon);
  EXPECT_EQ(b.frame_id, a.frame_id + 1);
  EXPECT_NEAR(b.t_start_s - a.t_start_s, 0.012 + 0.25, 1e-9);
  EXPECT_EQ(a.settings.exposure_s, applied.exposure_s);
  EXPECT_THAT(MessageOf([&] { devices.camera->Expose(devices.clock->MonotonicSeconds() + 0.1); }),
              HasSubstr("timeout"));
}

TEST(Lab, NoLightWithoutLampOrWithClosedShutter) {
  Devices devices = SimulatedLab(TestLab{}.Config()).MakeDevices();
  devices.camera->Configure({0.01}, kSoon);
  EXPECT_EQ(SignalOf(devices.camera->Expose(kSoon).image), 0);
  devices.supply->SetOutput(true, kSoon);
  EXPECT_GT(SignalOf(devices.camera->Expose(kSoon).image), 1);
  devices.shutter->Select("closed", kSoon);
  EXPECT_EQ(SignalOf(devices.camera->Expose(kSoon).image), 0);
  EXPECT_THAT(MessageOf([&] { devices.shutter->Select("ajar", kSoon); }), HasSubstr("ajar"));
}

TEST(Lab, IdealSwitchesEveryErrorOff) {
  TestLab clean, all;
  all.errors =
      "[errors.photon_noise]\n[errors.read_noise]\nrms_dn = 2\n[errors.dark_current]\ne_per_s = "
      "9\n[errors.prnu]\nrms = 0.01\n"
      "[errors.hot_pixels]\ncount = 9\ne_per_s = 1e4\n[errors.vignetting]\ncorner_loss = "
      "0.3\n[errors.shutter]\njitter_s = 1e-3\n"
      "[errors.warm_up]\nexcess = 0.1\ntau_s = 100\n[errors.drift]\nper_hour = "
      "0.1\n[errors.pwm]\nhz = 100\nduty = 0.3\n"
      "[errors.stage]\nrepeatability_m = 1e-4\n[errors.registration]\nshift_m = [1e-3, "
      "0]\n[errors.density]\nrelative = 0.1\n"
      "[errors.stray_light]\nshare = 0.1\n[errors.monitor_noise]\nrelative = 0.1\n";
  const auto a = FrameOf(clean), b = FrameOf(all);
  EXPECT_FALSE(a.value.empty()) << "no ADC";
  EXPECT_EQ(a.value, b.value);
  all.lab = "";
  EXPECT_TRUE(FrameOf(all).value.empty());
}

// The lamp's sources scale the frame by what LampTime states.
TEST(Lab, DriftWarmUpAndPwmScaleTheFrame) {
  const double clean =
      SignalOf(FrameOf(WithError("drift", "per_hour = 0\nenabled = true"), 0.01, {0.02, 0}, 3600));
  const double late =
      SignalOf(FrameOf(WithError("drift", "per_hour = 0.1"), 0.01, {0.02, 0}, 3600));
  EXPECT_NEAR(late / clean, 1.1, 1e-3);  // 12-bit rounding of every pixel
  const double cold = SignalOf(FrameOf(WithError("warm_up", "excess = 0.2\ntau_s = 1e6")));
  EXPECT_NEAR(cold / clean, 1.2, 2e-3);
  // Half a period at full duty 1/2: either twice the mean or nothing or between, never the mean of
  // whole periods by chance.
  const double whole = SignalOf(FrameOf(WithError("pwm", "hz = 100\nduty = 0.5"), 0.01));
  EXPECT_NEAR(whole / clean, 1, 1e-3);
}

// Shutter jitter is the one difference between two exposures of a lab without other errors.
TEST(Lab, ShutterJitterAndMonitorNoiseHaveTheirStatedSize) {
  constexpr int kCount = 400;
  constexpr double kExposure_s = 0.05, kJitter_s = 0.002, kMonitor = 0.01;
  TestLab lab = WithError("shutter", "jitter_s = 0.002");
  lab.errors += "\n[errors.monitor_noise]\nrelative = 0.01";
  lab.camera = "pitch_m = 0.1\nwidth = 2\nheight = 2";
  lab.lamp = "kind = \"square\"\nside_m = 0.06\nradiance = 10000";
  Devices devices = SimulatedLab(lab.Config()).MakeDevices();
  devices.supply->SetOutput(true, kSoon);
  devices.camera->Configure({kExposure_s}, kSoon);
  double sum = 0, squares = 0, sum_monitor = 0, squares_monitor = 0;
  for (int k = 0; k < kCount; ++k) {
    const double signal = SignalOf(devices.camera->Expose(kSoon).image);
    const double monitor = devices.monitor->Read(kSoon).value;
    sum += signal / kCount;
    squares += signal * signal / kCount;
    sum_monitor += monitor / kCount;
    squares_monitor += monitor * monitor / kCount;
  }
  // The relative error of a standard deviation from n samples is 1 / sqrt(2 n).
  const double tolerance = 4 / std::sqrt(2.0 * kCount);
  EXPECT_GT(sum, 1000) << "bright enough that rounding does not matter";
  EXPECT_NEAR(std::sqrt(squares - sum * sum) / sum / (kJitter_s / kExposure_s), 1, tolerance);
  EXPECT_NEAR(std::sqrt(squares_monitor - sum_monitor * sum_monitor) / kMonitor, 1, tolerance);
  EXPECT_NEAR(sum_monitor, 1, 4 * kMonitor / std::sqrt(kCount));
}

TEST(Lab, AWrongExposureTimeIsWrongAlikeWheneverItIsTaken) {
  constexpr int kTimes = 200;
  constexpr double kError_s = 0.002;
  TestLab lab = WithError("shutter", "time_s = 0.002");
  lab.camera = "pitch_m = 0.1\nwidth = 2\nheight = 2";
  lab.lamp = "kind = \"square\"\nside_m = 0.06\nradiance = 10000";
  Devices devices = SimulatedLab(lab.Config()).MakeDevices();
  TestLab right = lab;
  right.errors = "";
  Devices without = SimulatedLab(right.Config()).MakeDevices();
  devices.supply->SetOutput(true, kSoon);
  without.supply->SetOutput(true, kSoon);
  const auto signal = [](Devices& of, double exposure_s) {
    of.camera->Configure({exposure_s}, kSoon);
    return SignalOf(of.camera->Expose(kSoon).image);
  };
  double squares = 0;
  for (int k = 0; k < kTimes; ++k) {
    const double exposure_s = 0.03 + 1e-4 * k, once = signal(devices, exposure_s);
    EXPECT_EQ(signal(devices, exposure_s), once);
    squares += std::pow((once / signal(without, exposure_s) - 1) * exposure_s, 2) / kTimes;
  }
  EXPECT_NEAR(std::sqrt(squares) / kError_s, 1, 4 / std::sqrt(2.0 * kTimes));
}

TEST(Lab, StrayLightAddsItsShareEvenly) {
  TestLab clean;
  clean.lab = "";
  const auto a = FrameOf(clean), b = FrameOf(WithError("stray_light", "share = 0.25"));
  const double added = 0.25 * SignalOf(a) / static_cast<double>(a.size());
  for (std::size_t k = 0; k < a.size(); ++k)
    EXPECT_NEAR(b.at(k) - a.at(k), added, 1.1);  // two roundings
}

TEST(Lab, PrintErrorsChangeTheLight) {
  TestLab clean;
  clean.lab = "";
  const double signal = SignalOf(FrameOf(clean));
  EXPECT_NEAR(SignalOf(FrameOf(WithError("density", "relative = 0.05"))) / signal, 1.05, 1e-3);
  // A shift of print alone is what moving filter and sensor by it does to the light, apart from
  // where the image lies: the totals over a sensor that sees everything agree.
  const double shifted = SignalOf(FrameOf(WithError("registration", "shift_m = [0.004, 0]")));
  const double moved = SignalOf(FrameOf(clean, 0.01, {0.024, 0}));
  EXPECT_GT(std::abs(shifted / signal - 1), 0.05);
  EXPECT_NEAR(shifted / moved, 1, 0.02);
}

TEST(Lab, StageErrorIsDrawnAnewOnEveryVisit) {
  const TestLab lab = WithError("stage", "repeatability_m = 2e-3");
  Devices devices = SimulatedLab(lab.Config()).MakeDevices();
  EXPECT_EQ(devices.stage->limits().repeatability_m, 2e-3);
  devices.supply->SetOutput(true, kSoon);
  devices.stage->Home(kSoon);
  devices.camera->Configure({0.01}, kSoon);
  std::vector<double> signals;
  for (int visit = 0; visit < 3; ++visit) {
    devices.stage->MoveTo({0.03, 0}, kSoon);
    const auto first = devices.camera->Expose(kSoon).image;
    EXPECT_EQ(first.dn, devices.camera->Expose(kSoon).image.dn) << "standing still";
    signals.push_back(SignalOf(first));
    devices.stage->MoveTo({0, 0}, kSoon);
  }
  EXPECT_NE(signals[0], signals[1]);
  EXPECT_NE(signals[1], signals[2]);
  EXPECT_NEAR(signals[0] / signals[1], 1, 0.5);
}

// Announcing only saves work.
TEST(Lab, AnnouncedVisitsGiveTheSameFrames) {
  for (const bool small_memory : {false, true}) {
    TestLab lab = WithError("stage", "repeatability_m = 1e-4");
    if (small_memory) lab.errors += "\n[sampling]\nmemory_mib = 1\n";
    const std::vector<Vec2> centres = {{0.02, 0}, {0, 0.02}, {0.02, 0}};
    std::vector<std::vector<std::uint16_t>> frames[2];
    for (const bool announced : {false, true}) {
      Devices devices = SimulatedLab(lab.Config()).MakeDevices();
      devices.supply->SetOutput(true, kSoon);
      devices.stage->Home(kSoon);
      devices.camera->Configure({0.01}, kSoon);
      if (announced) devices.announce({0, centres});
      for (const Vec2 centre : centres) {
        devices.stage->MoveTo(centre, kSoon);
        frames[announced].push_back(devices.camera->Expose(kSoon).image.dn);
      }
    }
    for (std::size_t k = 0; k < centres.size(); ++k)
      for (std::size_t pixel = 0; pixel < frames[0][k].size(); ++pixel)
        EXPECT_NEAR(frames[0][k][pixel], frames[1][k][pixel], 1)
            << k;  // another sampling lattice may round the other way
  }
}

// Rig (b): the same light through a homography, times the albedo.
TEST(Lab, ReflectorSeesTheIrradianceThroughItsHomography) {
  TestLab lab;
  lab.lamp = "kind = \"square\"\nside_m = 0.06\nradiance = 1000";  // on F: smooth on I
  lab.rig = "kind = \"reflector\"\nalbedo = 0.8";
  lab.camera = "width = 64\nheight = 48\ncorners_m = [-0.3,0.3, 0.25,0.35, 0.3,-0.25, -0.25,-0.3]";
  const LabDescription description = ReadLab(lab.Config(), {});
  const Vec2 centre{0.02, 0};
  const auto frame = FrameOf(lab, 0.01, centre);
  TraceOptions options;
  options.delta_m = 0.25;
  options.cell_m = 0.02;
  options.cell_origin = {-0.01, -0.03};
  const FilterPrint print = description.Print();
  for (const auto& [row, column] : {std::pair{3, 5}, {24, 32}, {40, 60}, {10, 50}, {47, 0}}) {
    const Vec2 s = centre + description.geometry.image_from_sensor.Map({column + 0.5, row + 0.5});
    const lightfield::Lattice point{1, 1, s.x - 1e-6, s.y + 1e-6, 2e-6, 2e-6};
    const double e = TraceIrradiance(
        *description.lamp, [&](Vec2 offset, int n) { return print.Transmittance(offset, n); }, 0.03,
        {{centre, 0}}, point, {{0, 0, 1, 1}}, options)[0][0];
    // 1000 electrons per second and W/m^2, 10 ms, half a DN each; the pixel's mean and bilinear
    // interpolation differ from its centre by the curvature over about a pixel: (0.009 m / 0.25
    // m)^2 and a factor of order one.
    EXPECT_NEAR(frame.value[row * 64 + column] - 100, 0.8 * e * 1000 * 0.01 * 0.5,
                0.005 * 0.8 * e * 5)
        << row << " " << column;
  }
}

TEST(Truth, OfALightFieldLampIsTheFieldItself) {
  const auto field = StructuredField(3, 2, 8, 0.02, 0.02, 23);
  const auto path =
      fs::path(testing::TempDir()) / ("truth_" + std::to_string(::getpid()) + ".lf.exr");
  lightfield::WriteLightField(path, field);
  TestLab lab;
  lab.lamp = "kind = \"lightfield\"\nfile = \"" + path.string() + "\"";
  const SimulatedLab simulated(lab.Config());
  EXPECT_EQ(simulated.truth(field.geometry).data, field.data);
  const std::map<std::string, std::string> files = {{"lamp.file", core::Sha256OfFile(path)}};
  EXPECT_EQ(simulated.MakeDevices().lab_files, files);
  EXPECT_TRUE(SimulatedLab(TestLab{}.Config()).MakeDevices().lab_files.empty());

  // On a lattice twice as fine the projection has to find every texel four times.
  auto fine = field.geometry;
  fine.lattice = {16, 16, fine.lattice.s0_m, fine.lattice.t1_m, 0.01, 0.01};
  const auto projected = simulated.truth(fine);
  for (int m = 0; m < 6; ++m)
    for (int row = 0; row < 16; ++row)
      for (int column = 0; column < 16; ++column)
        // float32 irradiance times the condition of the Gram matrix (below 56)
        EXPECT_NEAR(projected.image(m, 0)[row * 16 + column],
                    field.image(m, 0)[row / 2 * 8 + column / 2], 1000 * 56 * 6e-8);
  auto other = field.geometry;
  other.delta_m = 0.3;
  EXPECT_THAT(MessageOf([&] { simulated.truth(other); }), HasSubstr("delta"));
  lab.rig = "kind = \"lensless\"\nalbedo = 1";
  EXPECT_THAT(ErrorOf(lab), HasSubstr("rig.albedo"));
}

}  // namespace
}  // namespace luxfield::hal::sim
