// The readers of LUXFIELD_light_field in C++, Python, JavaScript and GLSL by the same vectors
// (web/vectors/), which plain Python made of the pages' formulas. Those of other languages are skipped,
// loudly, where their program is missing.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "luxfield/bridges/gltf_lamp.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/web/lamp_page.h"
#include "luxfield/web/lamp_volume.h"
#include "tests/bridges/foreign.h"
#include "tests/web/lamp.h"

namespace luxfield::bridges {
namespace {

using lightfield::Vec3;

const std::filesystem::path kFolder = LUXFIELD_SOURCE_DIR "/web/vectors";

struct Vectors {
  web::FittedVolume fitted = ReadGltfLamp(kFolder / "lamp.glb");
  core::Json json = core::ParseJson(core::ReadFile(kFolder / "vectors.json"),
                                    (kFolder / "vectors.json").string());

  // Coefficients are float32 and of any sign: their largest is the unit, scaled as J is.
  double UnitAt(double z) const {
    double largest = 0;
    for (const auto& table : fitted.volume.tables)
      for (const float c : table.coefficients) largest = std::max(largest, double(std::abs(c)));
    const double tau = fitted.volume.delta_m / z;
    return largest * (z >= fitted.volume.delta_m ? tau * tau : 1);
  }
};

const Vectors& TheVectors() {
  static const Vectors vectors;
  return vectors;
}

Vec3 VectorOf(const core::Json& numbers) { return {numbers.at(0), numbers.at(1), numbers.at(2)}; }

TEST(LightFieldVectors, InCxx) {
  const auto& [fitted, json] = TheVectors();
  ASSERT_EQ(fitted.volume.tables.size(), json.at("codes").size());
  for (std::size_t k = 0; k < fitted.volume.tables.size(); ++k) {
    const auto& codes = fitted.volume.tables[k].codes;
    const core::Json& expected = json.at("codes")[k];
    ASSERT_EQ(codes.size(), expected.at("count").get<std::size_t>());
    const std::vector<std::int16_t> first = expected.at("first"), last = expected.at("last");
    EXPECT_TRUE(std::equal(first.begin(), first.end(), codes.begin()));
    EXPECT_TRUE(std::equal(last.rbegin(), last.rend(), codes.rbegin()));
  }
  for (const core::Json& receiver : json.at("receivers")) {
    const Vec3 p = VectorOf(receiver.at("p")), n = VectorOf(receiver.at("n"));
    const double unit = TheVectors().UnitAt(p.z);
    const lightfield::LightVector j = web::LightVectorAt(fitted.volume, p);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const core::Json& expected = receiver.at("light_vector");
      EXPECT_NEAR(j.j[channel].x, expected[3 * channel].get<double>(), 1e-6 * unit);
      EXPECT_NEAR(j.j[channel].y, expected[3 * channel + 1].get<double>(), 1e-6 * unit);
      EXPECT_NEAR(j.j[channel].z, expected[3 * channel + 2].get<double>(), 1e-6 * unit);
    }
    EXPECT_NEAR(web::IlluminanceAt(fitted.volume, p, n), receiver.at("illuminance").get<double>(),
                1e-6 * unit);
  }
}

TEST(LightFieldVectors, InPython) {
  LUXFIELD_NEEDS_FOREIGN("python");
  const Scratch scratch("vectors");
  core::Json asked;
  for (const core::Json& receiver : TheVectors().json.at("receivers")) {
    asked["position_m"].push_back(receiver.at("p"));
    asked["normal"].push_back(receiver.at("n"));
  }
  core::WriteFileAtomically(scratch / "receivers.json", asked.dump());
  const std::string said = OutputOf(fmt::format(
      "cd {} && {} -B {}/bridges/judges/judge_gltf.py {}/lamp.glb receivers.json answer.json 2>&1",
      scratch.folder().string(), ForeignProgram("python"), LUXFIELD_SOURCE_DIR, kFolder.string()));
  ASSERT_TRUE(std::filesystem::exists(scratch / "answer.json")) << said;
  const core::Json found =
      core::ParseJson(core::ReadFile(scratch / "answer.json"), "answer").at("illuminance");
  for (std::size_t k = 0; k < found.size(); ++k) {
    const core::Json& receiver = TheVectors().json.at("receivers")[k];
    EXPECT_NEAR(found[k].get<double>(), receiver.at("illuminance").get<double>(),
                1e-9 * TheVectors().UnitAt(receiver.at("p")[2]));
  }
}

// The tests of the library, web/test/, with three.js where ./run foreign has put it.
TEST(LightFieldVectors, InJavaScript) {
  LUXFIELD_NEEDS_FOREIGN("node");
  const std::string three = ForeignFolder() + "/../node_modules/three";
  if (!std::filesystem::exists(three))
    std::printf("SKIPPED: three is not installed (./run foreign): its light is not tried\n");
  const std::string said = OutputOf(
      fmt::format("cd {}/web && {} node --test test/ 2>&1; echo status $?", LUXFIELD_SOURCE_DIR,
                  std::filesystem::exists(three)
                      ? "LUXFIELD_THREE=" + std::filesystem::canonical(three).string()
                      : std::string()));
  EXPECT_THAT(said, testing::HasSubstr("status 0"));
  EXPECT_THAT(said, testing::HasSubstr("# fail 0"));
}

// The shader of the page and of LuxfieldLight. Half floats have 11 bits, and a texture's filter may know
// 256 places between two texels, which differ by up to twice the largest here.
TEST(LightFieldVectors, InGlsl) {
  LUXFIELD_NEEDS_FOREIGN("chromium");
  web::FittedVolume fitted = TheVectors().fitted;
  for (const auto& table : fitted.volume.tables) fitted.packed.push_back(web::PackCodes(table, 3));
  std::string page = web::LampPage(web::SmallLamp(3), fitted, {"vectors", "lamp.glb", ""});
  core::Json asked = core::Json::array();
  std::vector<const core::Json*> receivers;
  for (const core::Json& receiver : TheVectors().json.at("receivers")) {
    if (web::HorizonOf(fitted.volume, VectorOf(receiver.at("p")), VectorOf(receiver.at("n"))) ==
        web::Horizon::kCut)
      continue;  // an estimate
    receivers.push_back(&receiver);
    asked.push_back({receiver.at("p"), receiver.at("n")});
  }
  page.insert(page.rfind("</body>"),
              fmt::format("<pre id=\"result\"></pre><script>window.luxfield.ready.then(() => {{\n"
                          "document.getElementById('result').textContent = "
                          "JSON.stringify(window.luxfield.shaderIlluminances({}));\n}});</script>",
                          asked.dump()));
  const Scratch scratch("glsl");
  core::WriteFileAtomically(scratch / "page.html", page);
  const std::string document = OutputOf(fmt::format(
      "timeout 240 chromium --headless --no-sandbox --use-angle=swiftshader "
      "--enable-unsafe-swiftshader --virtual-time-budget=20000 --user-data-dir={}/profile "
      "--dump-dom file://{}/page.html 2>{}/log",
      scratch.folder().string(), scratch.folder().string(), scratch.folder().string()));
  const auto begin = document.find("<pre id=\"result\">[");
  ASSERT_NE(begin, document.npos) << core::ReadFile(scratch / "log");
  const std::string rest = document.substr(begin + 17);
  const core::Json found = core::ParseJson(rest.substr(0, rest.find("</pre>")), "chromium");
  ASSERT_EQ(found.size(), receivers.size());
  int lit = 0;
  for (std::size_t k = 0; k < receivers.size(); ++k) {
    const double expected = receivers[k]->at("illuminance");
    EXPECT_NEAR(found[k].get<double>(), expected,
                0.005 * TheVectors().UnitAt(receivers[k]->at("p")[2]))
        << k;
    lit += expected != 0;
  }
  EXPECT_GT(lit, 15);
}

}  // namespace
}  // namespace luxfield::bridges
