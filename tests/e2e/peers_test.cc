// The scene that other renderers are compared on (study/peers): its mean radiance is known.
#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "program.h"

namespace luxfield::e2e {
namespace {

using Json = nlohmann::json;

TEST(Peers, APlaneUnderASkyShowsItsClosedForm) {
  const auto folder = FreshFolder("peers");
  const std::string make = SourceFile("study/peers/plane.py"),
                    convert = SourceFile("study/peers/export.py");
  ASSERT_EQ(RunProgram({"python3", make, "-o", "."}, folder).exit_code, 0);
  const Json closed_form = Json::parse(ReadText(folder / "closed_form.json"));
  ASSERT_EQ(
      RunLuxfield({"render", "plane_sky.toml", "-o", "sky.exr", "--spp", "512", "--quiet"}, folder)
          .exit_code,
      0);
  // Against itself, for its mean.
  ASSERT_EQ(RunLuxfield({"compare", "sky.exr", "sky.exr", "--json", "mean.json", "--quiet"}, folder)
                .exit_code,
            0);
  const double mean = Json::parse(ReadText(folder / "mean.json"))["mean_reference"],
               exact = closed_form["plane_sky"];
  std::printf("mean radiance %.6f of %.6f, %+.4f %%\n", mean, exact, 100 * (mean / exact - 1));
  EXPECT_NEAR(mean / exact, 1, 5e-4);

  // Both scenes become those of the peers; what has no counterpart is refused by name.
  for (const std::string scene : {"plane_sky", "plane_light"}) {
    const Outcome exported = RunProgram({"python3", convert, scene + ".toml", "-o", scene}, folder);
    EXPECT_EQ(exported.exit_code, 0) << exported.err;
    EXPECT_NE(ReadText(folder / scene / "scene.pbrt").find("WorldBegin"), std::string::npos);
    EXPECT_NE(ReadText(folder / scene / "scene_cycles.py").find("bpy.ops.render"),
              std::string::npos);
  }
  const Outcome refused =
      RunProgram({"python3", convert, SourceFile("data/scenes/wall.toml"), "-o", "wall"}, folder);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("luminaire"), std::string::npos) << refused.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "wall"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::e2e
