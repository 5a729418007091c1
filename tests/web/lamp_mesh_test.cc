// A mesh in the room of the page (docs/web.md): a cube and a ball in the places of the room's own box
// and sphere are read and drawn as these, in headless Chromium.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/web/lamp_page.h"
#include "tests/web/browser.h"
#include "tests/web/lamp.h"

namespace luxfield::web {
namespace {

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  if (at == text.npos) throw std::logic_error("the page does not hold " + from);
  return text.replace(at, from.size(), to);
}

// What tests/web/ask_mesh.js finds of a page.
core::Json AskMesh(const std::string& page, bool only_mesh, const std::filesystem::path& path) {
  const std::string asks =
      core::ReadFile(std::filesystem::path(LUXFIELD_SOURCE_DIR) / "tests/web/ask_mesh.js");
  std::string said =
      SaidByPage(page, fmt::format("const ONLY_MESH = {};\n{}", only_mesh, asks), path);
  if (said.substr(0, 1) != "{") throw std::runtime_error(said);
  return core::ParseJson(said, "chromium");
}

// How many pixels of two pictures differ by more than 8 of 255 in any channel.
int DifferentPixels(const core::Json& a, const core::Json& b) {
  const auto x = a.get<std::vector<int>>(), y = b.get<std::vector<int>>();
  int count = 0;
  for (std::size_t k = 0; k + 2 < std::min(x.size(), y.size()); k += 3) {
    int most = 0;
    for (std::size_t c = k; c < k + 3; ++c) most = std::max(most, std::abs(x[c] - y[c]));
    count += most > 8;
  }
  return count;
}

TEST(LampMesh, IsReadAndDrawnAsTheBoxAndTheSphereInItsPlace) {
  LUXFIELD_NEEDS_PROGRAM("chromium");
  const auto folder =
      std::filesystem::path(testing::TempDir()) / fmt::format("web_mesh_{}", ::getpid());
  std::filesystem::create_directories(folder);
  FitOptions options;
  options.max_bytes = 20000;
  options.max_error = 0.05;
  options.receivers = 100;
  WriteLampPage(folder / "lamp.html", SmallLamp(), {"lamp", "lamp.lf.exr", ""}, options);
  const std::string page = core::ReadFile(folder / "lamp.html");

  const core::Json all =
      AskMesh(Replaced(Replaced(page, "const BOX = {", "const BOX = window.testBox = {"),
                       "const SPHERE = {", "const SPHERE = window.testSphere = {"),
              false, folder / "both.html");
  const core::Json only = AskMesh(Replaced(page, "const BOX = { centre: [0.6, 0.25, -1.5]",
                                           "const BOX = { centre: [0.6, -50, -1.5]"),
                                  true, folder / "mesh.html");
  EXPECT_EQ(all["errors"].get<int>(), 0);
  EXPECT_EQ(only["errors"].get<int>(), 0);

  // The cube is the box but for rounding. The planes of the ball lie up to 0.3 m (1 - cos 1.9 deg)
  // within the sphere; facets in the place of its normals would be 3 % off.
  for (const auto& [name, worst] : {std::pair{"box", 1e-9}, std::pair{"sphere", 0.01}}) {
    const core::Json& compared = all[name]["compared"];
    std::printf("%s: %s\n", name, compared.dump().c_str());
    EXPECT_EQ(all[name]["scale"].get<double>(), 1) << name;
    EXPECT_GT(compared["lit_on_it"].get<int>(), 15) << name;
    EXPECT_GT(compared["shadowed"].get<int>(), 15) << name;
    EXPECT_LE(compared["worst"].get<double>(), worst) << name;
    EXPECT_LE(compared["off"].get<int>(), 6) << name;  // of 576, at edges of shadows
    EXPECT_LE(compared["other_surface"].get<int>(), 6) << name;
  }

  // Of 19200 pixels, those at edges of shadows alone: texels of the maps are not rays.
  const int as_box = DifferentPixels(all["pixels"], only["pixels"]),
            as_none = DifferentPixels(all["pixels"], only["without"]);
  std::printf("%d pixels of 19200 differ from the box, %d without the cube\n", as_box, as_none);
  EXPECT_EQ(only["pixels"].size(), 3 * 19200u);
  EXPECT_LE(as_box, 100);
  EXPECT_GT(as_none, 500);
  EXPECT_TRUE(only["again"].get<bool>());

  const std::vector<std::string> reasons = {
      "no faces",        "no faces",      "more than 50000", "line 1 holds no",  "line 1 holds no",
      "vertex 2 of 1",   "vertex 0",      "fewer than 3",    "longest side is",  "an area",
      "line 2 holds no", "normal 1 of 0", "longest side is", "larger than 20 MB"};
  ASSERT_EQ(all["refused"].size(), reasons.size());
  for (std::size_t k = 0; k < reasons.size(); ++k)
    EXPECT_NE(all["refused"][k].get<std::string>().find(reasons[k]), std::string::npos)
        << k << ": " << all["refused"][k];

  const auto size = [&](const char* name) { return all[name].get<std::vector<double>>(); };
  EXPECT_NEAR(size("flat")[0], 1.5, 1e-9);
  EXPECT_NEAR(size("tiny")[1], 0.6, 1e-9);
  EXPECT_NEAR(size("upright")[1], 1, 1e-9);
  EXPECT_EQ(all["most"].get<int>(), 50000);
  for (const core::Json& tones : all["tones"]) EXPECT_GT(tones.get<int>(), 2);
}

}  // namespace
}  // namespace luxfield::web
