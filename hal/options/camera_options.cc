#include "luxfield/hal/options/camera_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "luxfield/hal/built_drivers.h"
#include "luxfield/hal/drivers/aravis/pixel_format.h"

namespace luxfield::hal {
namespace {

constexpr double kTiny = std::numeric_limits<double>::min();

aravis::AravisOptions ReadAravis(const core::Config& camera) {
  aravis::AravisOptions options;
  options.id = camera.Text("id", "");
  options.pixel_format = camera.Text("pixel_format", options.pixel_format);
  options.gain_db = camera.Number("gain_db", 0, {-100, 100});
  if (camera.Has("region_px")) {
    const auto r = camera.Numbers("region_px", 4);
    for (const double value : r)
      if (value < 0 || value > 1e6 || value != static_cast<int>(value))
        camera.Fail("region_px", "must be whole numbers of pixels", "give x, y, width, height");
    options.region = {static_cast<int>(r[0]), static_cast<int>(r[1]), static_cast<int>(r[2]),
                      static_cast<int>(r[3])};
  }
  options.readout_s = camera.Number("readout_s", options.readout_s, {0, 100});
  if (camera.Has("trigger_source")) {
    aravis::LineTrigger& trigger = options.line_trigger.emplace();
    trigger.source = camera.Text("trigger_source");
    if (trigger.source.empty() || trigger.source == "Software")
      camera.Fail("trigger_source", "is \"" + trigger.source + "\", which is no input of a camera",
                  "name the one that [trigger] is wired to, such as \"Line0\", or leave it out");
    trigger.activation =
        camera.Choice("trigger_activation", {"RisingEdge", "FallingEdge"}, trigger.activation);
  }
  return options;
}

gphoto2::Gphoto2Options ReadGphoto2(const core::Config& camera) {
  gphoto2::Gphoto2Options options;
  options.port = camera.Text("port", "");
  const auto size = camera.Numbers("size_px", 2);
  for (const double side : size)
    if (side < 1 || side > 1e5 || side != static_cast<int>(side))
      camera.Fail("size_px", "must be whole numbers of pixels", "give width, height");
  options.width = static_cast<int>(size[0]);
  options.height = static_cast<int>(size[1]);
  options.bits = camera.Integer("bits", options.bits, 8, 16);
  options.cfa = camera.Choice("mosaic", {"RGGB", "BGGR", "GRBG", "GBRG", "none"});
  if (options.cfa == "none") options.cfa.clear();
  options.shutter_speed = camera.Text("shutter_speed", options.shutter_speed);
  for (const core::Config& setting : camera.Tables("setting"))
    options.settings.emplace_back(setting.Text("name"), setting.Text("value"));
  options.readout_s = camera.Number("readout_s", options.readout_s, {0, 100});
  return options;
}

rig::SensorModel ReadCalibration(const core::Config& camera, int channels, double full_scale_dn) {
  rig::SensorModel c;
  c.black_dn = camera.Number("black_dn", 0, {0, full_scale_dn - 1});
  c.saturation_dn = camera.Number("saturation_dn", full_scale_dn, {c.black_dn + 1, full_scale_dn});
  c.gain_dn_per_e = camera.Number("gain_dn_per_e", {kTiny, 1e6});
  c.read_noise_dn = camera.Number("read_noise_dn", {0, 1e4});
  c.dark_current_e_per_s = camera.Number("dark_current_e_per_s", 0, {0, 1e9});
  c.prnu = camera.Number("prnu", 0, {0, 0.2});
  c.responsivity_e_per_s_per_w_m2 =
      camera.Numbers("responsivity_e_per_s_per_w_m2", static_cast<std::size_t>(channels));
  for (const double r : c.responsivity_e_per_s_per_w_m2)
    if (!(r > 0)) camera.Fail("responsivity_e_per_s_per_w_m2", "must be above 0 in every channel");
  const auto defects = camera.Numbers("defects", 0, {});
  for (const double value : defects)
    if (defects.size() % 2 != 0 || value < 0 || value > 1e6 || value != static_cast<int>(value))
      camera.Fail("defects", "must be pairs of whole numbers",
                  "give row, column, row, column, ...");
  for (std::size_t k = 0; k < defects.size(); k += 2)
    c.defects.emplace_back(static_cast<int>(defects[k]), static_cast<int>(defects[k + 1]));
  return c;
}

// The mosaic of a Bayer format, as rig/cfa.h has it: the format names the first row's colours.
std::string MosaicOf(const std::string& pixel_format) {
  if (!pixel_format.starts_with("Bayer")) return "";
  const std::string row = pixel_format.substr(5, 2);
  return row == "RG" ? "RGGB" : row == "GR" ? "GRBG" : row == "GB" ? "GBRG" : "BGGR";
}

}  // namespace

CameraOptions ReadCamera(const core::Config& camera, rig::RigKind rig, int channels) {
  CameraOptions options;
  int bits = 0;
  std::string cfa, mosaic_field = "pixel_format";
  if (camera.Choice("driver", {"aravis", "gphoto2"}) == "aravis") {
    RequireBuilt(camera, kHasAravis, "libaravis-dev");
    const aravis::AravisOptions driver = ReadAravis(camera);
    const auto format = aravis::FindPixelFormat(driver.pixel_format);
    if (!format)
      camera.Fail("pixel_format", "is \"" + driver.pixel_format + "\", which is not read",
                  "choose one of " + aravis::PixelFormatNames());
    bits = format->bits;
    cfa = MosaicOf(driver.pixel_format);
    options.driver = driver;
  } else {
    RequireBuilt(camera, kHasGphoto2, "libgphoto2-dev and libraw-dev");
    const gphoto2::Gphoto2Options driver = ReadGphoto2(camera);
    bits = driver.bits;
    cfa = driver.cfa;
    mosaic_field = "mosaic";
    options.driver = driver;
  }
  if (camera.Has("image_from_sensor")) {
    const auto h = camera.Numbers("image_from_sensor", 9);
    std::array<double, 9> map{};
    std::copy(h.begin(), h.end(), map.begin());
    options.image_plane = rig::Homography(map);
  } else if (rig == rig::RigKind::kReflector || camera.Has("corners_m")) {
    options.image_plane = ReadCorners(camera);
  } else {
    options.image_plane = PixelPitch{camera.Number("pitch_m", {1e-7, 1})};
  }
  options.calibration = ReadCalibration(camera, channels, (1 << bits) - 1);
  options.calibration.cfa = cfa;
  if (!cfa.empty() && channels != 3)
    camera.Fail(mosaic_field, "is of a colour mosaic", "set lab.channels = 3");
  return options;
}

std::map<std::string, std::string> SettingsOf(const CameraOptions& options) {
  if (const auto* aravis = std::get_if<aravis::AravisOptions>(&options.driver)) {
    std::map<std::string, std::string> settings = {{"driver", "aravis"},
                                                   {"pixel_format", aravis->pixel_format},
                                                   {"gain_db", fmt::format("{}", aravis->gain_db)}};
    if (const auto& r = aravis->region)
      settings["region_px"] = fmt::format("{}, {}, {}, {}", r->x, r->y, r->width, r->height);
    if (const auto& line = aravis->line_trigger) {
      settings["trigger_source"] = line->source;
      settings["trigger_activation"] = line->activation;
    }
    return settings;
  }
  std::map<std::string, std::string> settings = {{"driver", "gphoto2"}};
  for (const auto& [name, value] : std::get<gphoto2::Gphoto2Options>(options.driver).settings)
    settings["setting " + name] = value;
  return settings;
}

bool NeedsTrigger(const CameraOptions& options) {
  const auto* aravis = std::get_if<aravis::AravisOptions>(&options.driver);
  return aravis && aravis->line_trigger;
}

std::unique_ptr<Camera> OpenCamera(const CameraOptions& options, std::shared_ptr<core::Clock> clock,
                                   std::shared_ptr<Trigger> trigger) {
  // ReadCamera has refused drivers that are not built.
  if constexpr (kHasAravis)
    if (const auto* driver = std::get_if<aravis::AravisOptions>(&options.driver))
      return std::make_unique<aravis::AravisCamera>(*driver, std::move(clock), std::move(trigger));
  if constexpr (kHasGphoto2)
    if (const auto* driver = std::get_if<gphoto2::Gphoto2Options>(&options.driver))
      return std::make_unique<gphoto2::Gphoto2Camera>(*driver, std::move(clock));
  return nullptr;
}

rig::Homography ImageFromSensor(const CameraOptions& options,
                                const CameraCapabilities& capabilities) {
  if (const auto* map = std::get_if<rig::Homography>(&options.image_plane)) return *map;
  const auto* pixels = std::get_if<PixelPitch>(&options.image_plane);
  return rig::Homography::FromCorners(
      capabilities.width, capabilities.height,
      pixels ? CornersOfPixels(pixels->pitch_m, capabilities.width, capabilities.height)
             : std::get<Corners>(options.image_plane));
}

}  // namespace luxfield::hal
