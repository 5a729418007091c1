// A line of its own by which a camera is made to expose.
#pragma once

#include <string>

namespace luxfield::hal {

class Trigger {
 public:
  virtual ~Trigger() = default;
  virtual std::string identity() const = 0;
  // One pulse, from its first edge to its last; the line rests afterwards, whatever happened.
  // kTimeout where it could not end by the deadline: none is given then. kRefused where the line
  // does not follow.
  virtual void Pulse(double deadline_s) = 0;
};

}  // namespace luxfield::hal
