// Where the uncertainty of a quantity comes from (docs/theory.md, "Error budget").
//
// Radiance, irradiance and flux are linear in C, C is linear in E, E in the merged pixels, and the
// merged pixels are linear in every small error of the lab: each source is a sum over its
// independent causes of (dQ / d cause)^2 sigma^2, with dQ / d cause by the adjoint of the whole
// chain. What causes share is kept: a dark frame serves all positions, PRNU sits on the same
// pixels, a reference scales every frame after it, one print makes all images.
//
// Of a colour mosaic a frame holds all channels: pixels, exposures, references and places are
// common to them.
//
// Values come from the full solve; sensitivities are those of filters at their planned places,
// which read-backs within a tenth of a spacing change by as much times the relative change of C
// from filter to filter.
//
// First order: errors small enough that their squares do not matter. Arithmetic in double on
// float32 measurements. Memory: per quantity a double per coefficient and per sensor pixel and
// exposure time. The session is merged twice.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/lightfield/measured_filter.h"
#include "luxfield/reconstruct/budget/budget_settings.h"
#include "luxfield/reconstruct/merge/merge_session.h"
#include "luxfield/reconstruct/merge/tilt_effect.h"
#include "luxfield/session/session_store.h"

namespace luxfield::reconstruct {

enum class ErrorSource {
  kPhotonNoise,    // shot noise of the light, in positions and references
  kReadNoise,      // read noise, rounding, shot noise of the dark current, and the averaged darks
  kPrnu,           // the same pixels in every position
  kShutter,        // real exposure times, frame by frame
  kExposureTimes,  // what is common to the frames of one exposure time
  kLampDrift,      // what interpolation between references does not follow
  kMonitor,        // readings of the lamp monitor, where they state the level
  kStage,          // arrivals, of positions and references
  kImageShift,     // image_from_sensor against the filter's axis
  kGeometry,       // what a calibration of the geometry states of itself
  kPrintShift,     // the print in its holder
  kDensity,        // of the print
  kDensityGamma,   //
  kGrain,          //
  kFilterNoise,    // of the photographs of a filter used as measured
  kStrayLight,     //
  kMeter,          // the light meter's readings and calibration
  kMissing,        // what positions that texels did not see leave open (missing_positions.h)
  kBasis,  // what the basis does not resolve of the lamp: basis_truncation.h, or coarser_grids.h
};
constexpr int kErrorSources = 19;

// "photon noise" ...
const char* ErrorSourceName(ErrorSource source);

struct QuantityBudget {
  std::string name, unit;
  double value = 0;
  // Standard deviations in the quantity's unit, by source; absent: its size is not stated.
  std::array<std::optional<double>, kErrorSources> sigma{};

  double Total() const;  // root of the sum of squares of what is stated
  const std::optional<double>& of(ErrorSource source) const {
    return sigma[static_cast<std::size_t>(source)];
  }
};

// The factor that light meter readings ask for: sum R E / sigma^2 over sum E^2 / sigma^2.
struct MeterScale {
  QuantityBudget factor;
  std::vector<double> residuals;  // R / (factor E) - 1 of every reading
  // Of the residuals by the readings' own sigma alone. Far above the degrees: the readings and the
  // session contradict each other beyond it, and the residuals are the better sigma.
  double chi_squared = 0;
  int degrees = 0;
};

struct ErrorBudget {
  std::vector<QuantityBudget> quantities;
  bool basis_estimated = false;  // its row comes from the data; nobody states how fine the lamp is
  std::optional<MeterScale> scale;
  std::optional<TiltEffect> tilt;  // of a calibrated geometry: in no quantity's sigma
};

// `how.observer` must be null. With a filter as measured, its own uncertainties of place and level
// join those that the settings state of the print, and what they do not state of its tone and grain
// is none: both were measured. Throws what merging and solving throw, and InputError for receivers
// that see a part of the filter plane only.
ErrorBudget ComputeErrorBudget(const session::SessionReader& session,
                               const BudgetSettings& settings, const MergeSessionOptions& how = {},
                               const lightfield::MeasuredFilter* filter = nullptr);

}  // namespace luxfield::reconstruct
