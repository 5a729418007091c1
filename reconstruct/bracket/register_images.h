// Sensor pixels -> the luminaire's image-plane lattice (docs/theory.md 3, "Registration").
//
// The image of filter position ij is in coordinates q from the filter's axis; a sensor pixel covers
// the quadrilateral that image_from_sensor maps its corners to. In the luminaire frame
// s = c_ij + q. A texel's value is the mean over its area,
//
//   E(texel) = sum_p w_p E_p,   w_p = area(texel and pixel p) / area(texel)
//   sigma^2 = sum_p w_p^2 sigma_p^2
//
// and is known only where the sensor covers all of it. Where less than half of it lies on defective
// pixels the mean runs over the rest, and sigma^2 grows by
// (missing share)^2 * 2 * (spread of the rest)^2. Values average over w linearly, so registering
// commutes with the Gram solve.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "luxfield/lightfield/geometry.h"
#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/rig/homography.h"
#include "luxfield/rig/lens.h"

namespace luxfield::reconstruct {

// One channel on the lattice, row-major.
struct RegisteredImage {
  std::vector<float> value, sigma, count;
  std::vector<std::uint32_t> mask;  // lightfield::MeasurementFlag; unknown texels hold 0
};

struct PixelShare {
  std::uint32_t pixel = 0;
  double share = 0;  // of the texel's area, w_p above
};

class Registration {
 public:
  // image_from_sensor: (column, row, 1) with pixel edges at whole numbers ->
  // homogeneous (q_s, q_t, w), metres. Throws InputError if it is singular or sends a part of the
  // sensor through infinity. With a lens the mapping is of pixel positions freed from its
  // distortion; edges of pixels count as straight.
  Registration(const rig::Homography& image_from_sensor, int sensor_width, int sensor_height,
               const lightfield::Lattice& lattice, const std::optional<rig::Lens>& lens = {});

  // Resamples merged pixels, each multiplied by irradiance_per_rate[pixel] (W m^-2 per electron per
  // second; one entry stands for all pixels), for the filter centred on centre_m. Weights are exact
  // polygon areas in double; an axis-aligned mapping is separable, and texel edges within 1e-7
  // pixel of pixel edges count as equal, so aligned lattices are copied exactly. A texel is
  // kOffSensor if more than 1e-6 of it lies off the sensor; it carries kSaturated and kDefect of
  // every pixel it touches with more than that (kPartlyDefect instead of kDefect below half of its
  // area). What too dark pixels sum up to may well be detected: kTooDark is not passed on. Parallel
  // over rows.
  RegisteredImage Apply(const MergedFrame& merged, std::span<const float> irradiance_per_rate,
                        lightfield::Vec2 centre_m) const;

  // The pixels that Apply would take for each texel, defective or not.
  std::vector<std::vector<PixelShare>> Overlaps(lightfield::Vec2 centre_m) const;

 private:
  template <typename Body>
  void ForEachTexel(lightfield::Vec2 centre_m, Body&& body) const;
  void ApplyAligned(const MergedFrame& merged, std::span<const float> irradiance_per_rate,
                    lightfield::Vec2 centre_m, RegisteredImage* image) const;

  rig::Homography image_from_sensor_, sensor_from_image_;
  int sensor_width_, sensor_height_;
  lightfield::Lattice lattice_;
  std::optional<rig::Lens> lens_;
  bool axis_aligned_;
  std::vector<lightfield::Vec2>
      corners_m_;  // q of all pixel corners, (height + 1) x (width + 1); empty if axis-aligned
};

}  // namespace luxfield::reconstruct
