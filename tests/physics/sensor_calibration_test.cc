// The simulated lab's camera, captured and calibrated as a lab would do it, against what the lab
// knows of itself.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <iostream>

#include "capture/capture_sensor.h"
#include "core/progress.h"
#include "hal/sim/simulated_lab.h"
#include "reconstruct/calibrate_sensor.h"

namespace luxfield {
namespace {

namespace fs = std::filesystem;
using reconstruct::Quantity;

core::Config Bench(int seed) {
  return core::Config::FromString(
      fmt::format("[lab]\ndriver = \"sim\"\nseed = {}\n[rig]\nkind = \"lensless\"\ndelta_m = 0.3\n"
                  "[filter]\nspacing_m = 0.0165\n[lamp]\nkind = \"square\"\nside_m = 1\n"
                  "radiance = 26700\n[camera]\nwidth = 96\nheight = 80\npitch_m = 0.0002\n"
                  "bits = 14\nblack_dn = 400\nsaturation_dn = 16000\ngain_dn_per_e = 0.16\n"
                  "responsivity_e_per_s_per_w_m2 = [1200]\nmin_exposure_s = 1e-4\n"
                  "max_exposure_s = 10\n[stage]\nmin_m = [-0.1, -0.1]\nmax_m = [0.1, 0.1]\n"
                  "[errors.photon_noise]\n[errors.read_noise]\nrms_dn = 1.6\n"
                  "[errors.dark_current]\ne_per_s = 20\n[errors.prnu]\nrms = 0.01\n"
                  "[errors.hot_pixels]\ncount = 3\ne_per_s = 5000\ncalibrated = false\n"
                  "[errors.vignetting]\ncorner_loss = 0.2\n[errors.drift]\nper_hour = -0.05\n"
                  "[errors.shutter]\njitter_s = 1e-5\n[errors.monitor_noise]\nrelative = 2e-4\n",
                  seed),
      "lab.toml");
}

TEST(SensorCalibrationChain, FindsTheSimulatedCamera) {
  core::Progress::SetQuiet(true);
  const auto plan = capture::ReadSensorPlan(core::Config::FromString(
      "[plan]\nkind = \"sensor\"\n[exposure]\nmin_s = 0.01\nmax_s = 1.6\nlevels = 14\n", "plan"));
  constexpr int kLabs = 12;
  double chi_squared = 0, linearity = 0, linearity_degrees = 0;
  for (int seed = 1; seed <= kLabs; ++seed) {
    const fs::path folder =
        fs::path(testing::TempDir()) / fmt::format("luxfield_sensor_chain_{}", seed);
    fs::remove_all(folder);
    const hal::sim::SimulatedLab lab(Bench(seed));
    hal::Devices devices = lab.MakeDevices();
    capture::RunSensorCapture(plan, devices, folder);
    const core::SessionReader session(folder);
    const auto c = reconstruct::CalibrateSensor(session);
    EXPECT_EQ(c.hot.size(), 3u);
    EXPECT_TRUE(c.dead.empty());
    ASSERT_TRUE(c.transfer.saturation_dn);
    EXPECT_EQ(c.transfer.saturation_dn->value, 16000);
    const auto add = [&](const Quantity& q, double truth, const char* name) {
      const double z = (q.value - truth) / q.sigma;
      EXPECT_LT(std::abs(z), 4.2) << name << ", seed " << seed;
      chi_squared += z * z;
    };
    add(c.transfer.gain_dn_per_e, 0.16, "gain");
    add(c.transfer.read_variance_dn2, 2.56, "read variance");
    add(c.transfer.dark_current_e_per_s, 20, "dark current");
    add(c.transfer.offset_dn, 400, "offset");
    add(c.prnu_squared, 1e-4, "PRNU^2");
    const auto& l = c.channels.at(0).linearity;
    EXPECT_TRUE(l.by_monitor);
    EXPECT_LT(std::abs(l.largest.deviation), 1e-3);
    linearity += l.chi_squared;
    linearity_degrees += l.degrees;
    fs::remove_all(folder);
  }
  std::cout << "chi^2/dof " << chi_squared / (5 * kLabs) << " over " << 5 * kLabs
            << " figures, linearity " << linearity / linearity_degrees << " (seeds 1 to " << kLabs
            << ")\n";
  EXPECT_NEAR(chi_squared / (5 * kLabs), 1, 4 * std::sqrt(2.0 / (5 * kLabs)));
  // The light's scatter is estimated from some ten differences a lab: a looser bound.
  EXPECT_LT(linearity / linearity_degrees, 2);
}

}  // namespace
}  // namespace luxfield
