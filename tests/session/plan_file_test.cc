#include "luxfield/session/plan_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/session/plan_json.h"
#include "tests/session/session_folders.h"

namespace luxfield::session {
namespace {

using core::Json;
using testing::AllOf;
using testing::HasSubstr;

// Files as versions up to 0.1.0 wrote them, by what is particular about them.
struct WrittenPlan {
  const char* about;
  const char* text;
};
constexpr WrittenPlan kWritten[] = {
    {"a light field with all its parts",
     R"({"name": "small", "geometry": {"delta_m": 0.2, "basis": "bspline2", "basis_a": 0.0,
         "grid_width": 2, "grid_height": 1, "u0_m": -0.01, "v0_m": 0.0, "spacing_m": 0.02,
         "lattice": {"width": 4, "height": 3, "s0_m": -0.2, "t1_m": 0.15, "ds_m": 0.1, "dt_m": 0.1},
         "channels": 1, "unit": "lm"},
       "filter": {"kind": "basis", "scale": 1.5}, "rig": {"kind": "reflector", "albedo": 0.8},
       "exposure": {"ladder_s": [0.01, 0.04], "saturation_share": 0.9, "relevant_share": 0.0001,
         "floor_sigmas": 5.0, "repeats": 1, "max_attempts": 3, "mean_tolerance": 0.05,
         "flicker": 0.0, "pwm_hz": 100.0},
       "reference": {"every": 10, "max_drift": 0.1, "resume_share": 0.5, "interval_s": 60.0,
         "max_wait_s": 3600.0, "u_m": 0.01, "v_m": 0.0},
       "warm_up": {"window_s": 60.0, "interval_s": 5.0, "variation": 0.005, "max_wait_s": 3600.0},
       "darks": {"repeats": 4}, "stage": {"max_m": [0.05, 0.06], "speed_m_per_s": 0.004},
       "positions": [{"i": 0, "j": 0, "u_m": -0.01, "v_m": 0.0},
                     {"i": 1, "j": 0, "u_m": 0.01, "v_m": 0.0}]})"},
    {"a dual filter",
     R"({"name": "", "filter": {"kind": "dual", "scale": 1.0},
         "rig": {"kind": "lensless", "albedo": 1.0}})"},
    {"a sensor",
     R"({"kind": "sensor", "name": "flats", "channels": 3,
         "exposure": {"ladder_s": [0.1, 0.2], "pairs": 2, "max_attempts": 3},
         "warm_up": {"window_s": 60.0, "interval_s": 5.0, "variation": 0.005, "max_wait_s": 3600.0}})"},
    {"a geometry",
     R"({"kind": "geometry", "name": "bench", "targets": {
           "board": {"columns": 9, "rows": 6, "pitch_m": 0.01},
           "mask": {"columns": 7, "rows": 4, "pitch_m": 0.005},
           "spacer_m": 0.02, "spacer_shift_m": 0.0001},
         "stage": {"repeatability_m": 1e-06, "min_m": [-0.1, -0.2]},
         "exposure": {"ladder_s": [0.1], "saturation_share": 0.8, "max_attempts": 3},
         "views": [{"target": "board 1", "u_m": 0.0, "v_m": 0.0},
                   {"target": "mask", "u_m": 0.02, "v_m": -0.02}]})"},
    {"a glare",
     R"({"kind": "glare", "name": "trap",
         "exposure": {"ladder_s": [0.1], "saturation_share": 0.8, "repeats": 4, "max_attempts": 3},
         "views": [{"target": "trap 1"}, {"target": "trap 2"}]})"},
};

TEST(PlanFile, GivesBackWhatWasWritten) {
  for (const WrittenPlan& written : kWritten) {
    const Json json = Json::parse(written.text);
    EXPECT_EQ(ToJson(PlanFromJson(json, "plan.json")).dump(), json.dump()) << written.about;
  }
}

TEST(PlanFile, OfAFilterGivesBackItsSheet) {
  PlanFile plan;
  plan.kind = PlanKind::kFilter;
  plan.name = "sheet";
  plan.sheet =
      rig::FilterSheet::Make(lightfield::FilterKind::kDual,
                             lightfield::Basis::Make(lightfield::BasisKind::kBilinear), 0.01, 1);
  plan.views = {{"filter holder", {}}, {"filter plus", {}}, {"filter minus", {}}};
  PlannedExposures& exposure = plan.exposure.emplace();
  exposure.ladder_s = {0.25, 0.5};
  exposure.exposures = 3;
  const Json json = ToJson(plan);
  EXPECT_EQ(json.at("sheet").dump(), rig::SheetText(*plan.sheet));
  const PlanFile again = PlanFromJson(json, "plan.json");
  EXPECT_EQ(ToJson(again).dump(), json.dump());
  EXPECT_EQ(again.kind, PlanKind::kFilter);
  EXPECT_EQ(again.sheet->marks.size(), plan.sheet->marks.size());
  EXPECT_EQ(again.views->at(2).target, "filter minus");
}

TEST(PlanFile, EveryFieldIsWhereItBelongs) {
  const PlanFile plan = PlanFromJson(Json::parse(kWritten[0].text), "plan.json");
  EXPECT_EQ(plan.kind, PlanKind::kLightField);
  EXPECT_EQ(plan.name, "small");
  EXPECT_EQ(plan.geometry->grid.width, 2);
  EXPECT_EQ(plan.geometry->lattice.t1_m, 0.15);
  EXPECT_EQ(plan.filter->scale, 1.5);
  EXPECT_EQ(plan.rig->kind, rig::RigKind::kReflector);
  EXPECT_EQ(plan.rig->albedo, 0.8);
  EXPECT_EQ(plan.exposure->ladder_s, (std::vector<double>{0.01, 0.04}));
  EXPECT_EQ(plan.exposure->pwm_hz, 100);
  EXPECT_FALSE(plan.exposure->pairs);
  EXPECT_EQ(plan.reference->policy.max_wait_s, 3600);
  EXPECT_EQ(plan.reference->place.x, 0.01);
  EXPECT_EQ(plan.dark_repeats, 4);
  EXPECT_FALSE(plan.stage->min_m);
  EXPECT_EQ(plan.stage->max_m->y, 0.06);
  ASSERT_EQ(plan.positions->size(), 2u);
  EXPECT_EQ(plan.positions->at(1).centre.x, 0.01);
  EXPECT_FALSE(plan.views);
}

// What plans state that the first versions wrote: no tolerance, no kind of basis that has an a.
TEST(PlanFile, OlderFilesLackParts) {
  const PlanFile plan = PlanFromJson(
      Json::parse(R"({"geometry": {"delta_m": 0.2, "basis": "quadratic", "grid_width": 1,
        "grid_height": 1, "u0_m": 0, "v0_m": 0, "spacing_m": 0.02, "channels": 1, "unit": "W",
        "lattice": {"width": 1, "height": 1, "s0_m": 0, "t1_m": 1, "ds_m": 1, "dt_m": 1}},
        "filter": {"kind": "dual"}, "rig": {"kind": "lensless"}, "exposure": {},
        "reference": {"every": 5}, "warm_up": {}})"),
      "plan.json");
  EXPECT_EQ(plan.geometry->grid.basis.a, 0.5);
  EXPECT_EQ(plan.filter->kind, lightfield::FilterKind::kDual);
  EXPECT_EQ(plan.rig->albedo, 1);
  EXPECT_FALSE(plan.exposure->mean_tolerance);
  EXPECT_EQ(plan.reference->policy.every, 5);
  EXPECT_EQ(plan.reference->policy.max_drift, ReferencePolicy().max_drift);
  const PlanFile empty = PlanFromJson(Json::object(), "plan.json");
  EXPECT_EQ(empty.kind, PlanKind::kLightField);
  EXPECT_FALSE(empty.geometry || empty.exposure || empty.positions);
}

TEST(PlanFile, PassesOverKeysOfLaterVersions) {
  Json json = Json::parse(kWritten[0].text);
  json["colour_of_the_curtain"] = "black";
  json["exposure"]["hurry"] = true;
  json["positions"][0]["tilt_rad"] = 0.1;
  EXPECT_EQ(ToJson(PlanFromJson(json, "plan.json")), Json::parse(kWritten[0].text));
}

TEST(PlanFile, NamesFileFieldAndValueOfWhatIsWrong) {
  struct Wrong {
    int written;
    const char *pointer, *value, *said;
  };
  constexpr Wrong kWrong[] = {
      {0, "/geometry/delta_m", "-1", "delta_m"},
      {0, "/geometry/basis", "\"nurbs\"", "nurbs"},
      {0, "/geometry/lattice", "5", "'width' is missing"},
      {0, "/geometry/grid_width", "1.5", "grid_width"},
      {0, "/filter/kind", "\"triple\"", "kind = 'triple' is unknown; use 'basis' or 'dual'"},
      {0, "/filter/scale", "0", "scale = 0 must be above 0"},
      {0, "/rig/kind", "\"tripod\"", "kind = 'tripod' is unknown; use 'lensless' or 'reflector'"},
      {0, "/rig/albedo", "-0.5", "albedo = -0.5 must be above 0"},
      {0, "/exposure/ladder_s", "0.1", "ladder_s"},
      {0, "/exposure/mean_tolerance", "0", "mean_tolerance = 0 must be above 0"},
      {0, "/exposure/repeats", "\"two\"", "'repeats' = \"two\""},
      {0, "/reference/every", "1e300", "every"},
      {0, "/warm_up/window_s", "null", "window_s"},
      {0, "/darks/repeats", "0.5", "repeats"},
      {0, "/positions", "3", "field 'positions' is no list"},
      {0, "/positions/1/u_m", "\"left\"", "u_m"},
      {0, "/stage/max_m", "[1]", "max_m"},
      {0, "/name", "7", "name"},
      {2, "/kind", "\"senser\"", "kind = 'senser' is unknown"},
      {2, "/channels", "[]", "channels"},
      {3, "/targets/mask/columns", "6", "6 x 4 corners"},
      {3, "/targets/spacer_m", "0", "targets.spacer_m = 0 must be above 0"},
      {3, "/views/0/target", "4", "target"},
      {4, "/views", "{}", "field 'views' is no list"},
  };
  for (const Wrong& wrong : kWrong) {
    Json json = Json::parse(kWritten[wrong.written].text);
    json.at(Json::json_pointer(wrong.pointer)) = Json::parse(wrong.value);
    EXPECT_THAT(MessageOf([&] { PlanFromJson(json, "s/plan.json"); }),
                AllOf(HasSubstr("s/plan.json: "), HasSubstr(wrong.said)))
        << wrong.pointer << " = " << wrong.value;
  }
  EXPECT_THAT(MessageOf([&] { PlanFromJson(Json::array(), "s/plan.json"); }),
              HasSubstr("s/plan.json: "));
}

}  // namespace
}  // namespace luxfield::session
