// The simulated lab's camera, captured and calibrated as a lab would do it, against what the lab
// knows of itself.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "luxfield/capture/take/capture_sensor.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/reconstruct/calibrate/sensor/calibrate_sensor.h"
#include "tests/core/chi_squared.h"

namespace luxfield {
namespace {

namespace fs = std::filesystem;
using reconstruct::Quantity;

core::Config Bench(int seed, int channels, const std::string& camera,
                   const std::string& errors = "") {
  return core::Config::FromString(
      fmt::format("[lab]\ndriver = \"sim\"\nseed = {}\nchannels = {}\n[rig]\nkind = "
                  "\"lensless\"\ndelta_m = 0.3\n"
                  "[filter]\nspacing_m = 0.0165\n[lamp]\nkind = \"square\"\nside_m = 1\n"
                  "radiance = 26700\n[camera]\nwidth = 96\nheight = 80\npitch_m = 0.0002\n"
                  "bits = 14\nblack_dn = 400\nsaturation_dn = 16000\ngain_dn_per_e = 0.16\n"
                  "{}\nmin_exposure_s = 1e-4\n"
                  "max_exposure_s = 10\n[stage]\nmin_m = [-0.1, -0.1]\nmax_m = [0.1, 0.1]\n"
                  "[errors.photon_noise]\n[errors.read_noise]\nrms_dn = 1.6\n"
                  "[errors.dark_current]\ne_per_s = 20\n[errors.prnu]\nrms = 0.01\n"
                  "[errors.hot_pixels]\ncount = 3\ne_per_s = 5000\ncalibrated = false\n"
                  "[errors.vignetting]\ncorner_loss = 0.2\n[errors.drift]\nper_hour = -0.05\n"
                  "[errors.shutter]\njitter_s = 1e-5\n[errors.monitor_noise]\nrelative = 2e-4\n{}",
                  seed, channels, camera, errors),
      "lab.toml");
}

capture::SensorPlan Plan(int channels, int levels) {
  return capture::ReadSensorPlan(core::Config::FromString(
      fmt::format("[plan]\nkind = \"sensor\"\nchannels = {}\n[exposure]\nmin_s = 0.01\n"
                  "max_s = 1.6\nlevels = {}\n",
                  channels, levels),
      "plan"));
}

fs::path Capture(const core::Config& bench, const capture::SensorPlan& plan) {
  const fs::path folder = fs::path(testing::TempDir()) / "luxfield_sensor_chain";
  fs::remove_all(folder);
  hal::Devices devices = hal::sim::SimulatedLab(bench).MakeDevices();
  capture::RunSensorCapture(plan, devices, folder);
  return folder;
}

// Squares of figures' errors in standard errors.
struct Pulls {
  double chi_squared = 0;
  int count = 0;

  void Add(const Quantity& q, double truth, const char* name, int seed) {
    const double z = (q.value - truth) / q.sigma;
    EXPECT_LT(std::abs(z), 4.2) << name << ", seed " << seed;
    chi_squared += z * z;
    ++count;
  }
  void AddSensor(const reconstruct::PhotonTransfer& t, int seed) {
    Add(t.gain_dn_per_e, 0.16, "gain", seed);
    Add(t.read_variance_dn2, 2.56, "read variance", seed);
    Add(t.dark_current_e_per_s, 20, "dark current", seed);
    Add(t.offset_dn, 400, "offset", seed);
  }
};

TEST(SensorCalibrationChain, FindsTheSimulatedCamera) {
  constexpr int kLabs = 12;
  Pulls pulls;
  double linearity = 0, linearity_degrees = 0;
  for (int seed = 1; seed <= kLabs; ++seed) {
    const fs::path folder =
        Capture(Bench(seed, 1, "responsivity_e_per_s_per_w_m2 = [1200]"), Plan(1, 14));
    const auto c = reconstruct::CalibrateSensor(session::SessionReader(folder));
    EXPECT_EQ(c.hot.size(), 3u);
    EXPECT_TRUE(c.dead.empty());
    ASSERT_TRUE(c.transfer.saturation_dn);
    EXPECT_EQ(c.transfer.saturation_dn->value, 16000);
    pulls.AddSensor(c.transfer, seed);
    pulls.Add(c.prnu_squared, 1e-4, "PRNU^2", seed);
    const auto& l = c.channels.at(0).linearity;
    EXPECT_TRUE(l.by_monitor);
    EXPECT_LT(std::abs(l.largest.deviation), 1e-3);
    linearity += l.chi_squared;
    linearity_degrees += l.degrees;
    fs::remove_all(folder);
  }
  std::cout << "chi^2/dof " << pulls.chi_squared / pulls.count << " over " << pulls.count
            << " figures, linearity " << linearity / linearity_degrees << " (seeds 1 to " << kLabs
            << ")\n";
  EXPECT_GT(pulls.chi_squared / pulls.count, ChiSquaredShare(pulls.count, -kRareZ));
  EXPECT_LT(pulls.chi_squared / pulls.count, ChiSquaredShare(pulls.count, kRareZ));
  // The light's scatter is estimated from some ten differences a lab: a looser bound.
  EXPECT_LT(linearity / linearity_degrees, 2);
}

// Colours at 1 : 1.33 : 0.78, and a sensor that overflows into the neighbours of saturated pixels.
TEST(SensorCalibrationChain, FindsTheSimulatedCameraBehindAMosaic) {
  constexpr int kLabs = 12;
  const std::string camera = "cfa = \"GRBG\"\nresponsivity_e_per_s_per_w_m2 = [900, 1200, 700]";
  Pulls sensor, sites, prnu;
  double linearity = 0, linearity_degrees = 0;
  for (int seed = 1; seed <= kLabs; ++seed) {
    const fs::path folder = Capture(
        Bench(seed, 3, camera, "[errors.blooming]\nshare = 0.2\nreach_px = 2\n"), Plan(3, 18));
    const auto c = reconstruct::CalibrateSensor(session::SessionReader(folder));
    EXPECT_EQ(c.hot.size(), 3u);
    EXPECT_TRUE(c.dead.empty());
    ASSERT_TRUE(c.transfer.saturation_dn);
    EXPECT_EQ(c.transfer.saturation_dn->value, 16000);
    sensor.AddSensor(c.transfer, seed);
    prnu.Add(c.prnu_squared, 1e-4, "PRNU^2", seed);
    ASSERT_EQ(c.channels.size(), 4u);
    for (int site = 0; site < 4; ++site) {
      const auto& channel = c.channels[site];
      EXPECT_EQ(channel.site, site);
      EXPECT_EQ(channel.channel, (std::array{1, 0, 2, 1}[site]));
      sites.AddSensor(channel.transfer, seed);
      prnu.Add(channel.prnu_squared, 1e-4, "PRNU^2 of a site", seed);
      linearity += channel.linearity.chi_squared;
      linearity_degrees += channel.linearity.degrees;
    }
    fs::remove_all(folder);
  }
  for (const auto& [pulls, name] :
       {std::pair{sensor, "sensor"}, std::pair{sites, "sites"}, std::pair{prnu, "PRNU^2"}}) {
    std::cout << name << ": chi^2/dof " << pulls.chi_squared / pulls.count << " over "
              << pulls.count << " figures (seeds 1 to " << kLabs << ")\n";
    // A mosaic's sites share the lamp and the darks: half as many independent figures.
    const double independent = 0.5 * pulls.count;
    EXPECT_GT(pulls.chi_squared / pulls.count, ChiSquaredShare(independent, -kRareZ)) << name;
    EXPECT_LT(pulls.chi_squared / pulls.count, ChiSquaredShare(independent, kRareZ)) << name;
  }
  std::cout << "linearity " << linearity / linearity_degrees << "\n";
  EXPECT_LT(linearity / linearity_degrees, 2);
}

}  // namespace
}  // namespace luxfield
