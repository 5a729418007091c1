// What plan.json and session.json say that merging needs (docs/formats/session.md).
#pragma once

#include <array>
#include <optional>
#include <string>

#include "luxfield/lightfield/measurements.h"
#include "luxfield/rig/homography.h"
#include "luxfield/rig/lens.h"
#include "luxfield/rig/rig_kind.h"
#include "luxfield/rig/sensor_model.h"
#include "luxfield/session/session_store.h"

namespace luxfield::reconstruct {

// How far planes that merging takes as parallel are from it, as calibrated (geometry_fit.h).
struct TiltedPlanes {
  lightfield::Vec2 filter_tilt_rad;  // about s, then about t
  lightfield::Vec2 stage_slopes;     // along z per metre of the stage's u and v
  double delta_sigma_m = 0;
  double place_sigma_m = 0;  // the largest, of the places on I that the sensor's corners see
};

struct SessionPlan {
  lightfield::LuminaireGeometry geometry;
  lightfield::FilterKind filter = lightfield::FilterKind::kBasis;
  double filter_scale = 1;
  double albedo = 1;  // of the reflector; 1 on the lensless rig
  rig::RigKind rig = rig::RigKind::kLensless;
  rig::Homography image_from_sensor;  // of pixel positions freed from the lens' distortion
  std::optional<rig::Lens> lens;      // from a calibration of the geometry; else none is known
  // How far the filter moves against the luminaire per metre of the stage's read-back along u and
  // v.
  std::array<lightfield::Vec2, 2> stage_axes{{{1, 0}, {0, 1}}};
  std::optional<TiltedPlanes> tilts;  // from a calibration of the geometry
  // exposure.mean_tolerance: by how much the levels of a bracket's frames may differ, relative.
  double level_tolerance = 0.05;
  rig::SensorModel sensor;
};

// Throws InputError naming file, field and value.
SessionPlan ReadSessionPlan(const session::SessionReader& session);

}  // namespace luxfield::reconstruct
