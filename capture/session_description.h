// session.json: the rig as it was (docs/formats/session.md).
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "hal/devices.h"

namespace luxfield::capture {

struct SessionDescription {
  nlohmann::json session;
  std::vector<std::pair<std::string, std::string>> files;  // beside session.json: name, bytes
};
SessionDescription DescribeSession(const hal::Devices& devices);

nlohmann::json DescribeDevices(const hal::Devices& devices);  // role -> identity

}  // namespace luxfield::capture
