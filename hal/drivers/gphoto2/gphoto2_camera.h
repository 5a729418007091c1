// Still cameras over PTP (USB or network), through libgphoto2; their RAW files through LibRaw.
//
// A shutter release is a trigger and a wait for the camera's message of a new file, never the
// library's capture call, which waits for ever for a busy camera. A file is taken for the frame
// that was asked for only if it came after the trigger, differs from the one before, states the
// exposure time that is set, and holds as many pixels of as many colours as the lab says. It is
// deleted in the camera once it is here.
//
// Exposure times are the camera's list of shutter speeds, as it states them: marked speeds differ
// from true ones by up to 7 % (docs/lab.md, "Exposure times"); `merge --estimate-exposures` finds
// the true ratios.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/core/clock.h"
#include "luxfield/hal/camera.h"
#include "luxfield/hal/deadline_caller.h"

namespace luxfield::hal::gphoto2 {

struct Gphoto2Options {
  std::string port;           // "usb:001,004", "ptpip:192.168.1.1"; empty: the only camera on USB
  int width = 0, height = 0;  // of the RAW file's visible pixels
  int bits = 14;
  std::string cfa;                             // rig/cfa.h; empty: no mosaic
  std::string shutter_speed = "shutterspeed";  // libgphoto2's name of the setting
  // Set and read back when the camera is opened, in this order: libgphoto2's name and value.
  std::vector<std::pair<std::string, std::string>> settings;
  double readout_s = 1;  // from the end of an exposure until the file is here
};

struct Gphoto2Device {
  std::string port, model;
  std::string problem;  // why it cannot be opened; empty: it can
};
// Cameras on USB now.
std::vector<Gphoto2Device> ListGphoto2Devices();

class Gphoto2Camera : public Camera {
 public:
  // Throws HardwareError: kDisconnected where there is no such camera, kRefused where another
  // program holds it or a setting does not read back.
  Gphoto2Camera(const Gphoto2Options& options, std::shared_ptr<core::Clock> clock);
  ~Gphoto2Camera() override;

  std::string identity() const override { return identity_; }
  std::string firmware() const override { return firmware_; }
  CameraCapabilities capabilities() const override { return capabilities_; }
  AppliedSettings Configure(const CameraSettings& settings, double deadline_s) override;
  // kIncomplete where the file is damaged or another frame's, kProtocol where it is not what the
  // lab says.
  Frame Expose(double deadline_s) override;
  // An exposure that waits in another thread ends with kStopped. The shutter closes by itself.
  void Abort() override;

 private:
  class Session;

  std::shared_ptr<core::Clock> clock_;
  std::shared_ptr<Session> session_;
  std::string identity_, firmware_;
  CameraCapabilities capabilities_;
  AppliedSettings applied_;
  std::uint64_t frames_ = 0;
  std::optional<DeadlineCaller> caller_;  // last: ends before what its calls use
};

}  // namespace luxfield::hal::gphoto2
