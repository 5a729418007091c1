#include "luxfield/reconstruct/calibrate/sensor/calibrate_sensor.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "luxfield/core/clock.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/reconstruct/calibrate/sensor/sensor_calibration_file.h"
#include "luxfield/session/session_writer.h"
#include "tests/reconstruct/test_sensor.h"

namespace luxfield::reconstruct {
namespace {

namespace fs = std::filesystem;
using session::FrameKind;
using session::FrameRecord;

TestSensor Camera() {
  TestSensor sensor;
  sensor.seed = 31;
  sensor.width = 120;
  sensor.height = 100;
  sensor.gain_e_per_dn = 2.5;
  sensor.light_e_per_s = sensor.full_e();
  return sensor;
}

struct Options {
  TestSensor sensor = Camera();
  int channels = 1;
  bool darks = true, flats = true;
  int frames_of_pair = 2;
  int levels = 10;
  std::string cfa;
};

fs::path Write(const std::string& name, const Options& o) {
  const fs::path folder = fs::path(testing::TempDir()) / ("luxfield_calibrate_" + name);
  fs::remove_all(folder);
  core::SimulatedClock clock;
  nlohmann::json session = {
      {"camera",
       {{"width", o.sensor.width}, {"height", o.sensor.height}, {"bits", o.sensor.bits}}}};
  if (!o.cfa.empty()) session["camera"]["cfa"] = o.cfa;
  auto writer = session::SessionWriter::Create(folder, {{"kind", "sensor"}, {"name", name}},
                                               session, {}, clock);
  writer.StartEpoch(nlohmann::json::object());
  std::uint64_t stream = 0;
  for (int level = 0; level < o.levels; ++level)
    for (const FrameKind kind : {FrameKind::kDark, FrameKind::kFlat}) {
      if (!(kind == FrameKind::kDark ? o.darks : o.flats)) continue;
      for (int channel = 0; channel < (kind == FrameKind::kDark ? 1 : o.channels); ++channel)
        for (int repeat = 0; repeat < o.frames_of_pair; ++repeat) {
          FrameRecord record;
          record.kind = kind;
          record.channel = channel;
          record.exposure_index = level;
          record.repeat = repeat;
          record.exposure_s = record.requested_exposure_s = 0.01 * std::pow(140, level / 9.0);
          // Channel n sees 1 - 0.1 n of the light.
          const double lamp = kind == FrameKind::kDark ? 0 : 1 - 0.1 * channel;
          writer.CommitFrame(record, o.sensor.Expose(lamp, record.exposure_s, ++stream),
                             nlohmann::json::object());
        }
    }
  writer.Seal("done");
  return folder;
}

class CalibrateSensorTest : public testing::Test {
 protected:
};

void ExpectWithin(const Quantity& q, double truth, double sigmas, const char* name) {
  EXPECT_LT(std::abs(q.value - truth), sigmas * q.sigma)
      << name << " " << q.value << " " << q.sigma;
}

TEST_F(CalibrateSensorTest, FindsTheSensorAndItsBadPixels) {
  Options o;
  o.channels = 3;
  o.sensor.hot = {5, 3000, 11999};
  o.sensor.dead = {777, 4444};
  const session::SessionReader session(Write("whole", o));
  const SensorCalibration c = CalibrateSensor(session);
  EXPECT_EQ(c.width, 120);
  EXPECT_EQ(c.height, 100);
  EXPECT_EQ(c.bits, 12);
  EXPECT_EQ(c.hot, (std::vector<std::pair<int, int>>{{0, 5}, {25, 0}, {99, 119}}));
  EXPECT_EQ(c.dead, (std::vector<std::pair<int, int>>{{6, 57}, {37, 4}}));
  ASSERT_EQ(c.channels.size(), 3u);
  std::vector<const PhotonTransfer*> all{&c.transfer};
  for (const ChannelCalibration& channel : c.channels) {
    all.push_back(&channel.transfer);
    ExpectWithin(channel.prnu_squared, 1e-4, 4, "PRNU^2");
    EXPECT_GE(channel.linearity.points.size(), 4u);
  }
  for (const PhotonTransfer* t : all) {
    ExpectWithin(t->gain_e_per_dn, 2.5, 4, "gain");
    ExpectWithin(t->read_noise_e, 5, 4, "read noise");
    ExpectWithin(t->dark_current_e_per_s, 10, 4, "dark current");
    ExpectWithin(t->offset_dn, 100, 4, "offset");
    ASSERT_TRUE(t->saturation_dn);
    EXPECT_EQ(t->saturation_dn->value, 4095);
  }
  // Three channels' flats hold more than one's.
  EXPECT_LT(c.transfer.gain_e_per_dn.sigma, 0.7 * c.channels[0].transfer.gain_e_per_dn.sigma);
  EXPECT_EQ(c.provenance.at("session_plan"), session.plan_id());
}

TEST_F(CalibrateSensorTest, TakesAMosaicSiteBySite) {
  Options o;
  o.sensor.width = 121;  // one column more of sites 0 and 2
  o.sensor.cell = {0.5, 1, 0.97, 0.7};
  o.sensor.hot = {5, 3000, 12099};
  o.sensor.dead = {777, 4444};
  o.cfa = "RGGB";

  const SensorCalibration c = CalibrateSensor(session::SessionReader(Write("mosaic", o)));
  EXPECT_EQ(c.width, 121);
  EXPECT_EQ(c.hot, (std::vector<std::pair<int, int>>{{0, 5}, {24, 96}, {99, 120}}));
  EXPECT_EQ(c.dead, (std::vector<std::pair<int, int>>{{6, 51}, {36, 88}}));
  ASSERT_EQ(c.channels.size(), 4u);
  std::vector<const PhotonTransfer*> all{&c.transfer};
  for (int site = 0; site < 4; ++site) {
    const ChannelCalibration& channel = c.channels[site];
    EXPECT_EQ(channel.site, site);
    EXPECT_EQ(channel.channel, (std::array{0, 1, 1, 2}[site]));
    all.push_back(&channel.transfer);
    ExpectWithin(channel.prnu_squared, 1e-4, 4, "PRNU^2");
    EXPECT_LT(std::abs(channel.linearity.largest.deviation), 4 * channel.linearity.largest.sigma);
    // Where the brightest site is saturated nothing counts.
    double longest_s = 0;
    for (const TransferPoint& point : channel.transfer.points)
      if (!point.dark && !point.saturated) longest_s = std::max(longest_s, point.exposure_s);
    EXPECT_LT(longest_s, 1);
  }
  for (const PhotonTransfer* t : all) {
    ExpectWithin(t->gain_e_per_dn, 2.5, 4, "gain");
    ExpectWithin(t->read_noise_e, 5, 4, "read noise");
    ExpectWithin(t->dark_current_e_per_s, 10, 4, "dark current");
    ExpectWithin(t->offset_dn, 100, 4, "offset");
  }
  EXPECT_EQ(c.transfer.saturation_dn->value, 4095);
  EXPECT_LT(c.transfer.gain_e_per_dn.sigma, 0.7 * c.channels[0].transfer.gain_e_per_dn.sigma);
  EXPECT_EQ(ToJson(c).at("channels").at(3).at("site"), 3);
  o.cfa = "RGBG";
  EXPECT_THROW(CalibrateSensor(session::SessionReader(Write("mosaic", o))), InputError);
}

TEST_F(CalibrateSensorTest, FilesAreReproducibleAndReplaceASensorsFigures) {
  Options o;
  o.sensor.hot = {250};
  const session::SessionReader session(Write("file", o));
  const SensorCalibration c = CalibrateSensor(session);
  const fs::path a = fs::path(testing::TempDir()) / "luxfield_a.cal.json",
                 b = fs::path(testing::TempDir()) / "luxfield_b.cal.json";
  WriteSensorCalibration(a, c);
  WriteSensorCalibration(b, CalibrateSensor(session, false));
  EXPECT_EQ(core::ReadFile(a), core::ReadFile(b));

  rig::SensorModel sensor;
  sensor.width = 120;
  sensor.height = 100;
  sensor.bits = 12;
  sensor.defects = {{1, 1}};
  sensor.responsivity_e_per_s_per_w_m2 = {7};
  const rig::SensorModel before = sensor;
  EXPECT_EQ(ApplySensorCalibration(a, sensor), core::Sha256OfFile(a));
  EXPECT_EQ(sensor.gain_dn_per_e, c.transfer.gain_dn_per_e.value);
  EXPECT_EQ(sensor.read_noise_dn, c.transfer.read_noise_dn.value);
  EXPECT_EQ(sensor.black_dn, c.transfer.offset_dn.value);
  EXPECT_EQ(sensor.dark_current_e_per_s, c.transfer.dark_current_e_per_s.value);
  EXPECT_EQ(sensor.prnu, c.prnu.value);
  EXPECT_EQ(sensor.saturation_dn, 4095);
  EXPECT_EQ(sensor.responsivity_e_per_s_per_w_m2, before.responsivity_e_per_s_per_w_m2);
  EXPECT_EQ(sensor.defects, (std::vector<std::pair<int, int>>{{1, 1}, {2, 10}}));

  const auto refuses = [&](const char* part, const std::function<void(core::Json&)>& change) {
    core::Json json = core::ReadJson(a);
    change(json);
    core::WriteJson(b, json);
    rig::SensorModel copy = before;
    try {
      ApplySensorCalibration(b, copy);
      ADD_FAILURE() << part << " was accepted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  refuses("format", [](core::Json& json) { json.erase("format"); });
  refuses("is not a sensor calibration", [](core::Json& json) { json["format"] = "other"; });
  refuses("version", [](core::Json& json) { json["version"] = 2; });
  refuses("width", [](core::Json& json) { json["width"] = 121; });
  refuses("bits", [](core::Json& json) { json["bits"] = 14; });
  refuses("gain_dn_per_e", [](core::Json& json) { json["sensor"]["gain_dn_per_e"] = -1; });
  refuses("saturation_dn", [](core::Json& json) { json["sensor"]["saturation_dn"] = 3; });
  refuses("outside", [](core::Json& json) { json["dead_pixels"] = {{100, 0}}; });
  // Never reached: the session's own stays.
  core::Json json = core::ReadJson(a);
  json["sensor"]["saturation_dn"] = nullptr;
  core::WriteJson(b, json);
  rig::SensorModel copy = before;
  ApplySensorCalibration(b, copy);
  EXPECT_EQ(copy.saturation_dn, before.saturation_dn);
}

TEST_F(CalibrateSensorTest, NamesWhatASessionLacks) {
  const auto refuses = [&](const char* part, const Options& o) {
    try {
      const session::SessionReader session(Write("lacks", o));
      CalibrateSensor(session);
      ADD_FAILURE() << part << " was accepted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("luxfield_calibrate_lacks"), std::string::npos)
          << error.what();
    }
  };
  Options no_darks, no_flats, no_pairs, uneven;
  no_darks.levels = no_flats.levels = no_pairs.levels = 2;
  no_darks.darks = false;
  no_flats.flats = false;
  no_pairs.frames_of_pair = 1;
  refuses("0 pairs of darks", no_darks);
  refuses("0 of flats", no_flats);
  refuses("0 pairs of darks and 0 of flats", no_pairs);
  for (std::size_t p = 30; p < 12000; p += 61) uneven.sensor.dead.push_back(p);
  refuses("stand out of their neighbours in the flats", uneven);
}

}  // namespace
}  // namespace luxfield::reconstruct
