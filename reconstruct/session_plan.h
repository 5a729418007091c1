// What plan.json and session.json say that merging needs (docs/formats/session.md).
#pragma once

#include <array>

#include "core/session_store.h"
#include "lightfield/measurements.h"
#include "reconstruct/noise_model.h"

namespace luxfield::reconstruct {

struct SessionPlan {
  lightfield::LuminaireGeometry geometry;
  lightfield::FilterKind filter = lightfield::FilterKind::kBasis;
  double filter_scale = 1;
  double albedo = 1;  // of the reflector; 1 on the lensless rig
  std::array<double, 9> image_from_sensor{};
  SensorModel sensor;
};

// Throws InputError naming file, field and value.
SessionPlan ReadSessionPlan(const core::SessionReader& session);

}  // namespace luxfield::reconstruct
