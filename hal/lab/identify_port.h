// Which driver a port's device belongs to.
#pragma once

#include <string>
#include <vector>

namespace luxfield::hal {

struct Identification {
  std::string driver;
  bool takes = false;
  std::string what;  // who answered; or why this driver refuses
};

// Asks in every serial protocol that is built in, one after the other, questions that move nothing
// and that the others ignore. Takes up to four seconds: a controller that restarts when its port is
// opened needs two. HardwareError if the port cannot be opened.
std::vector<Identification> IdentifyPort(const std::string& port, int baud);

}  // namespace luxfield::hal
