#include "luxfield/session/session_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/core/exr.h"
#include "luxfield/core/json.h"
#include "tests/session/session_folders.h"

namespace luxfield::session {
namespace {

using core::Json;
using testing::AllOf;
using testing::HasSubstr;

// As version 0.1.0 wrote it of a lab of real devices.
constexpr const char* kWritten = R"({
  "camera": {"width": 4, "height": 3, "bits": 12, "black_dn": 64.0, "saturation_dn": 4095.0,
    "gain_dn_per_e": 0.5, "read_noise_dn": 2.0, "dark_current_e_per_s": 0.125, "prnu": 0.01,
    "responsivity_e_per_s_per_w_m2": [10.0, 20.0, 30.0], "defects": [[2, 3]], "cfa": "RGGB",
    "vignetting": "vignetting.exr", "settings": {"driver": "aravis", "gain_db": "0"}},
  "calibration": {"image_from_sensor": [1e-05, 0.0, -0.01, 0.0, -1e-05, 0.01, 0.0, 0.0, 1.0]},
  "lab_files": {"lamp.file": "00ff"},
  "devices": {"camera": "a camera", "camera_firmware": "1.2", "stage": "a stage"},
  "software": {"name": "luxfield", "version": "0.1.0"}})";

// Of the simulated lab, before settings and files of the lab were stated.
constexpr const char* kOlder = R"({
  "camera": {"width": 4, "height": 3, "bits": 32, "black_dn": 64.0, "saturation_dn": 4095.0,
    "gain_dn_per_e": 0.5, "read_noise_dn": 2.0, "dark_current_e_per_s": 0.0, "prnu": 0.0,
    "responsivity_e_per_s_per_w_m2": [10.0], "defects": []},
  "calibration": {"image_from_sensor": [1e-05, 0.0, -0.01, 0.0, -1e-05, 0.01, 0.0, 0.0, 1.0]},
  "devices": {"camera": "simulated camera", "stage": "simulated stage"},
  "software": {"name": "luxfield", "version": "0.1.0"}})";

TEST(SessionFile, GivesBackWhatWasWritten) {
  for (const char* text : {kWritten, kOlder}) {
    const Json json = Json::parse(text);
    EXPECT_EQ(ToJson(SetupFromJson(json, "session.json")).dump(), json.dump());
  }
}

TEST(SessionFile, EveryFieldIsWhereItBelongs) {
  const SessionSetup setup = SetupFromJson(Json::parse(kWritten), "session.json");
  EXPECT_EQ(setup.camera->settings.at("driver"), "aravis");
  EXPECT_EQ(setup.camera->vignetting, "vignetting.exr");
  EXPECT_EQ((*setup.image_from_sensor)(1, 2), 0.01);
  EXPECT_EQ(setup.lab_files.at("lamp.file"), "00ff");
  EXPECT_EQ(setup.devices.at("camera_firmware"), "1.2");
  EXPECT_EQ(setup.software.at("version"), "0.1.0");

  Json json = Json::parse(kWritten);
  json["camera"].erase("vignetting");
  const rig::SensorModel sensor =
      SensorModelOf(SetupFromJson(json, "session.json"), "session.json", ".", 3);
  EXPECT_EQ(sensor.width, 4);
  EXPECT_EQ(sensor.height, 3);
  EXPECT_EQ(sensor.bits, 12);
  EXPECT_EQ(sensor.black_dn, 64);
  EXPECT_EQ(sensor.saturation_dn, 4095);
  EXPECT_EQ(sensor.gain_dn_per_e, 0.5);
  EXPECT_EQ(sensor.read_noise_dn, 2);
  EXPECT_EQ(sensor.dark_current_e_per_s, 0.125);
  EXPECT_EQ(sensor.prnu, 0.01);
  EXPECT_EQ(sensor.responsivity_e_per_s_per_w_m2, (std::vector<double>{10, 20, 30}));
  EXPECT_EQ(sensor.cfa, "RGGB");
  EXPECT_EQ(sensor.defects, (std::vector<std::pair<int, int>>{{2, 3}}));
  EXPECT_TRUE(sensor.vignetting.empty());

  SessionSetup again;
  again.camera = CameraOf(sensor);
  again.camera->settings = setup.camera->settings;
  EXPECT_EQ(ToJson(again).at("camera"), json.at("camera"));
}

TEST(SessionFile, TheModelHasTheVignettingBesideIt) {
  const auto folder = NewFolder("vignetting");
  std::filesystem::create_directories(folder);
  core::Image map(4, 3, 1);
  for (std::size_t k = 0; k < map.data.size(); ++k)
    map.data[k] = 1 - 0.0625f * static_cast<float>(k);
  core::WriteExrImage(folder / "vignetting.exr", map);
  const SessionSetup setup = SetupFromJson(Json::parse(kWritten), "session.json");
  EXPECT_EQ(SensorModelOf(setup, "session.json", folder).vignetting, map.data);
  map.data[5] = 0;
  core::WriteExrImage(folder / "vignetting.exr", map);
  EXPECT_THAT(MessageOf([&] { SensorModelOf(setup, "session.json", folder); }),
              HasSubstr("relative sensitivity 0 must be above 0"));
  core::WriteExrImage(folder / "vignetting.exr", core::Image(3, 3, 1));
  EXPECT_THAT(MessageOf([&] { SensorModelOf(setup, "session.json", folder); }),
              HasSubstr("3 x 3 pixels"));
}

TEST(SessionFile, PassesOverKeysOfLaterVersions) {
  Json json = Json::parse(kWritten);
  json["weather"] = "dry";
  json["camera"]["colour"] = "grey";
  EXPECT_EQ(ToJson(SetupFromJson(json, "session.json")), Json::parse(kWritten));
}

TEST(SessionFile, TellsTheSensorsSizeAlone) {
  core::SimulatedClock clock;
  const auto folder = NewFolder("size");
  SessionWriter::Create(folder, kPlan, {{"camera", {{"width", 5}, {"height", 7}, {"bits", "?"}}}},
                        {}, clock);
  const auto size = StatedSize(SessionReader(folder));
  ASSERT_TRUE(size);
  EXPECT_EQ(size->width, 5);
  EXPECT_EQ(size->height, 7);
  EXPECT_FALSE(StatedSize(SessionReader(WholeSession("no_size"))));
}

TEST(SessionFile, NamesFileFieldAndValueOfWhatIsWrong) {
  struct Wrong {
    const char *pointer, *value, *said;
  };
  constexpr Wrong kWrong[] = {
      {"/camera/width", "0", "camera.width = 0 is not between 1 and 100000"},
      {"/camera/width", "4.5", "'width' = 4.5"},
      {"/camera/bits", "64", "camera.bits = 64"},
      {"/camera/gain_dn_per_e", "\"high\"", "'gain_dn_per_e' = \"high\""},
      {"/camera/gain_dn_per_e", "-1", "camera.gain_dn_per_e = -1"},
      {"/camera/read_noise_dn", "-0.1", "camera.read_noise_dn = -0.1"},
      {"/camera/saturation_dn", "60", "camera.saturation_dn = 60 must be above camera.black_dn"},
      {"/camera/prnu", "2", "camera.prnu = 2"},
      {"/camera/black_dn", "null", "'black_dn' = null"},
      {"/camera/responsivity_e_per_s_per_w_m2", "[1.0]", "1 values for 3 channels"},
      {"/camera/responsivity_e_per_s_per_w_m2", "[1.0, 0.0, 1.0]", "must be above 0"},
      {"/camera/defects", "[[3, 0]]", "[3, 0], outside the sensor of 3 rows x 4 columns"},
      {"/camera/defects", "\"none\"", "'defects' = \"none\""},
      {"/camera/cfa", "\"CMYK\"", "camera.cfa = 'CMYK' is unknown"},
      {"/camera/vignetting", "\"../map.exr\"", "map.exr"},
      {"/camera/settings", "{\"driver\": 1}", "settings"},
      {"/calibration/image_from_sensor", "[1, 2, 3]", "image_from_sensor"},
      {"/devices", "[1]", "devices"},
      {"/lab_files", "7", "lab_files"},
  };
  for (const Wrong& wrong : kWrong) {
    Json json = Json::parse(kWritten);
    json.at(Json::json_pointer(wrong.pointer)) = Json::parse(wrong.value);
    EXPECT_THAT(MessageOf([&] {
                  SensorModelOf(SetupFromJson(json, "s/session.json"), "s/session.json", ".", 3);
                }),
                AllOf(HasSubstr("s/session.json"), HasSubstr(wrong.said)))
        << wrong.pointer << " = " << wrong.value;
  }
  for (const char* key : {"width", "bits", "black_dn", "prnu", "responsivity_e_per_s_per_w_m2"}) {
    Json json = Json::parse(kWritten);
    json["camera"].erase(key);
    EXPECT_THAT(MessageOf([&] {
                  SensorModelOf(SetupFromJson(json, "s/session.json"), "s/session.json", ".", 3);
                }),
                HasSubstr(std::string("field '") + key + "' is missing"));
  }
  EXPECT_THAT(MessageOf([&] {
                SensorModelOf(SetupFromJson(Json::parse(kWritten), "session.json"), "session.json",
                              NewFolder("no_vignetting"));
              }),
              HasSubstr("vignetting.exr"));
  EXPECT_THAT(MessageOf([&] { SensorModelOf(SessionSetup(), "s/session.json", "."); }),
              HasSubstr("field 'camera' is missing"));
}

}  // namespace
}  // namespace luxfield::session
