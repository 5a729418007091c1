// `luxfield export` as a user runs it: every format with --check, what info and import make of it, and
// what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "luxfield/core/colour.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/lightfield/posed_light_field.h"
#include "tests/bridges/foreign.h"
#include "tests/e2e/verb_test.h"
#include "tests/formats/light_field_lamps.h"
#include "tests/seed.h"

namespace luxfield::e2e {
namespace {

using Json = nlohmann::json;
using lightfield::Vec3;
using testing::HasSubstr;

class Export : public VerbTest {
 protected:
  void SetUp() override {
    VerbTest::SetUp();
    lightfield::WriteLightFields(folder_ / "x.lf.exr", formats::AsymmetricLamp(3));
  }

  // The verb's rows of --check, which hold.
  Json Checked(const std::string& output, std::vector<std::string> options = {}) {
    std::vector<std::string> words = {"export", "x.lf.exr",           "-o", output, "--check",
                                      "--seed", std::to_string(seed_)};
    words.insert(words.end(), options.begin(), options.end());
    const Json json = Run(words);
    const Json rows = json.value("check", Json::array());
    EXPECT_FALSE(rows.empty()) << output;
    for (const Json& row : rows) {
      for (const char* key :
           {"format", "judge", "receivers", "max_rel_error", "mc_sigma", "stated_error"})
        EXPECT_TRUE(row.contains(key)) << output << " " << key;
      EXPECT_LE(row.value("max_rel_error", 1.0), row.value("stated_error", 0.0)) << output;
    }
    return json;
  }

  std::string Refusal(const std::vector<std::string>& options) {
    std::vector<std::string> words = {"export", "x.lf.exr"};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome outcome = RunLuxfield(words, folder_);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    return outcome.err;
  }

  const std::uint64_t seed_ = TestSeed(51);
};

TEST_F(Export, RaysOfEveryFormatHoldAndAreRead) {
  for (const char* output : {"x.tm25ray", "x.dat", "x.sdf", "x.ltrf", "x.speos.ray"}) {
    SCOPED_TRACE(output);
    const Json json = Checked(output, {"--rays", "60000"});
    const double degrees = json.value("degrees", 0.0);
    EXPECT_GT(degrees, 60);
    EXPECT_LT(std::abs(json.value("chi_squared", 0.0) - degrees), 5 * std::sqrt(2 * degrees));
    const Json info = Run({"info", output});
    EXPECT_EQ(info.value("kind", ""), "rays");
  }
  // The same for the same seed, whatever the threads.
  Run({"export", "x.lf.exr", "-o", "a.dat", "--rays", "5000", "--threads", "1"});
  Run({"export", "x.lf.exr", "-o", "b.dat", "--rays", "5000", "--threads", "2"});
  Run({"export", "x.lf.exr", "-o", "c.dat", "--rays", "5000", "--seed", "2"});
  EXPECT_EQ(ReadText(folder_ / "a.dat"), ReadText(folder_ / "b.dat"));
  EXPECT_NE(ReadText(folder_ / "a.dat"), ReadText(folder_ / "c.dat"));
}

TEST_F(Export, IntensitiesHoldAndAreRead) {
  for (const auto& [output, options] :
       {std::pair{"x.ies", std::vector<std::string>{}},
        std::pair{"near.ies", std::vector<std::string>{"--distance", "0.5"}},
        std::pair{"x.tm33.xml", std::vector<std::string>{}},
        std::pair{"x.gldf", std::vector<std::string>{}},
        std::pair{"new.ies", std::vector<std::string>{"--format", "lm-63-2019"}},
        std::pair{"x.ldt", std::vector<std::string>{"--plane-step", "3", "--angle-step", "0.5"}}}) {
    SCOPED_TRACE(output);
    const Json json = Checked(output, options);
    EXPECT_NEAR(json.value("flux", 0.0) / json.value("light_field_flux", 1.0), 1, 1e-4);
    const Json info = Run({"info", output});
    EXPECT_EQ(info.value("kind", ""), "photometry");
    EXPECT_NEAR(info.value("flux_lm", 0.0) / json.value("light_field_flux", 1.0), 1, 1e-4);
    EXPECT_EQ(info.at("odd").size(), 0u) << info.at("odd").dump();
  }
  EXPECT_THAT(ReadText(folder_ / "near.ies"), HasSubstr("[NEARFIELD] 0.5 0.5 0.5"));
  const Json shape = Run({"info", "x.gldf"}).value("shape", Json::object());
  const Json object = shape.at("objects").at(0), surface = shape.at("surfaces").at(0);
  EXPECT_EQ(object.at("shape"), "rectangle");
  EXPECT_NEAR(surface.value("area_m2", 0.0), object.value("x_m", 0.0) * object.value("y_m", 0.0),
              1e-9);
  EXPECT_EQ(object.at("direction"), Json({0, 0, 1}));
}

// A judge that answers as the words say, in place of the programs of others, which are not needed to
// test what the verb does with an answer. Its arguments go to a file.
TEST_F(Export, ConformanceSheetsAreAskedForAndRead) {
  const auto judge = [&](const std::string& facts) {
    std::ofstream(folder_ / "foreign/bin/python")
        << "#!/bin/sh\necho \"$@\" > asked\necho noise\nmkdir -p x.check\n"
        << (facts.empty() ? std::string()
                          : "echo '{\"lamps\": [{\"programs\": {\"P\": " + facts +
                                "}}]}' > x.check/sheet.json\n");
    std::filesystem::permissions(folder_ / "foreign/bin/python", std::filesystem::perms::owner_all);
  };
  const auto facts = [](const char* agrees) {
    return std::string(R"({"program": "P 1", "agrees": )") + agrees +
           R"(, "receivers": {"receivers": 500, "mean": 0.001, "mean_sigma": 0.0002,)"
           R"( "median_sigma": 0.003, "largest": 0.02,)"
           R"( "share_within_half_a_percent_and_3_sigma": 0.99}})";
  };
  setenv("LUXFIELD_FOREIGN", (folder_ / "foreign").c_str(), 1);
  EXPECT_THAT(Refusal({"-o", "x.rad", "--check"}),
              HasSubstr("foreign/bin/python is not there; install the judges"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x.rad"));
  std::filesystem::create_directories(folder_ / "foreign/bin");
  judge(facts("true"));
  const Json row =
      Run({"export", "x.lf.exr", "-o", "x.rad", "--check", "--seed", "7"}).at("check").at(0);
  EXPECT_EQ(row.value("judge", ""), "P 1");
  EXPECT_EQ(row.value("receivers", 0), 500);
  EXPECT_EQ(row.value("max_rel_error", 0.0), 0.02);
  EXPECT_EQ(row.value("mc_sigma", 0.0), 0.003);
  EXPECT_EQ(row.value("stated_error", 0.0), 0.005);
  const std::string asked = ReadText(folder_ / "asked");
  EXPECT_THAT(asked, HasSubstr("sheet.py --luxfield "));
  EXPECT_THAT(asked, HasSubstr("--program radiance --seed 7 -o x.check -- x.lf.exr"));
  judge(facts("false"));
  EXPECT_EQ(RunLuxfield({"export", "x.lf.exr", "-o", "x.rad", "--check"}, folder_).exit_code, 1);
  judge(R"({"missing": "Radiance did not answer"})");
  EXPECT_THAT(Refusal({"-o", "x.rad", "--check"}), HasSubstr("Radiance did not answer"));
  judge("");
  EXPECT_THAT(Refusal({"-o", "x.rad", "--check"}), HasSubstr("gave no sheet"));
  EXPECT_THAT(Refusal({"-o", "x.usda", "--check"}),
              HasSubstr("no program that judges exports to usd"));
  unsetenv("LUXFIELD_FOREIGN");
}

TEST_F(Export, UncertaintyIsStated) {
  auto sigma = formats::AsymmetricLamp(3);
  for (float& c : sigma[0].field.data) c = 0.05f * c;
  lightfield::WriteLightFields(folder_ / "s.lf.exr", sigma);
  const Json json = Run({"export", "x.lf.exr", "-o", "x.ies", "--sigma", "s.lf.exr"});
  EXPECT_GT(json.at("uncertainty").value("flux", 0.0), 0);
  EXPECT_EQ(json.at("uncertainty").value("k", 0.0), 2);
  EXPECT_THAT(ReadText(folder_ / "x.ies"), HasSubstr("[_UNCERTAINTY_PEAK] "));
  Run({"export", "x.lf.exr", "-o", "x.ldt", "--sigma", "s.lf.exr"});
  EXPECT_THAT(ReadText(folder_ / "x.ldt"), HasSubstr("k = 2"));
}

TEST_F(Export, PicturesHold) {
  for (const char* output : {"x.hdr", "x.exr"}) {
    for (const char* view : {"perspective", "fisheye", "equirectangular", "plane"}) {
      SCOPED_TRACE(view);
      const Json json =
          Checked(output, {"--view", view, "--size", "96", "64", "--distance", "0.3"});
      EXPECT_EQ(json.value("unit", ""), std::string(view) == "plane" ? "lx" : "cd/m^2");
    }
  }
  Checked("x.hdr");
  const Json square = Run({"info", "x.hdr"});
  EXPECT_EQ(square.value("kind", ""), "picture");
  EXPECT_EQ(square.value("width", 0), square.value("height", 1));
  EXPECT_GT(square.value("largest_luminance", 0.0), square.value("mean_luminance", 1e99));
  const std::string header = ReadText(folder_ / "x.hdr").substr(0, 400);
  EXPECT_THAT(header, HasSubstr("VIEW= -vtv -vp 0 0 1 -vd 0 0 -1 -vu 0 1 0 "));
}

// Radiance's evalglare sums the fisheye picture of a headlight into the illuminance at the eye: the
// exact one, within what the picture's rays and its steps of half a per cent leave.
TEST_F(Export, EvalglareFindsTheIlluminanceAtTheEye) {
  using bridges::ForeignProgram;
  LUXFIELD_NEEDS_FOREIGN("evalglare");
  const Vec3 eye{0.1, -0.05, 0.4};
  const Json row = Checked("x.hdr", {"--view", "fisheye", "--size", "800", "800", "--eye", "0.1",
                                     "-0.05", "0.4"})
                       .at("check")
                       .at(0);
  const std::string said = bridges::OutputOf(ForeignProgram("evalglare") + " -d " +
                                             (folder_ / "x.hdr").string() + " 2>/dev/null");
  // "dgp,av_lum,E_v,...: 0.5 150.9 947.9 ..."
  const auto at = said.rfind(": ");
  ASSERT_NE(at, std::string::npos) << said;
  std::istringstream values(said.substr(at + 2));
  double dgp = 0, mean = 0, found = 0;
  values >> dgp >> mean >> found;
  const auto fields = lightfield::ReadLightFields(folder_ / "x.lf.exr");
  const double exact =
      core::Luminance(lightfield::ExactIrradiance(fields[0].field, eye, (-1 / Length(eye)) * eye));
  std::printf("evalglare %.2f lx, exact %.2f lx\n", found, exact);
  EXPECT_NEAR(found / exact, 1, 0.002 + 5 * row.value("mc_sigma", 0.0));
}

// Rays exported and imported again, onto the same planes: intensities within their counting noise.
TEST_F(Export, ImportGivesTheLightFieldBack) {
  Run({"export", "x.lf.exr", "-o", "x.tm25ray", "--rays", "400000", "--seed",
       std::to_string(seed_)});
  Run({"import", "x.tm25ray", "-o", "y.lf.exr", "--sigma", "s.lf.exr", "--faces", "one",
       "--filter-z", "0", "--delta", "0.2", "--signed"});
  const auto lamp = lightfield::ReadLightFields(folder_ / "x.lf.exr"),
             back = lightfield::ReadLightFields(folder_ / "y.lf.exr");
  EXPECT_NEAR(
      core::Luminance(lightfield::TotalFlux(back)) / core::Luminance(lightfield::TotalFlux(lamp)),
      1, 2e-5);
  double squares = 0;
  constexpr int kDirections = 25;
  for (int k = 0; k < kDirections; ++k) {
    const Vec3 d =
        lightfield::Normalized(Vec3{0.25 + 0.05 * (k % 5 - 2), -0.1 + 0.05 * (k / 5 - 2), 1});
    const double exact = formats::IntensityOf(lamp, d, {});
    squares += std::pow(formats::IntensityOf(back, d, {}) / exact - 1, 2);
  }
  EXPECT_LT(std::sqrt(squares / kDirections), 0.05);
}

TEST_F(Export, WhatIsNotUnderstoodIsRefused) {
  EXPECT_THAT(Refusal({"-o", "x.foo"}), HasSubstr("has an ending that names no format"));
  EXPECT_THAT(Refusal({"-o", "x.ray"}), HasSubstr("may be of several programs"));
  EXPECT_THAT(Refusal({"-o", "x.ies", "--format", "speos"}), HasSubstr("is no name for"));
  EXPECT_THAT(Refusal({"-o", "x.ies", "--rays", "100"}), HasSubstr("--rays is read for"));
  EXPECT_THAT(Refusal({"-o", "x.dat", "--distance", "2"}), HasSubstr("--distance is read for"));
  EXPECT_THAT(Refusal({"-o", "x.ies", "--distance", "0.01"}), HasSubstr("give a larger distance"));
  EXPECT_THAT(Refusal({"-o", "x.dat", "--rays", "50", "--check"}),
              HasSubstr("--rays 50 are too few for --check; give 3200 or more"));
  EXPECT_THAT(Refusal({"-o", "x.hdr", "--eye", "0", "0", "0"}), HasSubstr("--look-at"));
  EXPECT_THAT(Refusal({"-o", "x.hdr", "--fov", "1", "--check"}), HasSubstr("the whole lamp"));
  EXPECT_EQ(RunLuxfield({"export", "absent.lf.exr", "-o", "x.ies"}, folder_).exit_code, 2);
  for (const char* name : {"x.ies", "x.dat", "x.hdr", "x.ray", "x.foo"})
    EXPECT_FALSE(std::filesystem::exists(folder_ / name)) << name;
}

}  // namespace
}  // namespace luxfield::e2e
