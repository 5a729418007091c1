#include "capture/session_description.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "core/error.h"
#include "core/exr.h"
#include "core/file.h"

namespace luxfield::capture {
namespace {

// The bytes of an image file: sessions write all their files themselves, whole or not at all.
std::string ExrBytes(const core::Image& image) {
  // A folder of our own: nobody can have put a link at the file's name.
  std::string folder = (std::filesystem::temp_directory_path() / "luxfield-XXXXXX").string();
  if (!::mkdtemp(folder.data()))
    throw DeviceError(folder + ": cannot create the folder; free space or set TMPDIR");
  const auto path = std::filesystem::path(folder) / "vignetting.exr";
  core::WriteExrImage(path, image);
  std::string bytes = core::ReadFile(path);
  std::filesystem::remove_all(folder);
  return bytes;
}

}  // namespace

nlohmann::json DescribeDevices(const hal::Devices& devices) {
  nlohmann::json json = {{"camera", devices.camera->identity()},
                         {"stage", devices.stage->identity()}};
  const auto add = [&](const char* role, const auto& device) {
    if (device) json[role] = device->identity();
  };
  add("shutter", devices.shutter);
  add("print", devices.print);
  add("colour", devices.colour);
  add("monitor", devices.monitor);
  add("supply", devices.supply);
  add("inputs", devices.inputs);
  return json;
}

SessionDescription DescribeSession(const hal::Devices& devices) {
  const hal::CameraCapabilities capabilities = devices.camera->capabilities();
  const hal::CameraCalibration& c = devices.rig.camera;
  SessionDescription description;
  nlohmann::json camera = {{"width", capabilities.width},
                           {"height", capabilities.height},
                           {"bits", capabilities.bits},
                           {"black_dn", c.black_dn},
                           {"saturation_dn", c.saturation_dn},
                           {"gain_dn_per_e", c.gain_dn_per_e},
                           {"read_noise_dn", c.read_noise_dn},
                           {"dark_current_e_per_s", c.dark_current_e_per_s},
                           {"prnu", c.prnu},
                           {"responsivity_e_per_s_per_w_m2", c.responsivity_e_per_s_per_w_m2},
                           {"defects", c.defects}};
  if (!c.cfa.empty()) camera["cfa"] = c.cfa;
  if (c.vignetting) {
    camera["vignetting"] = "vignetting.exr";
    description.files.emplace_back("vignetting.exr", ExrBytes(*c.vignetting));
  }
  description.session = {{"camera", camera},
                         {"calibration", {{"image_from_sensor", devices.rig.image_from_sensor}}},
                         {"devices", DescribeDevices(devices)},
                         {"software", {{"name", "luxfield"}, {"version", LUXFIELD_VERSION}}}};
  return description;
}

core::SessionWriter OpenSession(const std::filesystem::path& folder, const nlohmann::json& plan,
                                const hal::Devices& devices, bool resume) {
  if (resume && core::SessionWriter::HasSession(folder))
    return core::SessionWriter::Resume(folder, plan, *devices.clock);
  const SessionDescription description = DescribeSession(devices);
  return core::SessionWriter::Create(folder, plan, description.session, description.files,
                                     *devices.clock);
}

}  // namespace luxfield::capture
