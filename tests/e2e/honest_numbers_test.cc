// Numbers that the program prints and takes: what they mean is said, absurd ones are named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/core/colour.h"
#include "luxfield/lightfield/light_field.h"
#include "tests/e2e/tiny_session.h"
#include "tests/e2e/verb_test.h"

namespace luxfield::e2e {
namespace {

using Json = nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

class HonestNumbers : public VerbTest {
 protected:
  Outcome Luxfield(const std::vector<std::string>& arguments) {
    return RunLuxfield(arguments, folder_);
  }
  void ExpectRefused(const std::vector<std::string>& arguments,
                     const std::vector<std::string>& parts) {
    const Outcome outcome = Luxfield(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.out;
    for (const auto& part : parts) EXPECT_THAT(outcome.err, HasSubstr(part));
  }
};

std::string Replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

// Of three channels a lumen is their luminance, and not the red one.
TEST_F(HonestNumbers, FluxOfAColouredFieldIsItsLuminance) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.1;
  geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBspline2), 2, 2, 0.02);
  geometry.lattice = {2, 2, -0.02, 0.02, 0.02, 0.02};
  geometry.channels = 3;
  geometry.unit = lightfield::FluxUnit::kLumen;
  lightfield::LightField field(geometry);
  // Each texel and basis function contributes C ds dt h^2: 4 * 4 * 4e-4 * 4e-4 C.
  const double red = 10000, green = 3000, blue = 500, per_c = 16 * 4e-4 * 4e-4;
  for (int m = 0; m < 4; ++m) {
    for (float& c : field.image(m, 0)) c = static_cast<float>(red);
    for (float& c : field.image(m, 1)) c = static_cast<float>(green);
    for (float& c : field.image(m, 2)) c = static_cast<float>(blue);
  }
  lightfield::WriteLightField(folder_ / "rgb.lf.exr", field);
  const double expected = (0.2126 * red + 0.7152 * green + 0.0722 * blue) * per_c;
  const Json figures = Run({"info", "rgb.lf.exr"});
  EXPECT_NEAR(figures.at("luminance_flux").get<double>(), expected, 1e-6 * expected);
  EXPECT_NEAR(figures.at("flux")[0].get<double>(), red * per_c, 1e-6 * red * per_c);
  EXPECT_THAT(Luxfield({"info", "rgb.lf.exr"}).out,
              AllOf(HasSubstr("flux         0.0110277 lm (luminance of R G B"),
                    testing::Not(HasSubstr("channel 0"))));
}

TEST_F(HonestNumbers, MillimetresAreSuspect) {
  WriteText(folder_ / "plan.toml", Replaced(TinyPlan(2, 2), "ds_m = 0.02", "ds_m = 6"));
  const Outcome outcome = Luxfield({"info", "plan.toml"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("plan.toml: ds_m = 6 m"), HasSubstr("metres?")));
  WriteText(folder_ / "plan.toml", TinyPlan(2, 2));
  EXPECT_THAT(Luxfield({"info", "plan.toml"}).err, testing::Not(HasSubstr("warning")));
}

TEST_F(HonestNumbers, AbsurdNumbersOfTheCommandLineAreRefused) {
  for (const char* value : {"nan", "inf", "1e300"})
    ExpectRefused({"render", "s.toml", "-o", "x.exr", "--exposure", value}, {"--exposure", value});
}

// A captured session whose journal and plan are then changed, each line resealed: as another
// program, or a meter over range, would have written it.
TEST_F(HonestNumbers, AbsurdReadingsAreRefusedBeforeTheyAreMerged) {
  WriteText(folder_ / "lab.toml", TinyLab(1, 0.01));
  WriteText(folder_ / "plan.toml", TinyPlan(1, 1));
  Run({"capture", "plan.toml", "s", "--lab", "lab.toml"});
  const std::string journal = ReadText(folder_ / "s/journal.jsonl");
  const auto spoil = [&](const std::string& key, const std::string& value) {
    const auto at = journal.find("\"" + key + "\":");
    ASSERT_NE(at, std::string::npos) << key;
    const auto end = journal.find_first_of(",}", at);
    WriteText(folder_ / "s/journal.jsonl",
              journal.substr(0, at) + "\"" + key + "\":" + value + journal.substr(end));
    // Whether the chain of hashes or the number is met first, nothing is merged.
    ExpectRefused({"merge", "s", "-o", "o.meas.exr"}, {"journal.jsonl"});
    EXPECT_FALSE(std::filesystem::exists(folder_ / "o.meas.exr"));
  };
  spoil("exposure_s", "1e300");
}

constexpr const char* kMeshScene = R"([camera]
position = [0, -5, 1]
look_at = [0, 0, 0]
[[mesh]]
file = "lamp.gltf"
)";

// A triangle of a material that emits light, and a lamp, in a file that says so.
constexpr const char* kLampGltf =
    R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
    R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],)"
    R"("buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)"
    R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],)"
    R"("bufferViews":[{"buffer":0,"byteLength":36}],)"
    R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)"
    R"("min":[0,0,0],"max":[1,1,0]}],"materials":[{"emissiveFactor":[1,1,1]}],)"
    R"("extensionsUsed":["KHR_lights_punctual"],)"
    R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"point"}]}}})";

TEST_F(HonestNumbers, WhatAMeshLeavesOutIsSaid) {
  WriteText(folder_ / "lamp.gltf", kLampGltf);
  WriteText(folder_ / "scene.toml", kMeshScene);
  const Json left_out = Run({"info", "scene.toml"}).at("left_out");
  ASSERT_EQ(left_out.size(), 1u);
  EXPECT_EQ(left_out[0].at("features").size(), 2u);
  const Outcome outcome = Luxfield({"info", "scene.toml"});
  for (const std::string* text : {&outcome.out, &outcome.err})
    EXPECT_THAT(*text, AllOf(HasSubstr("lamp.gltf"), HasSubstr("KHR_lights_punctual"),
                             HasSubstr("emissiveFactor")));
}

}  // namespace
}  // namespace luxfield::e2e
