// Simulated labs with random geometry, for the calibration of it.
#pragma once

#include <string>

#include "luxfield/hal/sim/lab_description.h"

namespace luxfield {

// lab.toml of a bench whose parts stand beside where it says they do, by amounts of a lab that was
// set up by hand.
std::string RandomBench(bool reflector, std::uint64_t seed);

// The same bench with a colour mosaic before its sensor.
std::string WithMosaic(std::string toml);

hal::sim::LabDescription DescribeBench(const std::string& toml);

}  // namespace luxfield
