// Lamps as files of glTF and OpenUSD: read back, held to the checkers of Khronos and Pixar, and lit by a
// reader that was written from our pages.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "luxfield/bridges/gltf_lamp.h"
#include "luxfield/bridges/usd_lamp.h"
#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/json.h"
#include "luxfield/core/random.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/formats/photometric_file.h"
#include "luxfield/lightfield/light_vector.h"
#include "tests/bridges/foreign.h"
#include "tests/seed.h"

namespace luxfield::bridges {
namespace {

using lightfield::LightField;
using lightfield::Vec3;

web::FitOptions SmallFit() {
  web::FitOptions options;
  options.max_bytes = 60000;
  options.max_error = 0.02;
  options.receivers = 200;
  return options;
}

// A file of a lamp of three channels, whose tables are fitted once.
struct Sample {
  Scratch scratch{"gltf"};
  LightField field = formats::AsymmetricField(3);
  web::FittedVolume fitted =
      WriteGltfLamp(scratch / "lamp.glb", field, "lamp.lf.exr", SmallFit()).fitted;
};

const Sample& ThreeChannels() {
  static const Sample sample;
  return sample;
}

core::Json JsonOf(const std::filesystem::path& glb) {
  const std::string bytes = core::ReadFile(glb);
  std::uint32_t length = 0;
  for (std::size_t k = 0; k < 4; ++k)
    length |= std::uint32_t(static_cast<unsigned char>(bytes[12 + k])) << 8 * k;
  return core::ParseJson(std::string_view(bytes).substr(20, length), glb.string());
}

TEST(GltfLamp, IsReadBackAndValid) {
  const auto& [scratch, field, fitted] = ThreeChannels();
  const web::FittedVolume read = ReadGltfLamp(scratch / "lamp.glb");
  ASSERT_EQ(read.volume.tables.size(), fitted.volume.tables.size());
  for (std::size_t k = 0; k < read.volume.tables.size(); ++k)
    EXPECT_EQ(read.volume.tables[k].codes, fitted.volume.tables[k].codes);
  EXPECT_EQ(read.stated_error(), fitted.stated_error());

  const std::string whole = core::ReadFile(scratch / "lamp.glb");
  core::WriteFileAtomically(scratch / "short.glb", std::string_view(whole).substr(0, 5000));
  EXPECT_THROW(ReadGltfLamp(scratch / "short.glb"), InputError);

  LUXFIELD_NEEDS_FOREIGN("node");
  const std::string said = OutputOf(
      fmt::format("NODE_PATH={}/../node_modules node {}/tests/foreign/validate_gltf.js {} 2>&1",
                  ForeignFolder(), LUXFIELD_SOURCE_DIR, (scratch / "lamp.glb").string()));
  if (said.find("Cannot find module") != said.npos) {
    std::printf("SKIPPED: gltf-validator is not installed (./run foreign)\n");
    GTEST_SKIP() << said;
  }
  const core::Json issues = core::ParseJson(said, "gltf-validator");
  EXPECT_EQ(issues.at("numErrors"), 0) << said;
  EXPECT_EQ(issues.at("numWarnings"), 0) << said;
}

// The reader of docs/formats/gltf-light-field.md, in Python, and its schema.
TEST(GltfLamp, AReaderByThePagesLightsAsStated) {
  LUXFIELD_NEEDS_FOREIGN("python");
  const auto& [scratch, field, fitted] = ThreeChannels();
  core::Json asked;
  std::vector<double> exact;
  const auto receivers = web::LitReceivers(field, fitted.volume, 0.3, 20, 300, TestSeed(4));
  for (const auto& [p, n] : receivers) {
    asked["position_m"].push_back({p.x, p.y, p.z});
    asked["normal"].push_back({n.x, n.y, n.z});
  }
  core::WriteFileAtomically(scratch / "receivers.json", asked.dump());
  const std::string said = OutputOf(fmt::format(
      "cd {} && {} -B {}/bridges/judges/judge_gltf.py lamp.glb receivers.json answer.json 2>&1",
      scratch.folder().string(), ForeignProgram("python"), LUXFIELD_SOURCE_DIR));
  ASSERT_TRUE(std::filesystem::exists(scratch / "answer.json")) << said;
  const core::Json found =
      core::ParseJson(core::ReadFile(scratch / "answer.json"), "answer").at("illuminance");
  ASSERT_EQ(found.size(), receivers.size());
  for (std::size_t k = 0; k < receivers.size(); ++k) {
    const auto& [p, n] = receivers[k];
    const double e = core::Luminance(lightfield::ExactIrradiance(field, p, n));
    const double unit =
        std::max(std::abs(e), web::kFloorShare * web::BrightestAt(fitted.volume, p.z));
    EXPECT_NEAR(found[k].get<double>(), e, fitted.stated_error() * unit) << k;
    EXPECT_NEAR(found[k].get<double>(), web::IlluminanceAt(fitted.volume, p, n), 1e-5 * unit) << k;
  }
}

// Fallback lights point where the beam goes, with the lamp's flux.
TEST(GltfLamp, FallbacksAreTheLampFarAway) {
  const auto& [scratch, field, fitted] = ThreeChannels();
  const core::Json json = JsonOf(scratch / "lamp.glb");
  const core::Json& light = json.at("extensions").at("KHR_lights_punctual").at("lights")[0];
  const double inner = light.at("spot").at("innerConeAngle"),
               outer = light.at("spot").at("outerConeAngle");
  // Falloff of KHR_lights_punctual: the square of a ramp between the two cosines.
  const double solid_angle =
      2 * M_PI * (1 - std::cos(inner) + (std::cos(inner) - std::cos(outer)) / 3);
  EXPECT_NEAR(light.at("intensity").get<double>() * solid_angle *
                  core::Luminance(light.at("color").get<core::Rgb>()),
              core::Luminance(lightfield::TotalFlux(field)), 1e-3);
  const core::Json& q = json.at("nodes")[1].at("rotation");
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  // -z turned by the quaternion.
  const Vec3 towards{-2 * (x * z + w * y), -2 * (y * z - w * x), -1 + 2 * (x * x + y * y)};
  // The beam's middle is about (0.05, -0.02, 0.2) in the luminaire, and y = -v, z = -z in the node.
  const Vec3 expected = lightfield::Normalized(Vec3{0.05, 0.02, -0.2});
  EXPECT_GT(Dot(towards, expected), std::cos(0.05));
}

// The name of a file may hold what turns the direction of writing.
TEST(GltfLamp, NamesAreShownAndNotObeyed) {
  const Scratch scratch("gltf_name");
  const auto file = scratch / "a\u202e\x1b.glb";
  WriteGltfLamp(file, formats::AsymmetricField(1), "x.lf.exr", SmallFit());
  EXPECT_EQ(JsonOf(file)["nodes"][0]["name"], "a\\xe2\\x80\\xae\\x1b");
}

TEST(GltfLamp, RefusesOtherUnits) {
  LightField field = formats::AsymmetricField();
  field.geometry.unit = lightfield::FluxUnit::kWatt;
  const Scratch scratch("gltf_watt");
  for (const bool usd : {false, true}) {
    try {
      if (usd)
        WriteUsdLamp(scratch / "x.usda", field, "x.lf.exr");
      else
        WriteGltfLamp(scratch / "x.glb", field, "x.lf.exr", SmallFit());
      FAIL();
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("x.lf.exr: is in W"));
    }
  }
}

TEST(UsdLamp, PassesTheCheckersAndShinesAlongZ) {
  LUXFIELD_NEEDS_FOREIGN("python");
  const Scratch scratch("usd");
  const LightField field = formats::AsymmetricField(3);
  lightfield::WriteLightField(scratch / "lamp.lf.exr", field);
  WriteUsdLamp(scratch / "lamp.usda", field, scratch / "lamp.lf.exr");
  const std::string said =
      OutputOf(fmt::format("{} -B {}/tests/foreign/check_usd.py {} 2>&1", ForeignProgram("python"),
                           LUXFIELD_SOURCE_DIR, (scratch / "lamp.usda").string()));
  if (said.find("No module named") != said.npos) {
    std::printf("SKIPPED: OpenUSD is not installed (./run foreign)\n");
    GTEST_SKIP() << said;
  }
  const core::Json layer = core::ParseJson(said, "check_usd");
  EXPECT_EQ(layer.at("problems").size(), 0u) << said;
  EXPECT_NEAR(layer.at("shines_towards")[2].get<double>(), 1, 1e-6);
  EXPECT_NEAR(layer.at("c0")[0].get<double>(), 1, 1e-6);
  EXPECT_NEAR(layer.at("c90")[1].get<double>(), -1, 1e-6);  // -v
  EXPECT_NEAR(layer.at("width").get<double>(), 0.06, 1e-6);
  EXPECT_NEAR(layer.at("height").get<double>(), 0.05, 1e-6);
  EXPECT_TRUE(layer.at("has_shaping").get<bool>());
  EXPECT_EQ(layer.at("profile"), (scratch / "lamp.usda.ies").string());
  EXPECT_EQ(layer.at("light_field"), (scratch / "lamp.lf.exr").string());
  EXPECT_EQ(layer.at("meters_per_unit"), 1);
}

// The profile of the rectangle times its projected area is the lamp's intensity.
TEST(UsdLamp, HasTheLampsIntensityFarAway) {
  const Scratch scratch("usd_far");
  const LightField field = formats::AsymmetricField();
  const UsdLamp written = WriteUsdLamp(scratch / "lamp.usda", field, scratch / "lamp.lf.exr");
  const formats::Photometry profile = formats::ReadPhotometry(scratch / "lamp.usda.ies");
  const double area = 0.06 * 0.05;
  double peak = 0;
  for (int gamma = 0; gamma < 60; gamma += 5)
    for (int c = 0; c < 360; c += 40) {
      const Vec3 d = formats::Direction(formats::PhotometryType::kC, c, gamma);
      peak = std::max(peak, lightfield::FarFieldIntensity(field, d)[0]);
    }
  for (int gamma = 0; gamma < 60; gamma += 5)
    for (int c = 0; c < 360; c += 40) {
      const Vec3 d = formats::Direction(formats::PhotometryType::kC, c, gamma);
      EXPECT_NEAR(Intensity(profile, d) * area * d.z, lightfield::FarFieldIntensity(field, d)[0],
                  3e-3 * peak);
    }
  ASSERT_EQ(written.deviations.size(), 5u);
  EXPECT_GT(written.deviations[0].largest, 0.02);
  EXPECT_LT(written.deviations[4].largest, 0.01);
}

}  // namespace
}  // namespace luxfield::bridges
