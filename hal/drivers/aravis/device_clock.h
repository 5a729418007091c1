// The camera's own clock, on the rig's.
#pragma once

#include <cstdint>

namespace luxfield::hal::aravis {

// Frames are stamped by the camera to well below a microsecond of its clock, where the times at
// which triggers are sent and frames arrive jitter by what network and scheduler take. The stamp is
// of the exposure's begin or end, as the camera's maker has it: a constant for equal exposures.
//
// The offset between the clocks is chosen once, and again only where a frame would have begun
// before its trigger was sent or too late to be here: the clocks have drifted apart, or the
// exposure is another. Between, differences of times are the camera's own.
class DeviceClock {
 public:
  // When a frame with this stamp began, on the rig's clock: within [sent_s, latest_s]. Stamp 0: the
  // camera has none.
  double StartOf(std::uint64_t stamp_ns, double sent_s, double latest_s);

 private:
  std::uint64_t anchor_ns_ = 0;  // 0: none yet
  double anchor_s_ = 0;
};

}  // namespace luxfield::hal::aravis
