// The atlas of a lamp: its pixels, and what Blender and Mitsuba light with it (bridges/judges/).
#include "luxfield/bridges/lamp_atlas.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/json.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_vector.h"
#include "tests/bridges/foreign.h"
#include "tests/formats/light_field_lamps.h"
#include "tests/seed.h"

namespace luxfield::bridges {
namespace {

using lightfield::BasisKind;
using lightfield::PosedLightField;
using lightfield::Vec3;
using Lamp = std::vector<PosedLightField>;

struct Receiver {
  Vec3 p, n;
};

double ExactOf(const Lamp& lamp, const Receiver& receiver) {
  double sum = 0;
  for (const auto& posed : lamp) {
    const auto field_from_luminaire = posed.luminaire_from_field.Inverse();
    sum += core::Luminance(lightfield::ExactIrradiance(posed.field,
                                                       field_from_luminaire.Point(receiver.p),
                                                       field_from_luminaire.Direction(receiver.n)));
  }
  return sum;
}

// In the beam of one of the fields, 5 cm to 10 m before it, with normals up to 40 degrees off its
// axis.
std::vector<Receiver> ReceiversInBeams(const Lamp& lamp, int count, core::Random& random) {
  std::vector<Receiver> receivers;
  for (int k = 0; k < count; ++k) {
    const auto& pose = lamp[static_cast<std::size_t>(k) % lamp.size()].luminaire_from_field;
    const double z = 0.05 * std::pow(200, random.Uniform()), tilt = 0.7 * random.Uniform(),
                 around = 6.283 * random.Uniform();
    const Vec3 p{z * (0.15 + 0.2 * random.Uniform()), z * (-0.2 + 0.2 * random.Uniform()), z};
    const Vec3 n{std::sin(tilt) * std::cos(around), std::sin(tilt) * std::sin(around),
                 -std::cos(tilt)};
    receivers.push_back({pose.Point(p), pose.Direction(n)});
  }
  return receivers;
}

// Runs bridges/judges/JUDGE.py on the exported file and compares receiver by receiver: within 6
// standard errors of the program's sampling and 0.3 %, which squares of float32 leave.
void ExpectIlluminances(const std::string& judge, const std::filesystem::path& exported,
                        const Lamp& lamp, const std::string& settings) {
  core::Random random(TestSeed(3), 5, 0);
  const auto receivers = ReceiversInBeams(lamp, 60, random);
  core::Json asked;
  for (const auto& [p, n] : receivers) {
    asked["position_m"].push_back({p.x, p.y, p.z});
    asked["normal"].push_back({n.x, n.y, n.z});
  }
  const auto folder = exported.parent_path();
  core::WriteFileAtomically(folder / "receivers.json", asked.dump());
  const std::string said = OutputOf(fmt::format(
      "cd {} && {}/python -B {}/bridges/judges/{}.py {} receivers.json answer.json {} 2>&1",
      folder.string(), ForeignFolder(), LUXFIELD_SOURCE_DIR, judge, exported.filename().string(),
      settings));
  ASSERT_TRUE(std::filesystem::exists(folder / "answer.json")) << said;
  const core::Json answer = core::ParseJson(core::ReadFile(folder / "answer.json"), "answer.json");
  ASSERT_EQ(answer.at("illuminance").size(), receivers.size());
  double sum = 0, exact_sum = 0, variance = 0;
  for (std::size_t k = 0; k < receivers.size(); ++k) {
    const double exact = ExactOf(lamp, receivers[k]), found = answer.at("illuminance")[k],
                 sigma = answer.at("sigma")[k];
    EXPECT_NEAR(found, exact, 6 * sigma + 0.003 * exact)
        << k << " at " << receivers[k].p.x << " " << receivers[k].p.y << " " << receivers[k].p.z;
    // Near and far receivers count alike.
    sum += found / exact, exact_sum += 1, variance += sigma * sigma / (exact * exact);
  }
  EXPECT_NEAR(sum / exact_sum, 1, 4.5 * std::sqrt(variance) / exact_sum + 5e-4);
}

#define LUXFIELD_NEEDS_MODULE(module)                                                            \
  do {                                                                                           \
    LUXFIELD_NEEDS_FOREIGN("python");                                                            \
    const std::string import =                                                                   \
        fmt::format("{}/python -c 'import {}' 2>&1", ForeignFolder(), module);                   \
    if (std::filesystem::exists(ForeignFolder() + "/python") && OutputOf(import).empty()) break; \
    std::printf("SKIPPED: Python's %s is not installed (./run foreign)\n", module);              \
    GTEST_SKIP() << module << " is not installed";                                               \
  } while (false)

Lamp WithBasis(BasisKind kind) {
  Lamp lamp = formats::AsymmetricLamp();
  lamp[0].field.geometry.grid =
      lightfield::BasisGrid::Centred(lightfield::Basis::Make(kind, 0.7), 4, 3, 0.01);
  return lamp;
}

TEST(LampAtlas, TexelsLieSideBySide) {
  const Lamp lamp = formats::AsymmetricLamp(3);
  const auto& g = lamp[0].field.geometry;
  const Scratch scratch("atlas");
  const auto files = WriteLampAtlas(scratch / "lamp.json", lamp, "lamp.lf.exr");
  ASSERT_EQ(files.size(), 2u);
  const core::Json facts = core::ParseJson(core::ReadFile(files[0]), "lamp.json").at("fields")[0];
  const core::Image picture = core::ReadExrImage(files[1]);
  const int columns = facts.at("images").at("columns"), rows = facts.at("images").at("rows");
  ASSERT_EQ(picture.width, columns * g.grid.width);
  ASSERT_EQ(picture.height, rows * g.grid.height);
  const int column0 = static_cast<int>(
      std::lround(g.lattice.column_of_s(facts.at("images").at("s0_m").get<double>())));
  const int row0 = static_cast<int>(
      std::lround(g.lattice.row_of_t(facts.at("images").at("t1_m").get<double>())));
  for (int channel = 0; channel < 3; ++channel)
    EXPECT_EQ(
        picture.plane(
            channel)[std::size_t((5 * g.grid.height + 2) * picture.width + 7 * g.grid.width + 3)],
        lamp[0].field.image(g.grid.index(3, 2),
                            channel)[std::size_t((row0 + 5) * g.lattice.width + column0 + 7)]);
}

TEST(LampAtlas, MitsubaLightsAsTheLightField) {
  LUXFIELD_NEEDS_MODULE("mitsuba");
  const Scratch scratch("mitsuba"), sides("mitsuba_sides");
  const Lamp colour = formats::AsymmetricLamp(3), two = LampOfTwoFaces();
  WriteMitsubaLamp(scratch / "lamp.xml", colour, "lamp.lf.exr");
  ExpectIlluminances("judge_mitsuba", scratch / "lamp.xml", colour, "1024 16");
  WriteMitsubaLamp(sides / "lamp.xml", two, "lamp.lf.exr");
  ExpectIlluminances("judge_mitsuba", sides / "lamp.xml", two, "1024 16");
}

TEST(LampAtlas, BlenderLightsAsTheLightField) {
  LUXFIELD_NEEDS_MODULE("bpy");
  for (const BasisKind kind :
       {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2}) {
    SCOPED_TRACE(lightfield::Basis::Make(kind).name());
    const Scratch scratch("blender");
    const Lamp lamp = WithBasis(kind);
    WriteLampAtlas(scratch / "lamp.json", lamp, "lamp.lf.exr");
    ExpectIlluminances("judge_blender", scratch / "lamp.json", lamp, "512 12");
  }
  const Scratch scratch("blender_sides");
  WriteLampAtlas(scratch / "lamp.json", LampOfTwoFaces(), "lamp.lf.exr");
  ExpectIlluminances("judge_blender", scratch / "lamp.json", LampOfTwoFaces(), "512 12");
}

TEST(LampAtlas, RefusesWhatIsNoPicture) {
  Lamp dark = formats::AsymmetricLamp();
  for (float& c : dark[0].field.data) c = 0;
  const Scratch scratch("dark");
  try {
    WriteLampAtlas(scratch / "x.json", dark, "x.lf.exr");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("x.lf.exr: holds no light in field 0"));
  }
  EXPECT_TRUE(std::filesystem::is_empty(scratch.folder()));
}

}  // namespace
}  // namespace luxfield::bridges
