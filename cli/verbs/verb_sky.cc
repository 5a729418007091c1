// luxfield sky -o X.exr, luxfield sky --day -o FOLDER: the sun and the sky, clear or with
// clouds, as environment maps.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "luxfield/cli/program.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/radiance_hdr.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/environment/sun_sky.h"

namespace luxfield::cli {
namespace {

constexpr double kLumenPerWatt = 683;

struct Options {
  std::string output, date, time = "12:00", layout = "latitude-longitude", unit = "cd/m2",
                            format = "exr";
  double latitude_deg = 0, longitude_deg = 0, utc_offset_h = 0, turbidity = 2.5, albedo = 0.2;
  environment::CloudOptions clouds;
  int height = 512, frames = 67;
  bool day = false;
};

struct Frame {
  environment::UtcTime when;
  environment::SunPosition sun;
  environment::SunSky sky;
};

Frame MakeFrame(const Options& options, environment::UtcTime when) {
  const auto sun = environment::FindSun({options.latitude_deg, options.longitude_deg}, when);
  if (options.clouds.cover == 0)
    return {when, sun, environment::SunSky(sun, options.turbidity, options.albedo)};
  return {when, sun,
          environment::SunSky(sun, options.turbidity, options.albedo, options.clouds, when)};
}

environment::EnvironmentLayout Layout(const Options& options) {
  const auto layout = environment::EnvironmentLayoutFromName(options.layout);
  if (!layout)
    throw InputError(fmt::format("--layout {}: no such layout; choose one of {}", options.layout,
                                 environment::EnvironmentLayoutNames()));
  return *layout;
}

void WriteFrame(const std::filesystem::path& path, const Options& options, const Frame& frame) {
  const auto layout = Layout(options);
  core::Image image = frame.sky.Picture(layout, options.height);
  if (options.unit == "W/m2")
    for (float& value : image.data) value = static_cast<float>(value / kLumenPerWatt);
  core::ExrAttributes attributes;
  attributes["luxfield:unit"] = options.unit == "W/m2" ? "W sr^-1 m^-2" : "cd m^-2";
  attributes["luxfield:utc"] = environment::FormatUtc(frame.when);
  attributes["luxfield:latitude_deg"] = options.latitude_deg;
  attributes["luxfield:longitude_deg"] = options.longitude_deg;
  attributes["luxfield:turbidity"] = options.turbidity;
  attributes["luxfield:ground_albedo"] = options.albedo;
  if (const auto& clouds = options.clouds; clouds.cover > 0) {
    attributes["luxfield:clouds"] = clouds.cover;
    attributes["luxfield:cloud_seed"] = double(clouds.seed);
    attributes["luxfield:wind_m_s"] = clouds.wind_m_s;
    attributes["luxfield:wind_from_deg"] = clouds.wind_from_deg;
    attributes["luxfield:cloud_altitude_m"] = clouds.altitude_m;
    attributes["luxfield:cloud_thickness"] = clouds.optical_thickness;
  }
  attributes["luxfield:sun_elevation_deg"] = frame.sun.apparent_elevation_deg;
  attributes["luxfield:sun_azimuth_deg"] = frame.sun.azimuth_deg;
  if (path.extension() != ".hdr")
    return environment::WriteEnvironmentPicture(path, image, layout, attributes);
  std::vector<std::string> comments;
  for (const auto& [name, value] : attributes)
    comments.push_back(std::visit(
        [&name = name](const auto& v) { return fmt::format("{} = {}", name, v); }, value));
  core::WriteRadianceHdr(path, image, comments);
}

core::Json ToJson(const Frame& frame) {
  return {{"utc", environment::FormatUtc(frame.when)},
          {"sun_elevation_deg", frame.sun.apparent_elevation_deg},
          {"sun_azimuth_deg", frame.sun.azimuth_deg},
          {"sun_radius_deg", frame.sun.angular_radius_deg()},
          {"sun_radiance_cd_m2", frame.sky.sun_radiance()},
          {"direct_normal_lx", core::Luminance(frame.sky.direct_normal())},
          {"diffuse_horizontal_lx", core::Luminance(frame.sky.diffuse_horizontal())},
          {"global_horizontal_lx", core::Luminance(frame.sky.global_horizontal())},
          {"region_horizontal_lx", core::Luminance(frame.sky.region_horizontal())},
          {"cloud_cover", frame.sky.cloud_cover()}};
}

std::string CloudText(const Options& options) {
  const auto& clouds = options.clouds;
  if (clouds.cover == 0) return "";
  return fmt::format(", clouds over {:.0f} % at {:.0f} m (seed {})", 100 * clouds.cover,
                     clouds.altitude_m, clouds.seed);
}

core::Json MakeOne(const Options& options, std::chrono::sys_days date) {
  const auto offset = std::chrono::seconds(std::llround(3600 * options.utc_offset_h));
  const Frame frame =
      MakeFrame(options, date + environment::ParseTimeOfDay(options.time, "--time") - offset);
  WriteFrame(options.output, options, frame);
  const core::Json json = ToJson(frame);
  fmt::print("{}: sun and sky at {}, turbidity {}{}\n", options.output,
             environment::FormatUtc(frame.when), options.turbidity, CloudText(options));
  fmt::print(
      "  sun          {:.3f} degrees above the horizon, {:.3f} east of north; disc of {:.3f} "
      "degrees, {:.4g} cd/m2\n",
      frame.sun.apparent_elevation_deg, frame.sun.azimuth_deg, 2 * frame.sun.angular_radius_deg(),
      core::Luminance(frame.sky.sun_radiance()));
  fmt::print(
      "  illuminance  sun {:.0f} lx (facing it); sky {:.0f} lx, both {:.0f} lx (facing up)\n",
      json["direct_normal_lx"].get<double>(), json["diffuse_horizontal_lx"].get<double>(),
      json["global_horizontal_lx"].get<double>());
  if (options.clouds.cover > 0)
    fmt::print(
        "  clouds       over {:.1f} % of the sky; {:.0f} lx on the ground around, on average\n",
        100 * frame.sky.cloud_cover(), json["region_horizontal_lx"].get<double>());
  return json;
}

core::Json MakeDay(const Options& options, std::chrono::sys_days date) {
  const std::filesystem::path folder = options.output;
  if (std::filesystem::exists(folder) && !std::filesystem::is_empty(folder))
    throw InputError(folder.string(), "is not empty",
                     "name a new folder: what lies in it would join the sequence");
  const auto daylight =
      environment::FindDaylight({options.latitude_deg, options.longitude_deg}, date);
  const double step_s = double((daylight.end - daylight.begin).count()) / options.frames;
  const auto make = [&](int k) {
    return MakeFrame(options,
                     daylight.begin + std::chrono::seconds(std::llround((k + 0.5) * step_s)));
  };
  Layout(options);
  Frame frame = make(0);  // before the folder is made: refuses what it cannot be made of
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw DeviceError(fmt::format("{}: cannot make the folder ({}); choose another place",
                                  folder.string(), error.message()));
  core::Progress progress("sky", options.frames);
  core::Json frames = core::Json::array();
  for (int k = 0; k < options.frames; ++k) {
    core::ThrowIfInterrupted();
    if (k > 0) frame = make(k);
    WriteFrame(folder / fmt::format("sky_{:04}.{}", k, options.format), options, frame);
    core::PutOutputsInPlace();
    frames.push_back(ToJson(frame));
    progress.Advance();
  }
  fmt::print("{}: {} frames of the sky, {} to {}, every {:.0f} s, turbidity {}{}\n",
             folder.string(), options.frames, environment::FormatUtc(daylight.begin),
             environment::FormatUtc(daylight.end), step_s, options.turbidity, CloudText(options));
  return {{"frames", frames}, {"step_s", step_s}};
}

core::Json Run(const Options& options) {
  const auto date = environment::ParseDate(options.date, "--date");
  if (options.day) return MakeDay(options, date);
  const std::filesystem::path path = options.output;
  if (path.extension() != ".hdr") RequireExtension(options.output, ".exr", "--output");
  core::RequireOutputPlace(path);
  return MakeOne(options, date);
}

}  // namespace

void AddSky(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("sky", [options] { return Run(*options); });
  verb.add_option("-o,--output", options->output,
                  "The .exr (FLOAT) or .hdr (to 1/256) to write; with --day a new folder")
      ->required();
  verb.add_option("--latitude", options->latitude_deg, "Degrees, north positive")
      ->required()
      ->check(CLI::Range(-90.0, 90.0));
  verb.add_option("--longitude", options->longitude_deg, "Degrees, east positive")
      ->check(CLI::Range(-180.0, 180.0));
  verb.add_option("--date", options->date, "Like 2024-06-21")->required();
  verb.add_option("--time", options->time, "Like 13:05 or 13:05:30, UTC unless --utc-offset");
  verb.add_option("--utc-offset", options->utc_offset_h, "Hours by which --time is ahead of UTC")
      ->check(CLI::Range(-14.0, 14.0));
  verb.add_flag("--day", options->day, "The whole day from sunrise to sunset as a sequence");
  verb.add_option("--frames", options->frames, "Frames of --day")
      ->check(CLI::Range(1, 9999))
      ->needs("--day");
  verb.add_option("--format", options->format, "Of the frames of --day")
      ->check(CLI::IsMember({"exr", "hdr"}))
      ->needs("--day");
  verb.add_option("--turbidity", options->turbidity,
                  "1 to 10: 1 no haze, 2 very clear, 3 clear, 6 hazy");
  verb.add_option("--ground-albedo", options->albedo, "0 to 1, of the ground below the horizon");
  verb.add_option("--clouds", options->clouds.cover, "Share of the sky that is cloud, 0 to 1")
      ->check(CLI::Range(0.0, 1.0));
  verb.add_option("--cloud-seed", options->clouds.seed, "Which clouds")->needs("--clouds");
  verb.add_option("--cloud-altitude", options->clouds.altitude_m, "Metres, 100 to 12000")
      ->needs("--clouds");
  verb.add_option("--cloud-thickness", options->clouds.optical_thickness,
                  "Mean optical thickness of the clouds, 0.1 to 200")
      ->needs("--clouds");
  verb.add_option("--wind", options->clouds.wind_m_s, "Metres a second that clouds drift")
      ->needs("--clouds");
  verb.add_option("--wind-from", options->clouds.wind_from_deg,
                  "Where the wind comes from, degrees: 0 north, 90 east")
      ->needs("--clouds");
  verb.add_option("--height", options->height, "Rows of the picture");
  verb.add_option("--layout", options->layout, environment::EnvironmentLayoutNames());
  verb.add_option("--unit", options->unit,
                  "cd/m2: luminance; W/m2: the same over 683 lm/W, in W sr^-1 m^-2")
      ->check(CLI::IsMember({"cd/m2", "W/m2"}));
}

}  // namespace luxfield::cli
