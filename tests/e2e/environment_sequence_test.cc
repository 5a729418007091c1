// A day of sky as one moving light: a picture of each frame.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "program.h"

namespace luxfield::e2e {
namespace {

using Json = nlohmann::json;

// A grey plane under a sky.
std::string Plane(const std::string& camera, const std::string& sky) {
  return "[camera]\nposition = " + camera + R"(
look_at = [0, 0, 0]
width = 32
height = 24
[[material]]
name = "grey"
albedo = [0.5, 0.5, 0.5]
[[quad]]
corner = [-9, -9, 0]
edge_u = [18, 0, 0]
edge_v = [0, 18, 0]
material = "grey"
[environment]
file = ")" +
         sky + "\"\n";
}

// plane.toml, whose sky has three frames.
void WritePlaneUnderADay(const std::filesystem::path& folder) {
  const Outcome sky =
      RunLuxfield({"sky", "-o", "sky", "--latitude", "48", "--longitude", "12", "--date",
                   "2024-06-21", "--day", "--frames", "3", "--height", "32", "--quiet"},
                  folder);
  ASSERT_EQ(sky.exit_code, 0) << sky.err;
  WriteText(folder / "plane.toml", Plane("[0, -4, 2]", "sky"));
}

TEST(EnvironmentSequence, RenderMakesAPictureOfEachFrame) {
  const auto folder = FreshFolder("day");
  ASSERT_NO_FATAL_FAILURE(WritePlaneUnderADay(folder));
  std::vector<std::string> arguments = {"render",  "plane.toml", "-o", "day.exr", "--png",
                                        "day.png", "--spp",      "32", "--quiet"};
  arguments.insert(arguments.end(), {"--json", "day.json"});
  const Outcome outcome = RunLuxfield(arguments, folder);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json json = Json::parse(ReadText(folder / "day.json"));
  EXPECT_EQ(json["frames"].size(), 3u);
  EXPECT_GT(json["fps"].get<double>(), 0);
  EXPECT_FALSE(std::filesystem::exists(folder / "day.exr"));
  std::vector<double> means;
  for (int frame = 0; frame < 3; ++frame) {
    const std::string name = "day_000" + std::to_string(frame);
    EXPECT_TRUE(std::filesystem::exists(folder / (name + ".png")));
    const std::string picture = name + ".exr";
    ASSERT_EQ(RunLuxfield({"compare", picture, picture, "--json", "mean.json"}, folder).exit_code,
              0);
    means.push_back(Json::parse(ReadText(folder / "mean.json"))["mean_reference"]);
  }
  // Noon is the brightest of morning, noon and evening.
  EXPECT_GT(means[1], 1.2 * means[0]);
  EXPECT_GT(means[1], 1.2 * means[2]);

  // What is for one picture is refused by name.
  for (const char* option : {"--error", "--time", "--reference"}) {
    std::vector<std::string> one = {"render", "plane.toml", "-o", "x.exr", option, "1%", "--quiet"};
    if (std::string(option) == "--time") one[5] = "1s";
    const Outcome refused = RunLuxfield(one, folder);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find(option), std::string::npos) << refused.err;
    EXPECT_NE(refused.err.find("sequence"), std::string::npos) << refused.err;
  }
  std::filesystem::remove_all(folder);
}

// With a path each frame is what `render` makes of a scene whose camera stands there.
TEST(EnvironmentSequence, RenderTakesTheCameraAlongAPath) {
  const auto folder = FreshFolder("flight");
  ASSERT_NO_FATAL_FAILURE(WritePlaneUnderADay(folder));
  const std::string path = R"(frames_per_s = 2
[[camera]]
t_s = 0
position = [0, -4, 2]
look_at = [0, 0, 0]
[[camera]]
t_s = 1
position = [2, -4, 3]
look_at = [0, 0, 0]
)";
  WriteText(folder / "path.toml", path);
  const auto render = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "render");
    words.insert(words.end(), {"--spp", "16", "--quiet"});
    return RunLuxfield(words, folder);
  };
  const Outcome outcome = render({"plane.toml", "--sequence", "path.toml", "-o", "flight.exr",
                                  "--seed", "7", "--json", "flight.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(Json::parse(ReadText(folder / "flight.json"))["frames"].size(), 3u);

  std::vector<std::filesystem::path> maps;
  for (const auto& map : std::filesystem::directory_iterator(folder / "sky"))
    maps.push_back(map.path());
  std::sort(maps.begin(), maps.end());
  const char* cameras[3] = {"[0, -4, 2]", "[1, -4, 2.5]", "[2, -4, 3]"};
  for (int frame = 0; frame < 3; ++frame) {
    WriteText(folder / "one.toml", Plane(cameras[frame], "sky/" + maps[frame].filename().string()));
    ASSERT_EQ(render({"one.toml", "-o", "one.exr", "--seed", std::to_string(7 + frame)}).exit_code,
              0);
    ASSERT_EQ(RunLuxfield({"compare", "flight_000" + std::to_string(frame) + ".exr", "one.exr",
                           "--json", "same.json"},
                          folder)
                  .exit_code,
              0);
    EXPECT_EQ(Json::parse(ReadText(folder / "same.json"))["rel_rmse"], 0) << frame;
  }

  WriteText(folder / "long.toml", "duration_s = 2\n" + path);
  const Outcome refused = render({"plane.toml", "--sequence", "long.toml", "-o", "x.exr"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("long.toml: has 5 frames and the scene's environment 3"),
            std::string::npos)
      << refused.err;
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::e2e
