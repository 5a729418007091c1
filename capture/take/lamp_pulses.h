// Whether the lamp pulses, and how often in a second, from bursts of frames where the capture
// begins.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "luxfield/capture/lamp/flicker.h"
#include "luxfield/capture/lamp/lamp_frequency.h"
#include "luxfield/capture/take/capture.h"
#include "luxfield/capture/take/frame_taker.h"

namespace luxfield::capture {

struct LampPulses {
  double exposure_s = 0;  // of the references
  int frames = 0;         // of that exposure
  Scatter scatter;        // of these
  // Where it was measured: by two bursts of other exposures. most_rms: what frames of
  // exposure_s may scatter by for all that those saw, were they begun and ended elsewhere in a
  // period: it falls as 1 / T.
  std::optional<LampFrequency> frequency;
  double most_rms = 0;
};

// Shutter open, the stage there, the first print and colour.
void FaceLamp(FrameTaker& taker, hal::Vec2 centre);

// With the lamp before the camera: a burst of 24 frames of the exposure of `place`, and where that
// scatters by more than `allowed` (rms, relative) or `measure` is set, two more of 48 each, of
// exposures that are no whole multiples of each other, for the frequency. A camera with a list of
// shutter speeds cannot follow a frequency: there it is not measured.
//
// Throws DeviceError where the burst shows no light.
LampPulses LookForPulses(FrameTaker& taker, hal::Devices& devices,
                         const session::FrameRecord& place, double allowed, bool measure);

// The journal's `flicker` (docs/formats/session.md).
nlohmann::json ToJson(const LampPulses& pulses, double stated_hz);

// Throws DeviceError where the measured frequency is neither `stated_hz` nor a multiple of it,
// within five standard errors and the plan's exposure.flicker, relative: exposures of whole periods
// of a frequency that is off by df are off by (df / f) (p / mean p - 1) at most, p the lamp's
// power. And where frames of the plan's own exposures scatter by more than exposure.flicker.
void RequireSteadyFrames(const LampPulses& pulses, double stated_hz,
                         const ExposurePolicy& exposure);

// The plan with the frequency of the rig's lamp in exposure.pwm_hz: measured now, or with
// options.resume that of the session in the folder. Homes the stage and warms the lamp up, and
// leaves it on. Throws as RunCapture does, and DeviceError where the lamp pulses and its frequency
// cannot be told.
Plan WithPwmHz(const Plan& plan, hal::Devices& devices, const std::filesystem::path& folder,
               const CaptureOptions& options);

}  // namespace luxfield::capture
