#include "luxfield/cli/info_environment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <optional>

#include "luxfield/cli/program.h"
#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/radiance_hdr.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/environment/environment_sequence.h"
#include "luxfield/environment/layout_of_shape.h"

namespace luxfield::cli {
namespace {

std::string Colour(const core::Rgb& rgb) {
  return fmt::format("{:.6g} {:.6g} {:.6g}, luminance {:.6g}", rgb[0], rgb[1], rgb[2],
                     core::Luminance(rgb));
}

std::optional<environment::EnvironmentLayout> Layout(const std::string& name) {
  if (name.empty()) return {};
  const auto layout = environment::EnvironmentLayoutFromName(name);
  if (!layout)
    throw InputError(fmt::format("--layout {}: no such layout; choose one of {}", name,
                                 environment::EnvironmentLayoutNames()));
  return layout;
}

bool IsRadiancePicture(const std::string& path) {
  std::string name = path;
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name.ends_with(".hdr") || name.ends_with(".rgbe") || name.ends_with(".pic");
}

// A Radiance picture may mean Rec. 709's R, G, B or Radiance's own, and not say which: prints what
// its luminances are if they are Radiance's, and returns them.
core::Json ByRadianceWeights(const std::string& path, const core::Rgb& mean, const core::Rgb& up,
                             const core::Rgb& down) {
  if (!IsRadiancePicture(path)) return nullptr;
  const auto primaries = core::ReadHdrPrimaries(path);
  if (primaries != core::HdrPrimaries::kUnstated && primaries != core::HdrPrimaries::kAsRadiance)
    return nullptr;
  const double of[3] = {core::RadianceLuminance(mean), core::RadianceLuminance(up),
                        core::RadianceLuminance(down)};
  fmt::print(
      "  as Radiance  {}; by Radiance's own weights 0.265 0.670 0.065 luminance is {:.6g} "
      "in the mean, {:.6g} facing up, {:.6g} facing down\n",
      primaries == core::HdrPrimaries::kUnstated ? "the file states no PRIMARIES"
                                                 : "the file states Radiance's PRIMARIES",
      of[0], of[1], of[2]);
  return {{"mean_radiance", of[0]}, {"irradiance_up", of[1]}, {"irradiance_down", of[2]}};
}

// A Radiance picture that is no environment map, as of a lamp.
core::Json InfoRadiancePicture(const std::string& path, const core::Image& image) {
  constexpr double kLumensPerWatt = 179;  // Radiance's, of white light
  double most = 0, sum = 0;
  for (std::size_t k = 0; k < image.plane_size(); ++k) {
    const double luminance =
        core::Luminance({image.plane(0)[k], image.plane(1)[k], image.plane(2)[k]});
    most = std::max(most, luminance);
    sum += luminance;
  }
  const double mean = sum / double(image.plane_size());
  fmt::print("{}: Radiance picture, {} x {}\n", path, image.width, image.height);
  fmt::print(
      "  luminance    {:.6g} in the mean, {:.6g} at most; times 179: {:.6g} and {:.6g} "
      "cd/m^2 where values are W sr^-1 m^-2\n",
      mean, most, kLumensPerWatt * mean, kLumensPerWatt * most);
  fmt::print("  layout       its shape is that of no environment map; --layout reads it as one\n");
  return {{"kind", "picture"},
          {"width", image.width},
          {"height", image.height},
          {"mean_luminance", mean},
          {"largest_luminance", most}};
}

}  // namespace

core::Json InfoEnvironment(const std::string& path, const std::string& layout) {
  if (layout.empty() && IsRadiancePicture(path)) {
    const core::Image image = core::ReadRadianceHdr(path);
    if (!environment::LayoutOfShape(image.width, image.height))
      return InfoRadiancePicture(path, image);
  }
  const auto picture = environment::ReadEnvironmentPicture(path, Layout(layout));
  const auto cube = environment::MakeCubeMap(picture);
  const auto brightest = environment::FindBrightestPixel(picture);
  const core::Rgb mean = environment::MeanRadiance(cube);
  const core::Rgb up = environment::Irradiance(cube, {0, 0, 1});
  const core::Rgb down = environment::Irradiance(cube, {0, 0, -1});
  const auto name = environment::EnvironmentLayoutName(picture.layout);
  const bool nodes = picture.registration == environment::TexelRegistration::kNodes;
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
  const core::Rgb& weights = core::kLuminanceWeights;
  fmt::print("  luminance    {} R + {} G + {} B (Rec. 709)\n", weights[0], weights[1], weights[2]);
  const core::Json by_radiance = ByRadianceWeights(path, mean, up, down);
  return {{"kind", "environment map"},
          {"luminance_weights", weights},
          {"luminance_by_radiance_weights", by_radiance},
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

core::Json InfoEnvironmentSequence(const std::string& path, const std::string& layout) {
  environment::EnvironmentSequence sequence(path, {Layout(layout)});
  const std::size_t count = sequence.frames().size();
  std::vector<double> up;
  core::Rgb mean{};
  double streaming_s = 0;
  {
    core::Progress progress("frames", count);
    environment::CubeMap cube;
    core::Stopwatch watch;
    while (sequence.Next(cube)) {
      streaming_s += watch.WallSeconds();
      core::ThrowIfInterrupted();
      const core::Rgb radiance = environment::MeanRadiance(cube);
      for (std::size_t k = 0; k < 3; ++k) mean[k] += radiance[k] / double(count);
      up.push_back(core::Luminance(environment::Irradiance(cube, {0, 0, 1})));
      progress.Advance();
      watch = core::Stopwatch();
    }
  }
  const auto [least, most] = std::minmax_element(up.begin(), up.end());
  const int size = sequence.face_size();
  const double cube_bytes = 72.0 * size * size;
  fmt::print("{}: environment sequence, {} frames, {} to {}\n", path, count,
             sequence.frames().front().filename().string(),
             sequence.frames().back().filename().string());
  fmt::print("  frames       {} x {}, {}; as cube maps 6 faces of {} x {}, {} each\n",
             sequence.width(), sequence.height(), EnvironmentLayoutName(sequence.layout()), size,
             size, FormatBytes(cube_bytes));
  fmt::print("  radiance     mean R G B {}\n", Colour(mean));
  fmt::print("  irradiance   facing up (+z) luminance {:.6g} (frame {}) to {:.6g} (frame {})\n",
             *least, least - up.begin(), *most, most - up.begin());
  fmt::print("  streaming    {:.1f} ms a frame waited for\n", 1e3 * streaming_s / double(count));
  return {{"kind", "environment sequence"},
          {"frames", count},
          {"layout", EnvironmentLayoutName(sequence.layout())},
          {"width", sequence.width()},
          {"height", sequence.height()},
          {"face_size", size},
          {"mean_radiance", mean},
          {"irradiance_up", up},
          {"streaming_s", streaming_s}};
}

}  // namespace luxfield::cli
