// session.json: camera, calibration, devices and software of a session (docs/formats/session.md,
// "session.json"), written and read here alone.
//
// What the camera's numbers mean: rig/sensor_model.h. Parts that a file does not state are absent.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/rig/homography.h"
#include "luxfield/rig/sensor_model.h"

namespace luxfield::session {

class SessionReader;

struct SessionCamera {
  std::optional<int> width, height, bits;
  std::optional<double> black_dn, saturation_dn, gain_dn_per_e, read_noise_dn;
  std::optional<double> dark_current_e_per_s, prnu;
  std::optional<std::vector<double>> responsivity_e_per_s_per_w_m2;  // per channel
  std::string cfa;                                                   // empty: no colour mosaic
  std::vector<std::pair<int, int>> defects;                          // (row, column)
  std::optional<std::string> vignetting;                             // file beside session.json
  std::map<std::string, std::string> settings;  // empty: of a simulated or an older session
};

struct SessionSetup {
  std::optional<SessionCamera> camera;
  std::optional<rig::Homography> image_from_sensor;  // calibration
  std::map<std::string, std::string> lab_files;      // field of lab.toml: SHA-256
  std::map<std::string, std::string> devices;        // role: identity
  std::map<std::string, std::string> software;       // name, version
};

// Of the sensor, which all frames of a session are of; none where session.json states none. Reads
// nothing else of the file.
struct SensorSize {
  int width = 0, height = 0;
};
std::optional<SensorSize> StatedSize(const SessionReader& session);

// All of the model but the pixels of its vignetting, which are a file of their own.
SessionCamera CameraOf(const rig::SensorModel& sensor);

nlohmann::json ToJson(const SessionSetup& session);
// Passes over keys that it does not know. Throws InputError naming file, field and value for what is
// there and wrong.
SessionSetup SetupFromJson(const nlohmann::json& json, const std::string& file);
SessionSetup SetupOf(const SessionReader& session);

// The camera of `file` as a model, its vignetting read from `folder`. Throws InputError naming file,
// field and value for what is absent or makes no sense, and for another number of channels than
// `channels`, where that is given.
rig::SensorModel SensorModelOf(const SessionSetup& session, const std::string& file,
                               const std::filesystem::path& folder,
                               std::optional<int> channels = {});
rig::SensorModel SensorModelOf(const SessionReader& session, std::optional<int> channels = {});

}  // namespace luxfield::session
