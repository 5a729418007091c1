// What the errors of a calibrated geometry do to quantities Q = sum w E (docs/theory.md, "Error
// budget").
//
// The covariance of the fit's parameters, factorised: directions of unit variance, independent of
// each other. Along one the plane distance, the stage's axes and the place on I that a pixel sees
// move together,
//
//   dQ = dQ/ddelta d_delta - sum_m [ dE/dc e_m + sum_k w_mk dE/ds (d_place(s_k - c_m) + e_m) ],
//   e_m = d_axes c_m,
//
// as E was measured behind the true filter at the true place and is taken for the one stated.
// The tilts of the filter plane and of the stage's travel are not in it: merging takes the planes
// as parallel. First order, in double.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "luxfield/lightfield/linear_functional.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/budget/print_sensitivity.h"
#include "luxfield/rig/lens.h"

namespace luxfield::reconstruct {

// One direction, times its standard deviation.
struct GeometryDirection {
  double delta_m = 0;
  std::array<lightfield::Vec2, 2> stage_axes;  // per metre of the stage's u and v
  std::vector<double> parameters;              // all, in the file's order
};

class GeometryUncertainty {
 public:
  // A `*.cal.json` of the geometry (docs/formats/calibration.md). Throws InputError naming file and
  // field.
  explicit GeometryUncertainty(const std::filesystem::path& file);

  const std::vector<GeometryDirection>& directions() const { return directions_; }

  // How far the place on I moves that is seen where q is seen now, along a direction; q from the
  // filter's axis, metres.
  lightfield::Vec2 PlaceError(const GeometryDirection& direction, lightfield::Vec2 q) const;

  // The place on I that the pixel position sees, by the file's own parameters; reflector rig.
  lightfield::Vec2 PlaceOf(lightfield::Vec2 pixel) const;

 private:
  struct Camera;
  Camera CameraOf(const std::vector<double>& parameters) const;

  bool reflector_ = false;
  std::vector<double> values_;
  std::vector<GeometryDirection> directions_;
};

// Variance of Q: weights w of E, per_delta = dQ/ddelta with E as measured.
double GeometryVariance(const GeometryUncertainty& geometry,
                        const lightfield::Measurements& measurements,
                        const lightfield::LightField& coefficients,
                        const lightfield::Weights& weights, const PrintSensitivity& print,
                        double per_delta);

}  // namespace luxfield::reconstruct
