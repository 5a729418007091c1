// budget.toml (docs/formats/budget.md): which quantities, and how large the errors are that a
// session cannot know.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/config.h"
#include "luxfield/lightfield/geometry.h"

namespace luxfield::reconstruct {

// Standard deviations; absent: nobody states it.
struct ErrorSizes {
  std::optional<double> shutter_jitter_s;
  std::optional<double> exposure_time_s;  // of each exposure time, in all its frames
  std::optional<double> lamp_wander;      // relative, covariance lamp_wander^2 cos(2 pi t / period)
  double lamp_wander_period_s = 0;
  std::optional<double> monitor;  // relative, per reading
  std::optional<double> stage_m;  // per axis and arrival
  std::optional<double> image_shift_m, print_shift_m;
  std::optional<double> density, density_gamma;
  std::optional<double> grain;  // relative
  double grain_area_m2 = 0;     // integral of its autocorrelation
  std::optional<double> stray_share;
  std::optional<double> smallest_spot_m;  // of the lamp on F: what the basis may lose of it
  // Without smallest_spot_m: from coarser grids (coarser_grids.h); false where the lamp is known to
  // lie in the span of the basis.
  bool estimate_basis = true;
};

struct RayAsked {
  std::string name;
  lightfield::Vec2 u_m, s_m;
};

struct ReceiverAsked {
  std::string name;
  lightfield::Vec3 p_m, normal{0, 0, -1};  // unit
};

struct MeterReading {
  ReceiverAsked at;
  double value = 0, sigma = 0;
};

struct Meter {
  double calibration = 0;  // relative, common to all readings
  // As the lab writes them; for the report.
  std::string serial_number, calibration_date, v_lambda;
  std::vector<MeterReading> readings;
};

struct BudgetSettings {
  ErrorSizes sizes;
  std::vector<RayAsked> rays;
  std::vector<ReceiverAsked> receivers;
  std::optional<Meter> meter;
};

// Throws InputError naming file and field.
BudgetSettings ReadBudgetSettings(const core::Config& config);

}  // namespace luxfield::reconstruct
