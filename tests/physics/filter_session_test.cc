// A printed filter photographed as a session and measured, against the print of the simulated lab.
#include "luxfield/reconstruct/calibrate/filter/filter_session.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/capture/take/capture_filter.h"
#include "luxfield/core/error.h"
#include "luxfield/hal/sim/lab_description.h"
#include "luxfield/reconstruct/calibrate/filter/measure_filter.h"
#include "tests/planning/lab_session.h"

namespace luxfield::planning {
namespace {

using lightfield::Vec2;

constexpr const char* kSingle = "scale = 1.7777777777777777\n";
constexpr const char* kDual = "kind = \"dual\"\nbasis = \"quadratic\"\n";

std::string Lab(const char* filter) {
  return std::string(R"(
[lab]
driver = "sim"
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.02
)") + filter +
         R"([filter.bench]
irradiance = 5500
[lamp]
kind = "square"
side_m = 0.06
radiance = 1000
[camera]
pitch_m = 0.01
width = 360
height = 320
responsivity_e_per_s_per_w_m2 = [1000]
)" + planning::kCameraCodes +
         R"([errors.prnu]
rms = 0.01
[errors.vignetting]
corner_loss = 0.2
[errors.dark_current]
e_per_s = 5
[errors.registration]
shift_m = [2e-4, -1.5e-4]
rotation_deg = 0.3
[errors.density]
relative = -0.02
gamma = 0.05
)" + planning::kStage +
         planning::kCameraNoise;
}

class FilterSessionTest : public testing::TestWithParam<bool> {};  // dual

TEST_P(FilterSessionTest, MeasuresEveryPrintWithinItsSigma) {
  const bool dual = GetParam();
  const std::string lab = Lab(dual ? kDual : kSingle);
  const ScratchFolder folder("filter_session");
  hal::Devices devices = planning::DevicesOf(lab);
  capture::RunFilterCapture(
      capture::ReadFilterPlan(core::Config::FromString(
          "[plan]\nkind = \"filter\"\n[exposure]\nmin_s = 0.01\nmax_s = 1.28\n", "plan.toml")),
      devices, folder.path());
  const session::SessionReader session(folder.path());
  std::map<std::string, std::string> provenance;
  const auto photographs = reconstruct::ReadFilterSession(session, {}, true, &provenance);
  EXPECT_EQ(provenance.at("session_plan"), session.plan_id());
  reconstruct::FilterReadings readings;
  const auto filter = reconstruct::MeasureFilter(photographs.sheet, photographs.light,
                                                 photographs.prints, &readings);
  ASSERT_EQ(filter.prints.size(), dual ? 2u : 1u);

  const hal::sim::FilterPrint truth =
      hal::sim::ReadLab(core::Config::FromString(lab, "lab.toml"), {}).Print();
  for (std::size_t k = 0; k < filter.prints.size(); ++k) {
    const auto& print = filter.prints[k];
    double difference = 0, sum = 0, square = 0, count = 0;
    for (int row = 0; row < filter.lattice.height; ++row)
      for (int column = 0; column < filter.lattice.width; ++column) {
        double mean = 0;
        for (int p = 0; p < 16; ++p)
          mean += truth.SheetTransmittance({filter.lattice.s_of_column(column + (p % 4 + 0.5) / 4),
                                            filter.lattice.t_of_row(row + (p / 4 + 0.5) / 4)},
                                           static_cast<int>(k)) /
                  16;
        const std::size_t at = static_cast<std::size_t>(row) * filter.lattice.width + column;
        const double d = print.transmittance[at] - mean;
        difference += d;
        sum += mean;
        if (mean < 0.1) continue;  // where noise is above the curvature over a pixel
        square += std::pow(d / print.sigma[at], 2);
        ++count;
      }
    const auto& reading = readings.prints[k];
    const Vec2 off = reading.shift_m - Vec2{2e-4, -1.5e-4};
    std::printf("level %.5f %% off, z %.3f rms; shift off by (%.2f, %.2f) um +- %.2f um\n",
                100 * difference / sum, std::sqrt(square / count), 1e6 * off.x, 1e6 * off.y,
                1e6 * reading.shift_sigma_m);
    // The light's level is known to the noise of the holes, 0.01 %; texels share pixels and the
    // picture is a little smoother than the print. A dual function has ridges that a pixel rounds
    // off by more than the noise.
    EXPECT_NEAR(difference / sum, 0, 5e-4);
    if (!dual) {
      EXPECT_NEAR(std::sqrt(square / count), 1, 0.15);
    }
    EXPECT_LT(std::hypot(off.x, off.y), 4 * reading.shift_sigma_m + 2e-6);
    EXPECT_GE(reading.wedge.size(), 15u);
  }
}

INSTANTIATE_TEST_SUITE_P(Filters, FilterSessionTest, testing::Bool(), [](const auto& test) {
  return std::string(test.param ? "Dual" : "Single");
});

}  // namespace
}  // namespace luxfield::planning
