#include "luxfield/session/session_file.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/json.h"
#include "luxfield/rig/cfa.h"
#include "luxfield/session/optional_field.h"
#include "luxfield/session/session_path.h"
#include "luxfield/session/session_store.h"
#include "luxfield/session/stated.h"

namespace luxfield::session {
namespace {

using core::Field;
using core::Json;
using Texts = std::map<std::string, std::string>;

constexpr const char* kMend = "correct the camera's calibration";

Texts GetTexts(const Json& json, const char* key, const std::string& file) {
  return core::FieldOr(json, key, Texts(), file);
}

Json ToJson(const SessionCamera& c) {
  Json json = {{"defects", c.defects}};
  Set(json, "width", c.width);
  Set(json, "height", c.height);
  Set(json, "bits", c.bits);
  Set(json, "black_dn", c.black_dn);
  Set(json, "saturation_dn", c.saturation_dn);
  Set(json, "gain_dn_per_e", c.gain_dn_per_e);
  Set(json, "read_noise_dn", c.read_noise_dn);
  Set(json, "dark_current_e_per_s", c.dark_current_e_per_s);
  Set(json, "prnu", c.prnu);
  Set(json, "responsivity_e_per_s_per_w_m2", c.responsivity_e_per_s_per_w_m2);
  Set(json, "vignetting", c.vignetting);
  if (!c.cfa.empty()) json["cfa"] = c.cfa;
  if (!c.settings.empty()) json["settings"] = c.settings;
  return json;
}

SessionCamera ReadCamera(const Json& json, const std::string& file) {
  SessionCamera c;
  c.width = Get<int>(json, "width", file);
  c.height = Get<int>(json, "height", file);
  c.bits = Get<int>(json, "bits", file);
  c.black_dn = Get<double>(json, "black_dn", file);
  c.saturation_dn = Get<double>(json, "saturation_dn", file);
  c.gain_dn_per_e = Get<double>(json, "gain_dn_per_e", file);
  c.read_noise_dn = Get<double>(json, "read_noise_dn", file);
  c.dark_current_e_per_s = Get<double>(json, "dark_current_e_per_s", file);
  c.prnu = Get<double>(json, "prnu", file);
  c.responsivity_e_per_s_per_w_m2 =
      Get<std::vector<double>>(json, "responsivity_e_per_s_per_w_m2", file);
  if (json.contains("cfa")) {
    c.cfa = Field<std::string>(json, "cfa", file);
    if (!rig::IsBayer(c.cfa))
      throw InputError(file, fmt::format("camera.cfa = '{}' is unknown", c.cfa),
                       "use RGGB, BGGR, GRBG or GBRG");
  }
  if (json.contains("defects"))
    c.defects = Field<std::vector<std::pair<int, int>>>(json, "defects", file);
  if (json.contains("vignetting") && !json.at("vignetting").is_null())
    c.vignetting = Field<std::string>(json, "vignetting", file);
  c.settings = GetTexts(json, "settings", file);
  return c;
}

template <typename T>
T Number(const std::optional<T>& value, const char* key, const std::string& file, double min,
         double max) {
  const T& number = Stated(value, key, file);
  if (!(number >= min && number <= max))
    throw InputError(
        file, fmt::format("camera.{} = {} is not between {} and {}", key, number, min, max), kMend);
  return number;
}

std::vector<double> Responsivity(const SessionCamera& camera, const std::string& file,
                                 std::optional<int> channels, double largest) {
  const std::vector<double>& values =
      Stated(camera.responsivity_e_per_s_per_w_m2, "responsivity_e_per_s_per_w_m2", file);
  if (channels && values.size() != static_cast<std::size_t>(*channels))
    throw InputError(
        file,
        fmt::format("camera.responsivity_e_per_s_per_w_m2 has {} values for {} channels",
                    values.size(), *channels),
        "give one per channel of the plan");
  for (const double value : values)
    if (!(value > 0 && value < largest))
      throw InputError(
          file, fmt::format("camera.responsivity_e_per_s_per_w_m2 = {} must be above 0", value),
          kMend);
  return values;
}

std::vector<float> ReadVignetting(const std::string& name, const std::string& file,
                                  const std::filesystem::path& folder,
                                  const rig::SensorModel& sensor) {
  const std::filesystem::path path = SessionFile(folder, name, file);
  core::Image image = core::ReadExrImage(path);
  if (image.width != sensor.width || image.height != sensor.height || image.channels != 1)
    throw InputError(
        path.string(),
        fmt::format("{} x {} pixels in {} channels, but the sensor of {} has {} x {} in one",
                    image.width, image.height, image.channels, file, sensor.width, sensor.height),
        "measure the vignetting with this camera");
  for (const float value : image.data)
    if (!(value > 0 && std::isfinite(value)))
      throw InputError(path.string(),
                       fmt::format("relative sensitivity {} must be above 0 and finite", value),
                       "list dead pixels as camera.defects");
  return std::move(image.data);
}

}  // namespace

SessionCamera CameraOf(const rig::SensorModel& sensor) {
  SessionCamera c;
  c.width = sensor.width;
  c.height = sensor.height;
  c.bits = sensor.bits;
  c.black_dn = sensor.black_dn;
  c.saturation_dn = sensor.saturation_dn;
  c.gain_dn_per_e = sensor.gain_dn_per_e;
  c.read_noise_dn = sensor.read_noise_dn;
  c.dark_current_e_per_s = sensor.dark_current_e_per_s;
  c.prnu = sensor.prnu;
  c.responsivity_e_per_s_per_w_m2 = sensor.responsivity_e_per_s_per_w_m2;
  c.cfa = sensor.cfa;
  c.defects = sensor.defects;
  return c;
}

Json ToJson(const SessionSetup& session) {
  Json json = {{"devices", session.devices}, {"software", session.software}};
  if (session.camera) json["camera"] = ToJson(*session.camera);
  if (session.image_from_sensor)
    json["calibration"] = {{"image_from_sensor", session.image_from_sensor->row_major()}};
  if (!session.lab_files.empty()) json["lab_files"] = session.lab_files;
  return json;
}

SessionSetup SetupFromJson(const Json& json, const std::string& file) {
  SessionSetup session;
  if (json.contains("camera")) session.camera = ReadCamera(json.at("camera"), file);
  if (json.contains("calibration") && json.at("calibration").contains("image_from_sensor"))
    session.image_from_sensor =
        Field<std::array<double, 9>>(json.at("calibration"), "image_from_sensor", file);
  session.lab_files = GetTexts(json, "lab_files", file);
  session.devices = GetTexts(json, "devices", file);
  session.software = GetTexts(json, "software", file);
  return session;
}

SessionSetup SetupOf(const SessionReader& session) {
  return SetupFromJson(session.session(), (session.folder() / "session.json").string());
}

std::optional<SensorSize> StatedSize(const SessionReader& session) {
  const std::string file = (session.folder() / "session.json").string();
  const auto camera = session.session().find("camera");
  if (camera == session.session().end() || !camera->contains("width")) return std::nullopt;
  return SensorSize{Field<int>(*camera, "width", file), Field<int>(*camera, "height", file)};
}

rig::SensorModel SensorModelOf(const SessionSetup& session, const std::string& file,
                               const std::filesystem::path& folder, std::optional<int> channels) {
  constexpr double kHuge = 1e30;
  const SessionCamera& camera = Stated(session.camera, "camera", file);
  rig::SensorModel sensor;
  sensor.width = Number(camera.width, "width", file, 1, 100000);
  sensor.height = Number(camera.height, "height", file, 1, 100000);
  sensor.bits = Number(camera.bits, "bits", file, 1, 32);
  sensor.gain_dn_per_e = Number(camera.gain_dn_per_e, "gain_dn_per_e", file, 1e-30, kHuge);
  sensor.read_noise_dn = Number(camera.read_noise_dn, "read_noise_dn", file, 0, kHuge);
  sensor.black_dn = Number(camera.black_dn, "black_dn", file, 0, kHuge);
  sensor.saturation_dn = Number(camera.saturation_dn, "saturation_dn", file, 0, kHuge);
  sensor.prnu = Number(camera.prnu, "prnu", file, 0, 1);
  sensor.dark_current_e_per_s =
      Number(camera.dark_current_e_per_s, "dark_current_e_per_s", file, 0, kHuge);
  if (!(sensor.saturation_dn > sensor.black_dn))
    throw InputError(file,
                     fmt::format("camera.saturation_dn = {} must be above camera.black_dn = {}",
                                 sensor.saturation_dn, sensor.black_dn),
                     kMend);
  sensor.responsivity_e_per_s_per_w_m2 = Responsivity(camera, file, channels, kHuge);
  sensor.cfa = camera.cfa;
  const std::size_t seen = sensor.responsivity_e_per_s_per_w_m2.size();
  if (!sensor.cfa.empty() && seen != 3)
    throw InputError(file, fmt::format("camera.cfa sees three colours, the plan {}", seen),
                     "capture with plan.channels = 3");
  for (const auto& [row, column] : camera.defects)
    if (row < 0 || row >= sensor.height || column < 0 || column >= sensor.width)
      throw InputError(
          file,
          fmt::format("camera.defects holds [{}, {}], outside the sensor of {} rows x {} columns",
                      row, column, sensor.height, sensor.width),
          "give [row, column]");
  sensor.defects = camera.defects;
  if (camera.vignetting)
    sensor.vignetting = ReadVignetting(*camera.vignetting, file, folder, sensor);
  return sensor;
}

rig::SensorModel SensorModelOf(const SessionReader& session, std::optional<int> channels) {
  return SensorModelOf(SetupOf(session), (session.folder() / "session.json").string(),
                       session.folder(), channels);
}

}  // namespace luxfield::session
