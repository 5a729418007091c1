#include "luxfield/bench/peers/peer_scenes.h"

#include <fmt/format.h>

#include "luxfield/bench/all/process.h"
#include "luxfield/bench/hill_mesh.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/input_file.h"

namespace luxfield::bench {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSky = R"(
[environment]
file = "sky.exr"
)";

constexpr const char* kRectangle = R"(
[[light]]
kind = "rectangle"
radiance = [30, 29, 27]
size = [4, 3]
position = [0, 0, 9]
look_at = [0.5, 0.2, 0]
up = [0, 1, 0]
)";

constexpr const char* kSpot = R"(IESNA:LM-63-2002
[TEST] none: a spot in closed form
TILT=NONE
1 -1 1 4 1 1 2 0 0 0
1 1 0
0 25 40 90
0
900 900 0 0
)";

constexpr const char* kSpots = R"(
[[luminaire]]
name = "spots"
model = "point"
distribution = "spot.ies"
position = [-9, -9, 7]
look_at = [-8.5, -8.8, 0]
up = [0, 1, 0]

[[luminaire.array]]
count = 10
step = [2, 0, 0]

[[luminaire.array]]
count = 10
step = [0, 2, 0]
)";

constexpr const char* kLamp = R"(
[[luminaire]]
name = "lamp"
model = "point"
distribution = "lamp.ies"
position = [-2, -3, 6]
look_at = [-1.5, -2.8, 0]
up = [0, 1, 0]
)";

void WriteSky(const fs::path& folder) {
  RunProcess({LuxfieldProgram(), "sky", "-o", folder / "sky.exr", "--latitude", "48", "--date",
              "2024-06-21", "--time", "15:00", "--height", "512"},
             folder);
}

}  // namespace

const std::vector<std::string>& PeerSceneNames() {
  static const std::vector<std::string> names{"environment mesh", "area light", "spot lights",
                                              "IES lamp"};
  return names;
}

fs::path WritePeerScene(const std::string& name, const PeerSceneOptions& options) {
  const fs::path& folder = options.folder;
  std::string light;
  if (name == "environment mesh") {
    WriteSky(folder);
    light = kSky;
  } else if (name == "area light") {
    light = kRectangle;
  } else if (name == "spot lights") {
    core::WriteFileAtomically(folder / "spot.ies", kSpot);
    light = kSpots;
  } else if (name == "IES lamp") {
    core::RequireRegularFile(options.distribution);
    core::WriteFileAtomically(folder / "lamp.ies", core::ReadFile(options.distribution));
    light = kLamp;
  } else {
    throw InputError(fmt::format("bench peers: there is no scene '{}'; --help lists them", name));
  }
  WritePly(folder / "hills.ply", HillMesh(options.triangles));
  core::WriteFileAtomically(folder / "scene.toml", HillScene("hills.ply") + light);
  return folder / "scene.toml";
}

}  // namespace luxfield::bench
