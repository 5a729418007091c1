#include "luxfield/environment/kept_cube_map.h"

#include <fmt/format.h>

#include "luxfield/core/file.h"
#include "luxfield/core/kept.h"
#include "luxfield/environment/environment_map.h"

namespace luxfield::environment {

CubeMap KeptCubeMap(const std::filesystem::path& path, std::optional<EnvironmentLayout> named,
                    int face_size) {
  const auto make = [&] { return MakeCubeMap(ReadEnvironmentPicture(path, named), face_size); };
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown)) return make();  // which says what it is
  const auto key = core::KeyOfThisBuild(
      "cube-map", fmt::format("{}\n{}\n{}", core::Sha256OfFile(path),
                              named ? static_cast<int>(*named) : -1, face_size));
  return core::Kept(
      key, [](auto& pass, auto& map) { pass(map.face_size, map.data); }, CubeMap(), make);
}

}  // namespace luxfield::environment
