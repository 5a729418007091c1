// Every key of [camera] arrives where it belongs, each with a value of its own.
#include "luxfield/hal/options/camera_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "luxfield/hal/devices.h"
#include "luxfield/hal/drivers/aravis/driver.h"
#include "luxfield/hal/drivers/gphoto2/driver.h"
#include "luxfield/hal/lab/open_lab.h"

namespace luxfield::hal {
namespace {

using testing::ElementsAre;
using testing::Pair;

bool Built(const std::string& driver) {
  const auto drivers = Drivers();
  return std::any_of(drivers.begin(), drivers.end(),
                     [&](const DriverInfo& d) { return d.name == driver; });
}

CameraOptions Read(const std::string& text, int channels) {
  return ReadCamera(core::Config::FromString(text, "lab.toml"), rig::RigKind::kLensless, channels);
}

const std::string kCalibration = R"(
pitch_m = 5e-6
gain_dn_per_e = 0.25
read_noise_dn = 3
black_dn = 64
saturation_dn = 4000
dark_current_e_per_s = 7
prnu = 0.01
defects = [1, 2, 30, 40, 500, 600]
)";

void ExpectCalibration(const CameraOptions& options) {
  EXPECT_EQ(std::get<PixelPitch>(options.image_plane).pitch_m, 5e-6);
  const rig::SensorModel& c = options.calibration;
  EXPECT_EQ(c.gain_dn_per_e, 0.25);
  EXPECT_EQ(c.read_noise_dn, 3);
  EXPECT_EQ(c.black_dn, 64);
  EXPECT_EQ(c.saturation_dn, 4000);
  EXPECT_EQ(c.dark_current_e_per_s, 7);
  EXPECT_EQ(c.prnu, 0.01);
  EXPECT_THAT(c.defects, ElementsAre(Pair(1, 2), Pair(30, 40), Pair(500, 600)));
}

TEST(CameraOptions, OfAStillCamera) {
  if (!Built("gphoto2")) GTEST_SKIP() << "built without libgphoto2";
  const std::string text = R"(
driver = "gphoto2"
port = "usb:001,004"
size_px = [300, 200]
bits = 12
mosaic = "GBRG"
shutter_speed = "exptime"
readout_s = 2.5
setting = [{name = "iso", value = "100"}, {name = "f-number", value = "8"}]
responsivity_e_per_s_per_w_m2 = [1, 2, 3]
)" + kCalibration;
  const CameraOptions options = Read(text, 3);
  const auto driver = gphoto2::ReadOptions(core::Config::FromString(text, "lab.toml"));
  EXPECT_EQ(driver.port, "usb:001,004");
  EXPECT_EQ(driver.width, 300);
  EXPECT_EQ(driver.height, 200);
  EXPECT_EQ(driver.bits, 12);
  EXPECT_EQ(driver.cfa, "GBRG");
  EXPECT_EQ(driver.shutter_speed, "exptime");
  EXPECT_EQ(driver.readout_s, 2.5);
  EXPECT_THAT(driver.settings, ElementsAre(Pair("iso", "100"), Pair("f-number", "8")));
  EXPECT_EQ(options.calibration.cfa, "GBRG");
  EXPECT_THAT(options.calibration.responsivity_e_per_s_per_w_m2, ElementsAre(1, 2, 3));
  ExpectCalibration(options);
  EXPECT_THAT(options.driver.settings,
              ElementsAre(Pair("driver", "gphoto2"), Pair("setting f-number", "8"),
                          Pair("setting iso", "100")));
  EXPECT_FALSE(options.driver.needs_trigger);
}

TEST(CameraOptions, OfANetworkCamera) {
  if (!Built("aravis")) GTEST_SKIP() << "built without aravis";
  const std::string text = R"(
driver = "aravis"
id = "Maker-17"
pixel_format = "Mono12"
gain_db = 6
region_px = [8, 16, 640, 480]
readout_s = 0.5
trigger_source = "Line2"
trigger_activation = "FallingEdge"
responsivity_e_per_s_per_w_m2 = [4]
)" + kCalibration;
  const CameraOptions options = Read(text, 1);
  const auto driver = aravis::ReadOptions(core::Config::FromString(text, "lab.toml"));
  EXPECT_EQ(driver.id, "Maker-17");
  EXPECT_EQ(driver.pixel_format, "Mono12");
  EXPECT_EQ(driver.gain_db, 6);
  ASSERT_TRUE(driver.region);
  EXPECT_THAT(
      (std::array{driver.region->x, driver.region->y, driver.region->width, driver.region->height}),
      ElementsAre(8, 16, 640, 480));
  EXPECT_EQ(driver.readout_s, 0.5);
  ASSERT_TRUE(driver.line_trigger);
  EXPECT_EQ(driver.line_trigger->source, "Line2");
  EXPECT_EQ(driver.line_trigger->activation, "FallingEdge");
  EXPECT_TRUE(options.driver.needs_trigger);
  ExpectCalibration(options);
  EXPECT_THAT(
      options.driver.settings,
      ElementsAre(Pair("driver", "aravis"), Pair("gain_db", "6"), Pair("pixel_format", "Mono12"),
                  Pair("region_px", "8, 16, 640, 480"), Pair("trigger_activation", "FallingEdge"),
                  Pair("trigger_source", "Line2")));
}

}  // namespace
}  // namespace luxfield::hal
