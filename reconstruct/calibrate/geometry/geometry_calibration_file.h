// `*.cal.json` of a lab's geometry (docs/formats/calibration.md): what `calibrate geometry` writes
// and `merge` takes in place of what the session states.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "luxfield/reconstruct/bracket/session_plan.h"
#include "luxfield/reconstruct/calibrate/geometry/calibrate_geometry.h"

namespace luxfield::reconstruct {

// Equal calibrations give equal bytes; no clock time.
nlohmann::json ToJson(const GeometryCalibration& calibration);
void WriteGeometryCalibration(const std::filesystem::path& path,
                              const GeometryCalibration& calibration);

// Whether the file's `format` says so. Throws InputError for what is no JSON with a format.
bool IsGeometryCalibration(const std::filesystem::path& path);

// Puts the file's delta, image_from_sensor, lens and stage axes in place of the plan's, and its
// tilts beside them (tilt_effect.h: what merging leaves out). Returns the file's SHA-256. Throws
// InputError naming file and field: not such a file, of another version, of a sensor of another
// size or another kind of rig, or with a delta that is 10 % off the plan's: that is another bench.
std::string ApplyGeometryCalibration(const std::filesystem::path& path, SessionPlan& plan);

}  // namespace luxfield::reconstruct
