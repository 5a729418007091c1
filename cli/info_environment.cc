#include "cli/info_environment.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "core/error.h"
#include "lightfield/environment_map.h"

namespace luxfield::cli {
namespace {

std::string Colour(const core::Rgb& rgb) {
  return fmt::format("{:.6g} {:.6g} {:.6g}, luminance {:.6g}", rgb[0], rgb[1], rgb[2],
                     core::Luminance(rgb));
}

std::optional<lightfield::EnvironmentLayout> Layout(const std::string& name) {
  if (name.empty()) return {};
  const auto layout = lightfield::EnvironmentLayoutFromName(name);
  if (!layout)
    throw InputError(fmt::format("--layout {}: no such layout; choose one of {}", name,
                                 lightfield::EnvironmentLayoutNames()));
  return layout;
}

}  // namespace

core::Json InfoEnvironment(const std::string& path, const std::string& layout) {
  const auto picture = lightfield::ReadEnvironmentPicture(path, Layout(layout));
  const auto cube = lightfield::MakeCubeMap(picture);
  const auto brightest = lightfield::FindBrightestPixel(picture);
  const core::Rgb mean = lightfield::MeanRadiance(cube);
  const core::Rgb up = lightfield::Irradiance(cube, {0, 0, 1});
  const core::Rgb down = lightfield::Irradiance(cube, {0, 0, -1});
  const auto name = lightfield::EnvironmentLayoutName(picture.layout);
  const bool nodes = picture.registration == lightfield::TexelRegistration::kNodes;
  const lightfield::Vec3 w = brightest.direction;
  const double elevation_deg = 180 / std::numbers::pi * std::asin(w.z);
  fmt::print("{}: environment map, {}{}\n", path, name,
             nodes ? " (envmap attribute: pixel centres on the borders)" : "");
  fmt::print("  picture      {} x {}; as a cube map 6 faces of {} x {}\n", picture.image.width,
             picture.image.height, cube.face_size, cube.face_size);
  fmt::print("  radiance     mean R G B {}\n", Colour(mean));
  fmt::print("  irradiance   facing up (+z) {}; facing down {}\n", Colour(up), Colour(down));
  fmt::print(
      "  brightest    {}, row {}, column {}, towards ({:.4f}, {:.4f}, {:.4f}), {:.2f} degrees "
      "above the horizon, {:.4g} sr\n",
      Colour(brightest.radiance), brightest.row, brightest.column, w.x, w.y, w.z, elevation_deg,
      brightest.solid_angle_sr);
  return {{"kind", "environment map"},
          {"layout", name},
          {"width", picture.image.width},
          {"height", picture.image.height},
          {"face_size", cube.face_size},
          {"mean_radiance", mean},
          {"irradiance_up", up},
          {"irradiance_down", down},
          {"brightest",
           {{"radiance", brightest.radiance},
            {"row", brightest.row},
            {"column", brightest.column},
            {"direction", {w.x, w.y, w.z}},
            {"elevation_deg", elevation_deg},
            {"solid_angle_sr", brightest.solid_angle_sr}}}};
}

}  // namespace luxfield::cli
