// A test that runs `luxfield photometry` on lamps of its own.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "tests/e2e/html_check.h"
#include "tests/e2e/verb_test.h"

namespace luxfield::e2e {

inline constexpr const char* kAskedOfALamp = R"([[point]]
name = "desk & <chair>"
position_m = [0.1, 0, 2]
facing = [-1, 0, 0]
[[eye]]
eye_m = [0.3, 0, 1.5]
background_cd_per_m2 = 40
road_luminance_cd_per_m2 = 1
line_of_sight = [-1, 0, -1]
[[plane]]
name = "wall"
centre_m = [0, 0.2, 3]
width_m = 2
height_m = 1
columns = 9
rows = 5
)";

// A hill of light about the axis.
inline lightfield::LuminaireGeometry LampGeometry() {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                                          5, 4, 0.02);
  g.lattice = {16, 15, -0.3, 0.28, 0.0375, 0.0375};
  g.unit = lightfield::FluxUnit::kLumen;
  return g;
}

inline lightfield::LightField HillLamp(double factor,
                                       lightfield::FluxUnit unit = lightfield::FluxUnit::kLumen) {
  lightfield::LightField field(LampGeometry());
  field.geometry.unit = unit;
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    for (int row = 0; row < field.geometry.lattice.height; ++row)
      for (int column = 0; column < field.geometry.lattice.width; ++column) {
        const auto s = field.geometry.lattice.centre(row, column);
        field.image(m, 0)[std::size_t(row) * field.geometry.lattice.width + column] =
            static_cast<float>(factor * std::exp(-50 * (s.x * s.x + s.y * s.y)));
      }
  return field;
}

class PhotometryVerb : public VerbTest {
 protected:
  nlohmann::json Ask(const lightfield::LightField& field,
                     const std::vector<std::string>& options = {}) {
    lightfield::WriteLightField(folder_ / "x.lf.exr", field);
    std::vector<std::string> arguments{"photometry", "x.lf.exr"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return Run(arguments);
  }
  std::string Page(const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments{"photometry", "x.lf.exr", "-o", "x.html"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    Run(arguments);
    std::string page = ReadText(folder_ / "x.html");
    ExpectSelfContainedPage(page);
    return page;
  }
};

}  // namespace luxfield::e2e
