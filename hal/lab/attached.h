// What is attached to this computer that a driver of this program could take.
#pragma once

#include <string>
#include <vector>

namespace luxfield::hal {

struct AttachedDevice {
  std::string driver;   // that would take it
  std::string name;     // what lab.toml calls it
  std::string what;     // what it says it is
  std::string refused;  // why it cannot be taken; empty: it can
};

// Cameras on network and USB, USBTMC instruments and GPIO chips. Nothing is moved, lit or exposed,
// and nothing taken from a program that uses it. Takes about a second, for the network.
std::vector<AttachedDevice> AttachedDevices();

}  // namespace luxfield::hal
