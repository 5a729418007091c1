#include "luxfield/hal/lab/device_lab.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "luxfield/core/error.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/drivers/aravis/driver.h"
#include "luxfield/hal/lab/open_lab.h"
#include "tests/said.h"

namespace luxfield::hal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class DeviceLabFile : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* driver : {"aravis", "gpiod"}) {
      const auto drivers = Drivers();
      if (std::none_of(drivers.begin(), drivers.end(),
                       [&](const DriverInfo& info) { return info.name == driver; }))
        GTEST_SKIP() << driver << " is not built in";
    }
    std::ifstream file(LUXFIELD_SOURCE_DIR "/data/labs/bench.toml");
    text_.assign(std::istreambuf_iterator<char>(file), {});
  }
  // The example with a piece of it replaced.
  core::Config With(const std::string& from, const std::string& to) const {
    std::string text = text_;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return core::Config::FromString(text.replace(at, from.size(), to), "lab.toml");
  }
  std::string ErrorWith(const std::string& from, const std::string& to) const {
    try {
      ReadDeviceLab(With(from, to));
    } catch (const InputError& error) {
      return error.what();
    }
    ADD_FAILURE() << "was accepted: " << to;
    return {};
  }

  std::string text_;
};

TEST_F(DeviceLabFile, SaysWhatItSays) {
  const DeviceLab lab = ReadDeviceLab(With("prnu", "prnu"));
  EXPECT_EQ(lab.rig.delta_m, 0.3);
  EXPECT_EQ(lab.rig.pwm_hz, 1000);
  const auto camera =
      aravis::ReadOptions(core::Config::FromString(text_, "lab.toml").Table("camera"));
  EXPECT_EQ(camera.id, "Aravis-Fake-LUX1");
  ASSERT_TRUE(camera.region);
  EXPECT_EQ(camera.region->width, 84);
  EXPECT_THAT(lab.camera.driver.settings,
              ElementsAre(std::pair{"driver", "aravis"}, std::pair{"gain_db", "0"},
                          std::pair{"pixel_format", camera.pixel_format},
                          std::pair{"region_px", "0, 0, 84, 80"}));
  EXPECT_EQ(lab.rig.camera.read_noise_dn, 1.6);
  EXPECT_THAT(lab.rig.camera.defects, ElementsAre(std::pair{3, 17}, std::pair{40, 2}));
  EXPECT_EQ(lab.stage.port, "/dev/ttyUSB0");
  ASSERT_TRUE(lab.inputs.door);
  EXPECT_EQ(lab.inputs.door->bias, gpiod::Bias::kPullUp);
  EXPECT_FALSE(lab.inputs.limit);
  ASSERT_EQ(lab.shutter.positions.size(), 2u);
  EXPECT_EQ(lab.shutter.positions[0].name, "closed") << "where it goes when it is opened";
  EXPECT_FALSE(lab.shutter.positions[0].output);
  EXPECT_FALSE(lab.print);
  ASSERT_TRUE(lab.supply && lab.monitor);
  EXPECT_EQ(std::get<UsbSupplyOptions>(*lab.supply).supply.voltage_v, 12);
  EXPECT_EQ(lab.monitor->instrument.product, 2);
}

TEST_F(DeviceLabFile, ABayerFormatIsAMosaicOfAllChannels) {
  const std::string id = "id = \"Aravis-Fake-LUX1\"", bayer = id + "\npixel_format = \"BayerGR12\"";
  text_.replace(text_.find("saturation_dn = 16000"), 21, "saturation_dn = 4000");
  EXPECT_THAT(ErrorWith(id, bayer), HasSubstr("colour mosaic"));
  text_.replace(text_.find(id), id.size(), bayer);
  text_.replace(text_.find("= [1200]"), 8, "= [1200, 1300, 900]");
  const DeviceLab lab = ReadDeviceLab(With("[lab]", "[lab]\nchannels = 3"));
  EXPECT_EQ(lab.rig.camera.cfa, "GRBG");
  EXPECT_FALSE(lab.colour);
}

TEST_F(DeviceLabFile, TheMiddleOfACentredSensorIsTheAxis) {
  const DeviceLab lab = ReadDeviceLab(With("prnu", "prnu"));
  CameraCapabilities capabilities;
  capabilities.width = 84;
  capabilities.height = 80;
  const rig::Homography map = ImageFromSensor(lab.camera, capabilities);
  EXPECT_NEAR(map.Map({42, 40}).x, 0, 1e-12);
  EXPECT_NEAR(map.Map({42, 40}).y, 0, 1e-12);
  EXPECT_NEAR(map.Map({0, 0}).x, -42 * 0.00825, 1e-12);
  EXPECT_NEAR(map.Map({0, 0}).y, 40 * 0.00825, 1e-12) << "row 0 on top";
}

TEST_F(DeviceLabFile, ARelayInPlaceOfASupply) {
  const DeviceLab lab = ReadDeviceLab(
      With("[supply]\ndriver = \"usbtmc\"\nvendor = 0x1209\nproduct = 0x0001\nvoltage_v = "
           "12\ncurrent_a = 2",
           "[supply]\ndriver = \"gpiod\"\nlamp = {line = \"7\", active_low = true}"));
  const auto& relay = std::get<RelayOptions>(*lab.supply);
  EXPECT_EQ(relay.chip, "gpiochip0");
  EXPECT_EQ(relay.lamp.line, "7");
  EXPECT_TRUE(relay.lamp.active_low);
}

TEST_F(DeviceLabFile, ACameraThatALineTriggersHasOne) {
  const std::string id = "id = \"Aravis-Fake-LUX1\"";
  EXPECT_FALSE(ReadDeviceLab(With("prnu", "prnu")).trigger);
  text_.replace(text_.find(id), id.size(), id + "\ntrigger_source = \"Line1\"");
  EXPECT_THAT(ErrorWith("prnu", "prnu"), HasSubstr("trigger is missing"));
  const std::string trigger =
      "[trigger]\ndriver = \"gpiod\"\noutput = {line = \"9\", active_low = true}\n";
  const DeviceLab lab = ReadDeviceLab(With("[stage]", trigger + "pulse_s = 0.01\n[stage]"));
  ASSERT_TRUE(lab.trigger);
  EXPECT_EQ(lab.trigger->chip, "gpiochip0");
  EXPECT_EQ(lab.trigger->output.line, "9");
  EXPECT_TRUE(lab.trigger->output.active_low);
  EXPECT_EQ(lab.trigger->pulse_s, 0.01);
  const auto settings = lab.camera.driver.settings;
  EXPECT_EQ(settings.at("trigger_source"), "Line1");
  EXPECT_EQ(settings.at("trigger_activation"), "RisingEdge");
  EXPECT_THAT(ErrorWith("[stage]", trigger + "pulse_s = 1\n[stage]"), HasSubstr("trigger.pulse_s"));
  EXPECT_THAT(ErrorWith("[stage]", "[trigger]\ndriver = \"gpiod\"\n[stage]"),
              HasSubstr("trigger.output"));
  const std::string source = "trigger_source = \"Line1\"";
  EXPECT_THAT(ErrorWith(source, "trigger_source = \"Software\""),
              HasSubstr("camera.trigger_source"));
  EXPECT_THAT(ErrorWith(source, source + "\ntrigger_activation = \"BothEdges\""),
              HasSubstr("camera.trigger_activation"));
  // Nobody asks for a trigger that no camera is triggered by.
  text_.replace(text_.find(source), source.size(), "");
  EXPECT_THAT(ErrorWith("[stage]", trigger + "[stage]"), HasSubstr("trigger"));
  EXPECT_THAT(ErrorWith("prnu = 0.001", "prnu = 0.001\ntrigger_activation = \"RisingEdge\""),
              HasSubstr("camera.trigger_activation"));
}

TEST_F(DeviceLabFile, QuirksOfAnInstrumentAreTheTablesUnlessNamed) {
  const auto quirks = [&](const std::string& keys) {
    const DeviceLab lab = ReadDeviceLab(With("vendor = 0x1209\nproduct = 0x0002", keys));
    return usbtmc::QuirkNames(lab.monitor->instrument.quirks);
  };
  EXPECT_EQ(quirks("vendor = 0x1209\nproduct = 2"), "");
  EXPECT_EQ(quirks("vendor = 0x1209\nproduct = 2\nquirks = {any_tag = true}"), "any_tag");
  const std::string known = "vendor = 0x1ab1\nproduct = 0x04ce\n";
  EXPECT_EQ(quirks(known), "no_clear, one_header");
  EXPECT_EQ(quirks(known + "quirks = {no_clear = false, any_tag = true}"), "any_tag, one_header");
}

TEST_F(DeviceLabFile, ASupplyMayNotKnowWhetherItHasSettled) {
  const auto opc = [](const DeviceLab& lab) {
    return std::get<UsbSupplyOptions>(*lab.supply).supply.opc;
  };
  EXPECT_TRUE(opc(ReadDeviceLab(With("voltage_v = 12", "voltage_v = 12"))));
  EXPECT_FALSE(opc(ReadDeviceLab(With("voltage_v = 12", "voltage_v = 12\nopc = false"))));
}

TEST_F(DeviceLabFile, ARealStageInASimulatedLabIsAnnouncedBeforeItIsOpened) {
  std::ifstream file(LUXFIELD_SOURCE_DIR "/data/labs/small.toml");
  std::string text(std::istreambuf_iterator<char>(file), {});
  const auto at = text.find("[stage]\n");
  ASSERT_NE(at, std::string::npos);
  text.insert(at + 8,
              "driver = \"grbl\"\nport = \"/dev/no-such-port\"\norigin_m = [-0.15, -0.15]\n");
  const auto lab =
      std::filesystem::path(testing::TempDir()) / fmt::format("mix{}.toml", ::getpid());
  std::ofstream(lab) << text;
  EXPECT_THAT(Said([&] { EXPECT_THROW(MakeDevices(lab), HardwareError); }),
              testing::AllOf(HasSubstr("/dev/no-such-port is real"), HasSubstr("watchdog")));
  std::filesystem::remove(lab);
}

TEST_F(DeviceLabFile, WhatMakesNoSenseIsRefusedByFileAndField) {
  struct Case {
    const char *from, *to, *field;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"driver = \"aravis\"", "driver = \"gphoto\"", "camera.driver"},
           {"region_px = [0, 0, 84, 80]", "region_px = [0, 0, 84.5, 80]", "camera.region_px"},
           {"id = ", "pixel_format = \"RGB8\"\nid = ", "camera.pixel_format"},
           {"gain_dn_per_e = 0.16\n", "", "camera.gain_dn_per_e"},
           {"read_noise_dn = 1.6\n", "", "camera.read_noise_dn"},
           {"pitch_m = 0.00825\n", "", "camera.pitch_m"},
           {"defects = [3, 17, ", "defects = [17, ", "camera.defects"},
           {"black_dn = 400", "black_dn = 400\nexposure = 1", "camera.exposure"},
           {"driver = \"grbl\"\nport = \"/dev/ttyUSB0\"\nv_axis = \"-y\"\norigin_m = [-0.15, "
            "-0.15]",
            "driver = \"sim\"", "stage.driver"},
           {"[inputs]", "[input]", "inputs"},
           {"line = \"e-stop\", bias = \"pull-up\"", "line = \"e-stop\", bias = \"up\"",
            "inputs.emergency_stop.bias"},
           {"line = \"e-stop\"", "name = \"e-stop\"", "inputs.emergency_stop.line"},
           {"emergency_stop = {line = \"e-stop\", bias = \"pull-up\"}\n", "",
            "inputs.emergency_stop"},
           {"[shutter]", "[blind]", "shutter"},
           {"open = {output = {line = \"shutter\"}}", "open = {}", "shutter.open"},
           {"open = {output", "open = {sensor = {line = \"1\"}, output", "shutter.open"},
           {"voltage_v = 12\n", "", "supply.voltage_v"},
           {"product = 0x0002", "product = 0x0002\nunits = \"lx\"", "monitor.units"},
           {"kind = \"basis\"\nbasis = \"bspline2\"", "kind = \"dual\"\nbasis = \"quadratic\"",
            "print"},
           {"product = 0x0002", "product = 0x0002\nquirks = {no_clears = true}",
            "monitor.quirks.no_clears"},
           {"product = 0x0002", "product = 0x0002\nquirks = \"no_clear\"", "monitor.quirks"},
           {"name = \"small bench\"", "channels = 2", "lab.channels"},
       }) {
    const std::string error = ErrorWith(c.from, c.to);
    EXPECT_THAT(error, HasSubstr("lab.toml")) << c.to;
    EXPECT_THAT(error, HasSubstr(c.field)) << c.to;
  }
}

}  // namespace
}  // namespace luxfield::hal
