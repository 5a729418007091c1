// session.json: the rig as it was (docs/formats/session.md).
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/hal/devices.h"
#include "luxfield/session/session_writer.h"

namespace luxfield::capture {

struct SessionDescription {
  nlohmann::json session;
  std::vector<std::pair<std::string, std::string>> files;  // beside session.json: name, bytes
};
SessionDescription DescribeSession(const hal::Devices& devices);

// A new session of this plan, or the one in the folder where `resume` is set and there is one.
// Throws as core::SessionWriter does, and InputError where camera, calibration, vignetting or the
// lab's files are not those of the session that is resumed (docs/formats/session.md).
session::SessionWriter OpenSession(const std::filesystem::path& folder, const nlohmann::json& plan,
                                   const hal::Devices& devices, bool resume);

// Identities by role, as session.json and epoch_start have them.
std::map<std::string, std::string> DescribeDevices(const hal::Devices& devices);

}  // namespace luxfield::capture
