// Frames of the calibration targets of a session -> where the parts of the lab stand
// (geometry_fit.h).
#pragma once

#include <map>
#include <string>

#include "luxfield/reconstruct/calibrate/geometry/geometry_fit.h"
#include "luxfield/session/session_store.h"

namespace luxfield::reconstruct {

struct GeometryCalibration {
  Geometry geometry;
  GeometryTargets targets;
  std::vector<ChessboardView> views;   // in the order of geometry.residuals
  std::vector<std::string> not_found;  // files whose target was not found
  std::map<std::string, std::string> provenance;
};

// Finds the targets, fits, and where there is a lens finds every corner once more with edges
// straightened by it and fits again. Of a colour mosaic the green pixels are used: the geometry is
// green light's. One frame at a time is in memory. Of session.json the camera's
// noise and defects and the side and pitch of image_from_sensor are used. Throws InputError for a
// session of another kind, and as FitGeometry.
GeometryCalibration CalibrateGeometry(const session::SessionReader& session,
                                      bool check_hashes = true);

}  // namespace luxfield::reconstruct
