#include "luxfield/reconstruct/calibrate/geometry/geometry_calibration_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"

namespace luxfield::reconstruct {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

GeometryCalibration Example() {
  GeometryCalibration c;
  Geometry& g = c.geometry;
  g.width = 480;
  g.height = 400;
  g.lens = rig::Lens{{600, 610}, {240, 200}, {-0.1, 0.02, 1e-3, -2e-3}};
  g.image_from_sensor = {{1e-3, 1e-5, -0.2, 2e-5, -1e-3, 0.2, 1e-6, 2e-6, 1}};
  g.delta_m = 0.305;
  g.filter_tilt_rad = {0.001, -0.002};
  g.stage_axes = {{{1.001, 0.002, 0.003}, {-0.001, 0.999, 0.004}}};
  g.parameters = {{"delta", "m", 0.305, 1e-5}};
  g.covariance = {1e-10};
  g.place_sigma_m = {{{1e-5, 2e-5}, {3e-5, 4e-5}, {}, {}, {}}};
  return c;
}

SessionPlan Plan() {
  SessionPlan plan;
  plan.rig = rig::RigKind::kReflector;
  plan.sensor.width = 480;
  plan.sensor.height = 400;
  plan.geometry.delta_m = 0.3;
  return plan;
}

TEST(GeometryCalibrationFile, TakesTheStatedGeometrysPlace) {
  const fs::path file = fs::path(testing::TempDir()) / "luxfield_geometry.cal.json";
  WriteGeometryCalibration(file, Example());
  EXPECT_TRUE(IsGeometryCalibration(file));
  SessionPlan plan = Plan();
  EXPECT_EQ(ApplyGeometryCalibration(file, plan), core::Sha256(core::ReadFile(file)));
  EXPECT_EQ(plan.geometry.delta_m, 0.305);
  ASSERT_TRUE(plan.tilts);
  EXPECT_EQ(plan.tilts->filter_tilt_rad.y, -0.002);
  EXPECT_EQ(plan.tilts->stage_slopes.x, 0.003);
  EXPECT_EQ(plan.tilts->delta_sigma_m, 1e-5);
  EXPECT_EQ(plan.tilts->place_sigma_m, 4e-5);
  EXPECT_EQ(plan.image_from_sensor, Example().geometry.image_from_sensor);
  EXPECT_EQ(plan.stage_axes[1].x, -0.001);
  ASSERT_TRUE(plan.lens);
  EXPECT_EQ(plan.lens->distortion[3], -2e-3);
  EXPECT_EQ(plan.lens->focal_px.x, 600);
  EXPECT_EQ(plan.lens->focal_px.y, 610);
}

TEST(GeometryCalibrationFile, RefusesWhatIsOfAnotherLab) {
  const fs::path file = fs::path(testing::TempDir()) / "luxfield_geometry.cal.json";
  const auto refuses = [&](const char* what, const std::function<void(core::Json&)>& change) {
    core::Json json = ToJson(Example());
    change(json);
    core::WriteJson(file, json);
    SessionPlan plan = Plan();
    try {
      ApplyGeometryCalibration(file, plan);
      ADD_FAILURE() << what;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(what));
    }
  };
  refuses("is not a geometry calibration", [](core::Json& j) { j["format"] = "other"; });
  refuses("has version 2", [](core::Json& j) { j["version"] = 2; });
  refuses("width = 481", [](core::Json& j) { j["width"] = 481; });
  refuses("is of a lensless rig", [](core::Json& j) { j["rig"] = "lensless"; });
  refuses("not within 10 %", [](core::Json& j) { j["delta_m"] = 0.4; });
  refuses("'stage_axes' is missing", [](core::Json& j) { j.erase("stage_axes"); });
  refuses("'filter_tilt_rad' is missing", [](core::Json& j) { j.erase("filter_tilt_rad"); });
  refuses("hold no 'delta'", [](core::Json& j) { j["parameters"] = core::Json::array(); });
  refuses("focal_px must be above 0", [](core::Json& j) { j["lens"]["focal_px"] = {0, 600}; });
}

}  // namespace
}  // namespace luxfield::reconstruct
