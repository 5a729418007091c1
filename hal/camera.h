// What a measuring camera is. Linear native numbers only: no demosaicing, no gamma, no noise
// reduction.
//
// In all of hal/ a deadline is an absolute time on the clock of the rig
// (core::Clock::MonotonicSeconds): an operation that has not ended by then throws
// HardwareError(kTimeout). Nothing is retried inside a driver that can move or expose.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "luxfield/session/raw_frame.h"

namespace luxfield::hal {

struct CameraCapabilities {
  int width = 0, height = 0;
  int bits = 16;  // 32: float DN without an ADC (ideal simulated camera)
  double min_exposure_s = 0, max_exposure_s = 0;
  double exposure_step_s = 0;            // exposures are whole multiples; 0: any
  double readout_s = 0;                  // from the end of an exposure to the next possible start
  std::vector<double> exposures_s = {};  // all there are, ascending; empty: any of the above
  double min_gain_db = 0, max_gain_db = 0;  // equal: there is none to set
  // What settings with choices can be, by their names in camera.settings of session.json.
  std::map<std::string, std::vector<std::string>> choices = {};
};

struct CameraSettings {
  double exposure_s = 0;
};

// What the camera says it is set to; `settings_epoch` grows with every change, so that a frame
// taken before it can be told.
struct AppliedSettings {
  double exposure_s = 0;
  std::uint64_t settings_epoch = 0;
};

struct Frame {
  session::RawFrame image;
  AppliedSettings settings;    // those this frame was really taken with
  std::uint64_t frame_id = 0;  // grows with every exposure; the same id twice is a stale frame
  double t_start_s = 0, t_end_s = 0;  // of the exposure, rig clock
  double temperature_c = 0;           // of the sensor; NaN: not measured
};

class Camera {
 public:
  virtual ~Camera() = default;
  virtual std::string identity() const = 0;  // maker, model, serial
  // As the camera tells it; empty: it tells none.
  virtual std::string firmware() const { return {}; }
  virtual CameraCapabilities capabilities() const = 0;
  // Sets and reads back. HardwareError(kOutOfRange) outside the capabilities, kRefused if the
  // camera stays elsewhere.
  virtual AppliedSettings Configure(const CameraSettings& settings, double deadline_s) = 0;
  // One exposure with the applied settings, started after the call.
  virtual Frame Expose(double deadline_s) = 0;
  virtual void Abort() = 0;
};

}  // namespace luxfield::hal
