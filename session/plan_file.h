// plan.json: what a session is to measure, expanded (docs/formats/session.md, "plan.json"). Plans of
// all kinds are one struct, written and read here alone. Parts that a kind of plan does not have, or
// that an older file does not state, are absent.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "luxfield/lightfield/geometry.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/rig/chessboard.h"
#include "luxfield/rig/filter_sheet.h"
#include "luxfield/rig/rig_kind.h"

namespace luxfield::session {

class SessionReader;

enum class PlanKind { kLightField, kSensor, kGeometry, kGlare, kFilter };
// "light-field", "sensor", "geometry", "glare", "filter".
std::string PlanKindName(PlanKind kind);

// exposure: every kind of plan states some of these.
struct PlannedExposures {
  std::vector<double> ladder_s;  // rising
  std::optional<double> saturation_share, relevant_share, floor_sigmas, mean_tolerance, flicker;
  std::optional<double> pwm_hz;  // that the lamp was measured to have, where the plan asks for it
  std::optional<int> repeats;    // frames of each exposure
  std::optional<int> pairs;      // of flats and of darks; sensor
  std::optional<int> exposures;  // of each print; filter
  std::optional<int> max_attempts;  // of a frame
};

// filter: how the light is filtered.
struct PlannedFilter {
  lightfield::FilterKind kind = lightfield::FilterKind::kBasis;
  double scale = 1;  // above 0: transmittance is scale * Phi; of a dual filter without meaning
};

// rig: the bench that the plan is for.
struct PlannedRig {
  rig::RigKind kind = rig::RigKind::kLensless;
  double albedo = 1;  // of the reflector
};

// positions: where the filter goes, in the order of the visits.
struct PlannedPosition {
  int i = 0, j = 0;
  lightfield::Vec2 centre;  // of the filter, luminaire frame
};

// reference: drift of the lamp.
struct ReferencePolicy {
  int every = 10;  // positions between two drift references; 0: none
  // Relative to the first reference. Beyond it the capture is suspended: it looks again every
  // interval_s, goes on within resume_share of it, and stops after max_wait_s.
  double max_drift = 0.1;
  double resume_share = 0.5;
  double interval_s = 60, max_wait_s = 3600;
};
struct PlannedReference {
  ReferencePolicy policy;
  lightfield::Vec2 place;  // u_m, v_m: where the filter stands meanwhile
};

// warm_up: when the lamp is steady.
struct WarmUpPolicy {
  double window_s = 60, interval_s = 5;
  double variation =
      0.005;  // (largest - smallest) / mean of the monitor's readings over the window
  double max_wait_s = 3600;
};

// stage: what the plan states of it.
struct PlannedStage {
  std::optional<lightfield::Vec2> min_m, max_m;
  std::optional<double> speed_m_per_s;
  std::optional<double> repeatability_m;  // of the lab's; geometry
};

// targets: of a plan of the geometry.
struct PlannedTargets {
  std::optional<rig::Chessboard> board;  // a rig without a lens has none
  rig::Chessboard mask;
  double spacer_m = 0, spacer_shift_m = 0;
};

// views: of plans that show one target after the other.
struct PlannedView {
  std::string target;                        // rig::TargetNames, rig::FilterViewNames
  std::optional<lightfield::Vec2> setpoint;  // of the stage; geometry
};

struct PlanFile {
  PlanKind kind = PlanKind::kLightField;
  std::string name;
  std::optional<int> channels;  // sensor; a light field's are in its geometry
  std::optional<lightfield::LuminaireGeometry> geometry;
  std::optional<PlannedFilter> filter;
  std::optional<PlannedRig> rig;
  std::optional<PlannedExposures> exposure;
  std::optional<PlannedReference> reference;
  std::optional<WarmUpPolicy> warm_up;
  std::optional<int> dark_repeats;
  std::optional<std::vector<PlannedPosition>> positions;
  std::optional<PlannedStage> stage;
  std::optional<PlannedTargets> targets;
  std::optional<rig::FilterSheet> sheet;
  std::optional<std::vector<PlannedView>> views;
};

// Throws InputError naming file, field and value for what is there and wrong (plan_json.h).
PlanFile PlanOf(const SessionReader& session);

}  // namespace luxfield::session
