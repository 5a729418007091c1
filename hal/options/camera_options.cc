#include "luxfield/hal/options/camera_options.h"

#include <algorithm>
#include <limits>

#include "luxfield/hal/built_drivers.h"
#include "luxfield/hal/drivers/list/drivers.h"

namespace luxfield::hal {
namespace {

constexpr double kTiny = std::numeric_limits<double>::min();

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

// The driver that [camera] names, which is built into this program.
const Driver& NamedDriver(const core::Config& camera) {
  std::vector<std::string> names;
  for (const Driver& driver : AllDrivers())
    if (driver.read_camera) names.push_back(driver.name);
  const Driver& driver = DriverNamed(camera.Choice("driver", names));
  RequireBuilt(camera, driver.built, driver.packages);
  return driver;
}

}  // namespace

CameraOptions ReadCamera(const core::Config& camera, rig::RigKind rig, int channels) {
  CameraOptions options;
  const Driver& driver = NamedDriver(camera);
  options.driver = driver.read_camera(camera);
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
  options.calibration = ReadCalibration(camera, channels, (1 << options.driver.bits) - 1);
  options.calibration.cfa = options.driver.cfa;
  if (!options.driver.cfa.empty() && channels != 3)
    camera.Fail(options.driver.mosaic_field, "is of a colour mosaic", "set lab.channels = 3");
  return options;
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
