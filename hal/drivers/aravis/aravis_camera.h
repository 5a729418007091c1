// GigE Vision and USB3 Vision cameras, through aravis 0.8 and GenICam's standard features (SFNC).
//
// The camera runs with a trigger, by software or by a line: one trigger, one frame. Automatic
// exposure and gain are switched off. A frame carries the camera's own exposure time, read back
// when it was set; frames that were in flight before a trigger are thrown away, and the camera's
// block id has to be a new one.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/clock.h"
#include "luxfield/hal/camera.h"
#include "luxfield/hal/deadline_caller.h"
#include "luxfield/hal/trigger.h"

namespace luxfield::hal::aravis {

struct Region {
  int x = 0, y = 0, width = 0, height = 0;

  bool operator==(const Region&) const = default;
};

struct LineTrigger {
  std::string source;                     // the camera's input: "Line0", ...
  std::string activation = "RisingEdge";  // of the input, by the pulse's first edge

  bool operator==(const LineTrigger&) const = default;
};

struct AravisOptions {
  std::string id;  // as `luxfield devices` lists it; empty: the only camera there is
  std::string pixel_format = "Mono16";
  double gain_db = 0;            // the camera's Gain feature, in its own unit (dB with most)
  std::optional<Region> region;  // absent: the whole sensor
  double readout_s = 0.05;       // from the end of an exposure to the next trigger
  std::optional<LineTrigger> line_trigger;  // absent: TriggerSoftware
};

struct AravisDevice {
  std::string id, vendor, model, serial, address, protocol;
};
// Cameras that answer on the network and USB now. Takes about a second.
std::vector<AravisDevice> ListAravisDevices();

class AravisCamera : public Camera {
 public:
  // Waits some seconds for a camera that a killed program still holds.
  // With a line_trigger, `trigger` drives that line. Throws HardwareError: kDisconnected where
  // there is no such camera, kRefused where another program controls it, a setting does not read
  // back or the trigger is missing, kOutOfRange for gain or region.
  AravisCamera(const AravisOptions& options, std::shared_ptr<core::Clock> clock,
               std::shared_ptr<Trigger> trigger = {});
  ~AravisCamera() override;

  std::string identity() const override { return identity_; }
  std::string firmware() const override { return firmware_; }
  CameraCapabilities capabilities() const override { return capabilities_; }
  AppliedSettings Configure(const CameraSettings& settings, double deadline_s) override;
  // kIncomplete where packets stayed lost though they were asked for again, kDisconnected where the
  // camera has not answered its heartbeat.
  Frame Expose(double deadline_s) override;
  // An exposure that waits in another thread ends with kStopped.
  void Abort() override;

 private:
  struct Session;

  std::shared_ptr<core::Clock> clock_;
  std::shared_ptr<Session> session_;
  std::string identity_, firmware_;
  CameraCapabilities capabilities_;
  AppliedSettings applied_;
  std::uint64_t frames_ = 0;
  std::optional<DeadlineCaller> caller_;  // last: ends before what its calls use
};

}  // namespace luxfield::hal::aravis
