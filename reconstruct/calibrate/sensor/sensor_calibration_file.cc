#include "luxfield/reconstruct/calibrate/sensor/sensor_calibration_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"

namespace luxfield::reconstruct {
namespace {

using core::Field;
using core::Json;

constexpr const char* kFormat = "luxfield sensor calibration";
constexpr int kVersion = 1;

void Put(Json& json, const std::string& key, const Quantity& quantity) {
  json[key] = quantity.value;
  json[key + "_sigma"] = quantity.sigma;
}

void Put(Json& json, const std::string& key, const std::optional<Quantity>& quantity) {
  if (quantity) return Put(json, key, *quantity);
  json[key] = nullptr;
  json[key + "_sigma"] = nullptr;
}

Json TransferJson(const PhotonTransfer& t) {
  Json json;
  Put(json, "gain_dn_per_e", t.gain_dn_per_e);
  Put(json, "gain_e_per_dn", t.gain_e_per_dn);
  Put(json, "read_variance_dn2", t.read_variance_dn2);
  Put(json, "read_noise_dn", t.read_noise_dn);
  Put(json, "read_noise_e", t.read_noise_e);
  json["read_noise_resolved"] = t.read_noise_resolved;
  Put(json, "black_dn", t.offset_dn);
  Put(json, "dark_current_e_per_s", t.dark_current_e_per_s);
  Put(json, "saturation_dn", t.saturation_dn);
  Put(json, "capacity_e", t.capacity_e);
  json["fit_chi_squared"] = t.chi_squared;
  json["fit_degrees"] = t.degrees;
  return json;
}

Json PointsJson(const std::vector<TransferPoint>& points) {
  Json json = Json::array();
  for (const TransferPoint& p : points)
    json.push_back({{"dark", p.dark},
                    {"exposure_s", p.exposure_s},
                    {"signal_dn", p.signal_dn},
                    {"variance_dn2", p.variance_dn2},
                    {"model_dn2", p.model_dn2},
                    {"sigma_dn2", p.sigma_dn2},
                    {"saturated", p.saturated},
                    {"fitted", p.fitted}});
  return json;
}

Json LinearityJson(const Linearity& l) {
  Json points = Json::array();
  for (const LinearityPoint& p : l.points)
    points.push_back({{"exposure_s", p.exposure_s},
                      {"signal_dn", p.signal_dn},
                      {"deviation", p.deviation},
                      {"sigma", p.sigma}});
  Json json = {{"points", points},
               {"largest_deviation", l.largest.deviation},
               {"largest_deviation_sigma", l.largest.sigma},
               {"chi_squared", l.chi_squared},
               {"degrees", l.degrees},
               {"repeatability", l.repeatability},
               {"by_monitor", l.by_monitor}};
  Put(json, "exposure_offset_s", l.exposure_offset_s);
  return json;
}

double Number(const Json& json, const std::string& key, const std::string& file, double min) {
  const double value = Field<double>(json, key, file);
  if (!(value >= min && std::isfinite(value)))
    throw InputError(file,
                     fmt::format("sensor.{} = {} must be finite and at least {}", key, value, min),
                     "calibrate the sensor again");
  return value;
}

void RequireSame(const Json& json, const std::string& key, int of_session,
                 const std::string& file) {
  const int value = Field<int>(json, key, file);
  if (value != of_session)
    throw InputError(
        file, fmt::format("{} = {}, but the session's camera has {}", key, value, of_session),
        "use the calibration of this camera and mode");
}

}  // namespace

Json ToJson(const SensorCalibration& c) {
  Json sensor = TransferJson(c.transfer);
  Put(sensor, "prnu", c.prnu);
  Put(sensor, "prnu_squared", c.prnu_squared);
  Json channels = Json::array();
  for (const ChannelCalibration& channel : c.channels) {
    Json json = TransferJson(channel.transfer);
    json["channel"] = channel.channel;
    if (channel.site) json["site"] = *channel.site;
    Put(json, "prnu", channel.prnu);
    Put(json, "prnu_squared", channel.prnu_squared);
    json["linearity"] = LinearityJson(channel.linearity);
    json["points"] = PointsJson(channel.transfer.points);
    channels.push_back(std::move(json));
  }
  return {{"format", kFormat},         {"version", kVersion}, {"width", c.width},
          {"height", c.height},        {"bits", c.bits},      {"sensor", sensor},
          {"channels", channels},      {"hot_pixels", c.hot}, {"dead_pixels", c.dead},
          {"provenance", c.provenance}};
}

void WriteSensorCalibration(const std::filesystem::path& path,
                            const SensorCalibration& calibration) {
  core::WriteJson(path, ToJson(calibration));
}

std::string ApplySensorCalibration(const std::filesystem::path& path, rig::SensorModel& sensor) {
  const std::string file = path.string(), bytes = core::ReadFile(path);
  const Json json = core::ParseJson(bytes, file);
  if (Field<std::string>(json, "format", file) != kFormat)
    throw InputError(file, "is not a sensor calibration",
                     "write one with `luxfield calibrate sensor`");
  if (Field<int>(json, "version", file) != kVersion)
    throw InputError(file,
                     fmt::format("has version {}, this program reads {}",
                                 Field<int>(json, "version", file), kVersion),
                     "calibrate the sensor again");
  RequireSame(json, "width", sensor.width, file);
  RequireSame(json, "height", sensor.height, file);
  RequireSame(json, "bits", sensor.bits, file);
  const Json s = Field<Json>(json, "sensor", file);
  sensor.gain_dn_per_e = Number(s, "gain_dn_per_e", file, 1e-30);
  sensor.read_noise_dn = Number(s, "read_noise_dn", file, 0);
  sensor.black_dn = Number(s, "black_dn", file, 0);
  sensor.prnu = Number(s, "prnu", file, 0);
  sensor.dark_current_e_per_s = std::max(0.0, Number(s, "dark_current_e_per_s", file, -1e30));
  if (!Field<Json>(s, "saturation_dn", file).is_null())
    sensor.saturation_dn = Number(s, "saturation_dn", file, sensor.black_dn);
  for (const char* key : {"hot_pixels", "dead_pixels"})
    for (const auto& [row, column] : Field<std::vector<std::pair<int, int>>>(json, key, file)) {
      if (row < 0 || row >= sensor.height || column < 0 || column >= sensor.width)
        throw InputError(file,
                         fmt::format("{} holds [{}, {}], outside the sensor", key, row, column),
                         "calibrate the sensor again");
      sensor.defects.emplace_back(row, column);
    }
  return core::Sha256(bytes);
}

}  // namespace luxfield::reconstruct
