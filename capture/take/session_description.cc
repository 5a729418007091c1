#include "luxfield/capture/take/session_description.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/execution.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/exr_bytes.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/session/session_file.h"
#include "luxfield/session/session_path.h"
#include "luxfield/session/stated.h"
#include "luxfield/version.h"

namespace luxfield::capture {
namespace {

constexpr const char* kFirmware = "camera_firmware";

std::string Shown(const nlohmann::json& value) {
  constexpr std::size_t kMost = 80;
  const std::string text = value.dump();
  return text.size() <= kMost ? text : text.substr(0, kMost) + "...";
}

// Every field of both, but for camera.settings, which an older session does not state.
void RequireSame(const nlohmann::json& then, const nlohmann::json& now, const std::string& name,
                 const std::string& file) {
  const auto find = [](const nlohmann::json& in, const std::string& key) {
    const auto found = in.find(key);
    return found == in.end() ? nullptr : &*found;
  };
  std::set<std::string> keys;
  for (const auto& part : {then, now})
    for (const auto& [key, value] : part.items()) keys.insert(key);
  for (const std::string& key : keys) {
    const nlohmann::json *was = find(then, key), *is = find(now, key);
    const std::string field = name + "." + key;
    if (!was && key == "settings") continue;
    if (was && is && was->is_object() && is->is_object())
      RequireSame(*was, *is, field, file);
    else if (!was || !is || *was != *is)
      throw InputError(file,
                       fmt::format("{} = {}, the lab given has {}", field,
                                   was ? Shown(*was) : "nothing", is ? Shown(*is) : "nothing"),
                       "resume with the lab as it was, or capture into another folder");
  }
}

// session.json names the map; its pixels have to be the lab's.
void RequireSameMap(const std::filesystem::path& folder, const session::SessionSetup& then,
                    const std::vector<float>& now) {
  const std::string file = (folder / "session.json").string();
  const std::string& name =
      session::Stated(session::Stated(then.camera, "camera", file).vignetting, "vignetting", file);
  if (core::ReadExrImage(session::SessionFile(folder, name, file)).data != now)
    throw InputError((folder / name).string(), "is another vignetting than that of the lab given",
                     "resume with the lab as it was, or capture into another folder");
}

// Nothing to refuse: a camera is mended by its maker, and what that changes is for people to judge.
void WarnOfOtherFirmware(const session::SessionSetup& then, const session::SessionSetup& now) {
  const auto was = then.devices.find(kFirmware), is = now.devices.find(kFirmware);
  if (was != then.devices.end() && is != now.devices.end() && was->second != is->second)
    core::Say(core::Severity::kNote,
              fmt::format("the camera's firmware is {}, the session began with {}: hold the "
                          "references of the new epoch against those before",
                          Shown(is->second), Shown(was->second)));
}

// Frames of one session are of one camera, set up and calibrated in one way.
void RequireSameRig(const std::filesystem::path& folder, const hal::Devices& devices) {
  const std::string file = (folder / "session.json").string();
  const nlohmann::json then = core::ReadJson(file),
                       now = core::ParseJson(DescribeSession(devices).session.dump(), file);
  for (const char* part : {"camera", "calibration"})
    RequireSame(core::Field<nlohmann::json>(then, part, file), now.at(part), part, file);
  if (const auto files = then.find("lab_files"); files != then.end())  // an older one states none
    RequireSame(*files, now.value("lab_files", nlohmann::json::object()), "lab_files", file);
  const session::SessionSetup setup = session::SetupFromJson(then, file);
  if (!devices.rig.camera.vignetting.empty())
    RequireSameMap(folder, setup, devices.rig.camera.vignetting);
  WarnOfOtherFirmware(setup, session::SetupFromJson(now, file));
}

}  // namespace

std::map<std::string, std::string> DescribeDevices(const hal::Devices& devices) {
  std::map<std::string, std::string> roles = {{"camera", devices.camera->identity()},
                                              {"stage", devices.stage->identity()}};
  if (const std::string firmware = devices.camera->firmware(); !firmware.empty())
    roles[kFirmware] = firmware;
  const auto add = [&](const char* role, const auto& device) {
    if (device) roles[role] = device->identity();
  };
  add("trigger", devices.trigger);
  add("shutter", devices.shutter);
  add("print", devices.print);
  add("colour", devices.colour);
  add("monitor", devices.monitor);
  add("supply", devices.supply);
  add("inputs", devices.inputs);
  if (devices.inputs && !devices.inputs->real_time())
    roles["inputs"] += ", without real-time priority";
  return roles;
}

SessionDescription DescribeSession(const hal::Devices& devices) {
  const hal::CameraCapabilities capabilities = devices.camera->capabilities();
  rig::SensorModel sensor = devices.rig.camera;
  sensor.width = capabilities.width;
  sensor.height = capabilities.height;
  sensor.bits = capabilities.bits;
  SessionDescription description;
  session::SessionCamera camera = session::CameraOf(sensor);
  camera.settings = devices.camera_settings;
  if (!sensor.vignetting.empty()) {
    camera.vignetting = "vignetting.exr";
    core::Image map(sensor.width, sensor.height, 1);
    map.data = sensor.vignetting;
    description.files.emplace_back("vignetting.exr", core::ExrImageBytes(map, "vignetting.exr"));
  }
  session::SessionSetup setup;
  setup.camera = std::move(camera);
  setup.image_from_sensor = devices.rig.image_from_sensor;
  setup.lab_files = devices.lab_files;
  setup.devices = DescribeDevices(devices);
  setup.software = {{"name", "luxfield"}, {"version", LUXFIELD_VERSION}};
  description.session = ToJson(setup);
  return description;
}

session::SessionWriter OpenSession(const std::filesystem::path& folder, const nlohmann::json& plan,
                                   const hal::Devices& devices, bool resume) {
  if (resume && session::SessionWriter::HasSession(folder)) {
    session::SessionWriter session = session::SessionWriter::Resume(folder, plan, *devices.clock);
    RequireSameRig(folder, devices);
    return session;
  }
  const SessionDescription description = DescribeSession(devices);
  return session::SessionWriter::Create(folder, plan, description.session, description.files,
                                        *devices.clock);
}

}  // namespace luxfield::capture
