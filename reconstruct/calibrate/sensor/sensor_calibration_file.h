// `*.cal.json` of a sensor (docs/formats/calibration.md): what `calibrate sensor` writes and
// `merge` takes in place of the session's stated figures.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "luxfield/reconstruct/calibrate/sensor/calibrate_sensor.h"
#include "luxfield/rig/sensor_model.h"

namespace luxfield::reconstruct {

// Equal calibrations give equal bytes; no clock time.
nlohmann::json ToJson(const SensorCalibration& calibration);
void WriteSensorCalibration(const std::filesystem::path& path,
                            const SensorCalibration& calibration);

// Puts the file's gain, read noise, black level, dark current, PRNU and, where it was measured,
// saturation in place of the sensor's own; a dark current below 0 within its error becomes 0, and
// the file's hot and dead pixels join the sensor's defects. Responsivity (electrons per second at 1
// W m^-2) and vignetting stay. Returns the file's SHA-256. Throws InputError naming file and field:
// not such a file, of another version, or of a camera with another size or number of bits.
std::string ApplySensorCalibration(const std::filesystem::path& path, rig::SensorModel& sensor);

}  // namespace luxfield::reconstruct
