// Files that were written of a light field, read back and compared with it in closed form.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "luxfield/core/image.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/formats/lamp_view.h"
#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::formats {

struct ExportCheck {
  std::string judge;  // what the file is compared with, and where
  int receivers = 0;
  // Largest difference of the receivers, of the largest exact value.
  double max_rel_error = 0;
  // Standard deviation of the brightest receiver from counting rays, of the largest value.
  double mc_sigma = 0;
  // What max_rel_error is at most.
  double stated_error = 0;

  // Of rays: sum of (found - exact)^2 / (exact flux x a ray's) over the receivers, and their degrees
  // of freedom, one less than receivers as the total is given.
  double chi_squared = 0;
  int degrees = 0;

  bool holds() const { return max_rel_error <= stated_error; }
};

// The photometric file's intensities in the table's own directions against IntensityOf: what the
// format's digits leave, at most 1e-5.
ExportCheck CheckIntensities(const std::filesystem::path& path, const FarField& written,
                             std::span<const lightfield::PosedLightField> fields,
                             std::optional<double> distance_m);

// The same in 500 directions between the table's, drawn by `seed` in intervals with more than a
// thousandth of the peak: at most the table's interpolation_error().
ExportCheck CheckInterpolation(const std::filesystem::path& path, const FarField& written,
                               std::span<const lightfield::PosedLightField> fields,
                               std::optional<double> distance_m, std::uint64_t seed);

// Rays of equal flux: what crosses 128 patches of a sphere about the lamp, of twice the radius that
// holds its filter planes, against the exact irradiance there,
//
//   Phi = integral I(theta, phi) sin theta dtheta dphi,   I as IntensityOf at the sphere's radius
//
// by Gauss-Legendre quadrature of 3 x 3 nodes on pieces, of 8 degrees at most, that are halved until
// an average patch changes by less than 0.1 %. Patches: 8 zones of equal flux about the light's mean direction, of 16
// sectors. At most: 5 standard deviations of counting, what the last halvings changed, and
// `left_out`, the flux of negative light that rays do not have. Reads a ray at a time. Throws
// InputError where there are less than 25 rays for each patch.
ExportCheck CheckRays(const std::filesystem::path& path,
                      std::span<const lightfield::PosedLightField> fields, double left_out);

// A picture of the lamp, as read back, in (unit) sr^-1 m^-2: the irradiance at the eye that it sums
// to against the exact one,
//
//   E = sum L cos(angle to f) solid angle
//
// At most: 5 standard deviations of the pixels' rays, `step` (half the relative step between the
// format's values), and a tenth of a pixel's angle for the angle's change within pixels. Throws
// InputError naming `file` where the picture does not show the whole lamp.
ExportCheck CheckLampPicture(const core::Image& read, const Eye& eye, double irradiance_sigma,
                             std::span<const lightfield::PosedLightField> fields, double step,
                             const std::string& file);

// Irradiance on a plane, as read back, at 16 pixels with more than a hundredth of the largest value,
// drawn by `seed`, against quadrature of radiance over F at the midpoints of 256 x 256 cells:
//
//   E = sum over fields integral L(u->p) cos(F) max(cos(plane), 0) / r^2 du
//
// At most: `step`, and twice what 128 x 128 cells differ by.
ExportCheck CheckIrradiance(const core::Image& read, const Eye& eye, double width_m,
                            double height_m, std::span<const lightfield::PosedLightField> fields,
                            double step, std::uint64_t seed);

}  // namespace luxfield::formats
