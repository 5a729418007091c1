// What moves the filter (or the luminaire) over F.
#pragma once

#include <string>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::hal {

using lightfield::Vec2;

struct StageLimits {
  Vec2 min, max;  // metres, of the filter's centre in the luminaire frame
  double speed_m_per_s = 0;
  double settle_s = 0;         // after a move, until vibration is gone
  double repeatability_m = 0;  // rms per axis of one arrival, as its maker states it; 0: unknown
  double resolution_m = 0;     // the read-back is within this of the target; 0: equal

  bool Contain(Vec2 centre_m) const {  // false for what is not a number
    return centre_m.x >= min.x && centre_m.x <= max.x && centre_m.y >= min.y && centre_m.y <= max.y;
  }
};

struct StagePosition {
  Vec2 setpoint;
  Vec2 readback;  // where the encoder says it is
  bool homed = false;
  bool moving = false;
  std::string lost = {};  // what cost the position, until it is homed again; empty: nothing known
};

class Stage {
 public:
  virtual ~Stage() = default;
  virtual std::string identity() const = 0;
  virtual StageLimits limits() const = 0;
  // Finds the reference marks; afterwards Where().homed.
  virtual void Home(double deadline_s) = 0;
  // Returns when the stage stands still at the target and has settled. kOutOfRange beyond the
  // limits, kNotHomed before Home.
  virtual void MoveTo(Vec2 centre_m, double deadline_s) = 0;
  virtual StagePosition Where() = 0;
  // From any thread, and at once: it does not wait for the end of the motion. The Home or MoveTo
  // under way ends with kStopped when the stage stands still; where none is, the next one does,
  // before it moves, so that no stop is lost to a race.
  virtual void Stop() = 0;
};

}  // namespace luxfield::hal
