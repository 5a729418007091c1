// The scene that other renderers are compared on (bench/peers): its mean radiance is known.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "program.h"

namespace luxfield::e2e {
namespace {

using Json = nlohmann::json;

TEST(Peers, LitPlanesShowTheirClosedForms) {
  const auto folder = FreshFolder("peers");
  const std::string make = SourceFile("bench/peers/plane.py"),
                    convert = SourceFile("bench/peers/export.py");
  ASSERT_EQ(RunProgram({"python3", make, "-o", "."}, folder).exit_code, 0);
  const Json closed_form = Json::parse(ReadText(folder / "closed_form.json"));
  for (const std::string scene : {"plane_sky", "plane_light"}) {
    ASSERT_EQ(RunLuxfield({"render", scene + ".toml", "-o", "plane.exr", "--spp", "512",
                           "--antialias", "4", "--quiet"},
                          folder)
                  .exit_code,
              0);
    // Against itself, for its mean.
    ASSERT_EQ(
        RunLuxfield({"compare", "plane.exr", "plane.exr", "--json", "mean.json", "--quiet"}, folder)
            .exit_code,
        0);
    const double mean = Json::parse(ReadText(folder / "mean.json"))["mean_reference"],
                 exact = closed_form[scene];
    std::printf("%s: mean radiance %.6f of %.6f, %+.4f %%\n", scene.c_str(), mean, exact,
                100 * (mean / exact - 1));
    EXPECT_NEAR(mean / exact, 1, 5e-4);

    // Both scenes become those of the peers; what has no counterpart is refused by name.
    const Outcome exported = RunProgram({"python3", convert, scene + ".toml", "-o", scene}, folder);
    EXPECT_EQ(exported.exit_code, 0) << exported.err;
    EXPECT_NE(ReadText(folder / scene / "scene.pbrt").find("WorldBegin"), std::string::npos);
    const Json peers = Json::parse(ReadText(folder / scene / "scene.json"));
    EXPECT_EQ(peers["quads"].size(), 1u);
    EXPECT_EQ(peers["refused"], Json::object());
  }
  std::ofstream(folder / "both.toml")
      << ReadText(folder / "plane_sky.toml")
      << "[[light]]\nkind = \"rectangle\"\nradiance = [1, 1, 1]\n"
         "position = [0, 0, 1]\nsize = [1, 1]\nlook_at = [0, 0, 0]\n"
         "up = [0, 1, 0]\n";
  const Outcome both = RunProgram({"python3", convert, "both.toml", "-o", "both"}, folder);
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_NE(both.err.find("[[light]] or [environment], not both"), std::string::npos) << both.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "both"));
  const Outcome refused =
      RunProgram({"python3", convert, SourceFile("data/scenes/wall.toml"), "-o", "wall"}, folder);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("[[luminaire]] of a light field"), std::string::npos) << refused.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "wall"));
  std::filesystem::remove_all(folder);
}

// The table that Cycles gets has the flux and the peak of the file it is made of.
TEST(Peers, LampsKeepTheirLightInNarrowSteps) {
  const auto folder = FreshFolder("peers_lamp");
  std::ofstream(folder / "lamp.toml")
      << "[camera]\nposition = [0, -5, 3]\nlook_at = [0, 0, 0]\n"
         "[[luminaire]]\nmodel = \"point\"\nposition = [0, 0, 2]\nlook_at = [0, 0, 0]\n"
         "up = [0, 1, 0]\ndistribution = \""
      << SourceFile("data/scenes/tube.ies").string() << "\"\n[[luminaire.array]]\ncount = 3\n"
      << "step = [1, 0, 0]\n";
  const Outcome exported = RunProgram(
      {"python3", SourceFile("bench/peers/export.py"), "lamp.toml", "-o", "lamp"}, folder);
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  const Json peers = Json::parse(ReadText(folder / "lamp/scene.json"));
  ASSERT_EQ(peers["lamps"].size(), 3u);
  EXPECT_NE(ReadText(folder / "lamp/scene.pbrt").find("\"distribution_0.pfm\""), std::string::npos);
  EXPECT_EQ(peers["lamps"][2]["position"], Json({2, 0, 2}));
  EXPECT_NE(peers["refused"]["mitsuba"].get<std::string>().find("photometric"), std::string::npos);
  Json lamps[2];
  const std::string files[] = {SourceFile("data/scenes/tube.ies"), "lamp/distribution_0.ies"};
  for (int k = 0; k < 2; ++k) {
    ASSERT_EQ(RunLuxfield({"info", files[k], "--json", "info.json"}, folder).exit_code, 0);
    lamps[k] = Json::parse(ReadText(folder / "info.json"));
  }
  EXPECT_NEAR(lamps[1]["flux_lm"].get<double>() / lamps[0]["flux_lm"].get<double>(), 1, 1e-6);
  EXPECT_EQ(lamps[1]["peak"], lamps[0]["peak"]);
  std::filesystem::remove_all(folder);
}

// The square of equal areas that pbrt gets: all light of a picture's pixels, from where it came.
TEST(Peers, EqualAreasKeepTheLightOfASky) {
  const auto folder = FreshFolder("peers_square");
  const std::string script = R"(
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np, equal_area
n, size = 32, 256
row, column = np.arange(n)[:, None] + np.zeros((n, 2 * n)), np.arange(2 * n)[None] + np.zeros((n, 2 * n))
edge = lambda k: np.cos(np.pi * k / n)
solid = (edge(row) - edge(row + 1)) * np.pi / n
picture = np.stack([np.ones((n, 2 * n)), np.where((row == 5) & (column == 9), 100., 0.), 1 + np.cos(np.pi * (row + .5) / n)], -1)
square = equal_area.of_latlong(picture, size).astype(float)
assert np.allclose(square.mean(axis=(0, 1)) * 4 * np.pi, (picture * solid[..., None]).sum(axis=(0, 1)), rtol=1e-5)
middle = equal_area.directions(*(p.reshape(size, size) for p in equal_area._points(size, (0, size), 1)))
assert np.allclose(np.linalg.norm(middle, axis=-1), 1)
# The bright pixel shines from where it is: its centroid, which bends inwards by a pixel's squared width.
polar, azimuth = np.pi * 5.5 / n, 2 * np.pi * 9.5 / (2 * n)
towards = np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
centroid = (square[..., 1:2] * middle).sum(axis=(0, 1)) / square[..., 1].sum()
assert np.allclose(centroid, towards, atol=(np.pi / n) ** 2 / 4), (centroid, towards)
# Nothing is lost of pixels about the poles that no point of a coarse square falls into.
poles = np.where((row == 0) | (row == n - 1), column + 1., 0.)[..., None] * [1., 0., 2.]
coarse = equal_area.of_latlong(poles, 32).astype(float)
assert np.allclose(coarse.mean(axis=(0, 1)) * 4 * np.pi, (poles * solid[..., None]).sum(axis=(0, 1)), rtol=1e-5)
assert (coarse[3:13, 3:13] == 0).all() and coarse[15:17, 15:17, 0].min() > 0
equal_area.write_pfm(sys.argv[2], square.astype(np.float32))
assert (equal_area.read_pfm(sys.argv[2]) == square.astype(np.float32)).all()
)";
  const Outcome outcome = RunProgram(
      {"/usr/bin/python3", "-c", script, SourceFile("bench/peers").string(), "square.pfm"}, folder);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::e2e
