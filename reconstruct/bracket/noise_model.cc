#include "luxfield/reconstruct/bracket/noise_model.h"

#include <fmt/format.h>

#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/json.h"
#include "luxfield/reconstruct/bracket/mosaic_sites.h"
#include "luxfield/session/session_path.h"

namespace luxfield::reconstruct {
namespace {

double Number(const core::Json& camera, const std::string& key, const std::string& file, double min,
              double max) {
  const double value = core::Field<double>(camera, key, file);
  if (!(value >= min && value <= max))
    throw InputError(file,
                     fmt::format("camera.{} = {} is not between {} and {}", key, value, min, max),
                     "correct the camera's calibration");
  return value;
}

void ReadVignetting(const std::string& name, const std::string& file,
                    const std::filesystem::path& folder, SensorModel* sensor) {
  const std::filesystem::path path = session::SessionFile(folder, name, file);
  const core::Image image = core::ReadExrImage(path);
  if (image.width != sensor->width || image.height != sensor->height || image.channels != 1)
    throw InputError(
        path.string(),
        fmt::format("{} x {} pixels in {} channels, but the sensor of {} has {} x {} in one",
                    image.width, image.height, image.channels, file, sensor->width, sensor->height),
        "measure the vignetting with this camera");
  for (const float value : image.data)
    if (!(value > 0 && std::isfinite(value)))
      throw InputError(path.string(),
                       fmt::format("relative sensitivity {} must be above 0 and finite", value),
                       "list dead pixels as camera.defects");
  sensor->vignetting = image.data;
}

}  // namespace

double SensorModel::quantisation_variance_dn2() const {
  if (bits < 32) return 1.0 / 12;
  const double rounding_dn = 1e-7 * saturation_dn;  // float32 keeps 24 bits of full scale
  return rounding_dn * rounding_dn;
}

SensorModel ReadSensorModel(const core::Json& camera, const std::string& file,
                            const std::filesystem::path& folder, int channels) {
  constexpr double kHuge = 1e30;
  SensorModel sensor;
  sensor.width = static_cast<int>(Number(camera, "width", file, 1, 100000));
  sensor.height = static_cast<int>(Number(camera, "height", file, 1, 100000));
  sensor.bits = static_cast<int>(Number(camera, "bits", file, 1, 32));
  sensor.gain_dn_per_e = Number(camera, "gain_dn_per_e", file, 1e-30, kHuge);
  sensor.read_noise_dn = Number(camera, "read_noise_dn", file, 0, kHuge);
  sensor.black_dn = Number(camera, "black_dn", file, 0, kHuge);
  sensor.saturation_dn = Number(camera, "saturation_dn", file, 0, kHuge);
  sensor.prnu = Number(camera, "prnu", file, 0, 1);
  sensor.dark_current_e_per_s = Number(camera, "dark_current_e_per_s", file, 0, kHuge);
  if (!(sensor.saturation_dn > sensor.black_dn))
    throw InputError(file,
                     fmt::format("camera.saturation_dn = {} must be above camera.black_dn = {}",
                                 sensor.saturation_dn, sensor.black_dn),
                     "correct the camera's calibration");

  sensor.responsivity_e_per_s_per_w_m2 =
      core::Field<std::vector<double>>(camera, "responsivity_e_per_s_per_w_m2", file);
  if (sensor.responsivity_e_per_s_per_w_m2.size() != static_cast<std::size_t>(channels))
    throw InputError(
        file,
        fmt::format("camera.responsivity_e_per_s_per_w_m2 has {} values for {} channels",
                    sensor.responsivity_e_per_s_per_w_m2.size(), channels),
        "give one per channel of the plan");
  for (const double value : sensor.responsivity_e_per_s_per_w_m2)
    if (!(value > 0 && value < kHuge))
      throw InputError(
          file, fmt::format("camera.responsivity_e_per_s_per_w_m2 = {} must be above 0", value),
          "correct the camera's calibration");

  sensor.cfa = ReadCfa(camera, file);
  if (!sensor.cfa.empty() && channels != 3)
    throw InputError(file, fmt::format("camera.cfa sees three colours, the plan {}", channels),
                     "capture with plan.channels = 3");
  if (camera.contains("defects"))
    for (const auto& [row, column] :
         core::Field<std::vector<std::pair<int, int>>>(camera, "defects", file)) {
      if (row < 0 || row >= sensor.height || column < 0 || column >= sensor.width)
        throw InputError(
            file,
            fmt::format("camera.defects holds [{}, {}], outside the sensor of {} rows x {} columns",
                        row, column, sensor.height, sensor.width),
            "give [row, column]");
      sensor.defects.emplace_back(row, column);
    }
  if (camera.contains("vignetting") && !camera["vignetting"].is_null())
    ReadVignetting(core::Field<std::string>(camera, "vignetting", file), file, folder, &sensor);
  return sensor;
}

void RefuseMosaic(const core::Json& camera, const std::string& file, const std::string& what) {
  if (camera.contains("cfa"))
    throw InputError(file,
                     fmt::format("camera.cfa = '{}': {} of a camera with a colour mosaic is not "
                                 "built",
                                 core::Field<std::string>(camera, "cfa", file), what),
                     "use the figures that its session states");
}

}  // namespace luxfield::reconstruct
