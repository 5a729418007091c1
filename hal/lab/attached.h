// What is attached to this computer that a driver of this program could take.
#pragma once

#include <vector>

#include "luxfield/hal/drivers/driver.h"

namespace luxfield::hal {

// Cameras on network and USB, USBTMC instruments and GPIO chips. Nothing is moved, lit or exposed,
// and nothing taken from a program that uses it. Takes about a second, for the network.
std::vector<AttachedDevice> AttachedDevices();

}  // namespace luxfield::hal
