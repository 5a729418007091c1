// What `calibrate sensor` shows: a table on the terminal, a page with plots.
#pragma once

#include <filesystem>

#include "luxfield/reconstruct/calibrate/sensor/calibrate_sensor.h"

namespace luxfield::cli {

void PrintSensorCalibration(const reconstruct::SensorCalibration& calibration);

// The photon transfer curve with its fit, its residuals in standard errors, and the deviation from
// linearity, of every channel.
void WriteSensorReport(const reconstruct::SensorCalibration& calibration,
                       const std::filesystem::path& html);

}  // namespace luxfield::cli
