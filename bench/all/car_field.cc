#include "luxfield/bench/all/car_field.h"

#include "luxfield/core/file.h"
#include "luxfield/render/accuracy/car2.h"

namespace luxfield::bench {

std::filesystem::path WriteCarField(const std::filesystem::path& folder, int columns, int rows,
                                    int texels) {
  const std::filesystem::path scene = folder / "car.toml";
  lightfield::WriteLightField(folder / "car.lf.exr",
                              render::SyntheticCar2({columns, rows, texels, 1}));
  core::WriteFileAtomically(scene, R"([camera]
position = [1, -2, 2.5]
look_at = [0, 5, 0]

[[material]]
name = "road"
albedo = [0.3, 0.3, 0.3]

[[quad]]
corner = [-10, -5, 0]
edge_u = [20, 0, 0]
edge_v = [0, 30, 0]
material = "road"

[[luminaire]]
file = "car.lf.exr"
position = [0, 0, 0.7]
look_at = [0, 10, 0.6]
)");
  return scene;
}

}  // namespace luxfield::bench
