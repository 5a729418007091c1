// Near-field estimators: irradiance of G-buffer points lit by a measured luminaire (THEORY.md 6 and
// 7).
//
//   E_n(p) = sum_m delta^2 / z^3 * integral_F C_m(s(u)) Phi_m(u) (n.(u - p))+ V(p, u) du,   z = p_z
//   > 0
//
// in the luminaire's frame, n the receiver's normal, V the visibility of u on F from p. p behind
// the luminaire (z <= 0) gets nothing. A Lambertian surface of albedo rho then shows the radiance
// rho / pi E_n.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "lightfield/light_field.h"
#include "preprocess/tables.h"
#include "render/device.h"
#include "render/gbuffer.h"
#include "scene/transform.h"

namespace luxfield::render {

// The coefficient images and, where given, the tables of one luminaire, uploaded once. Texels are
// padded on the right so that wide loads stay inside the buffer.
class LuminaireOnDevice {
 public:
  static constexpr int kRowPadding = 32;

  // `tables` may be null; CheckTables must have accepted them. Throws InputError if the device
  // cannot hold the images.
  LuminaireOnDevice(const Device& device, const lightfield::LightField& field,
                    const preprocess::Tables* tables);

  const lightfield::LuminaireGeometry& geometry() const { return geometry_; }
  // float C[((m * channels + channel) * height + row) * row_stride + column], zero in the padding.
  const Buffer& images() const { return images_; }
  int row_stride() const { return row_stride_; }
  bool has_tables() const { return static_cast<bool>(sat_); }
  // ulong S[(m * (height + 1) + row) * (width + 1) + column] (preprocess::Tables::sat), and for
  // each image float 2^(62 - exponent): mass = S * 2^-62 * scale.
  const Buffer& sat() const { return sat_; }
  const Buffer& sat_scale() const { return sat_scale_; }

 private:
  lightfield::LuminaireGeometry geometry_;
  int row_stride_ = 0;
  Buffer images_, sat_, sat_scale_;
};

struct EstimatorOptions {
  int samples_per_pixel = 200;  // K, for this luminaire
  std::uint64_t seed = 1;       // of the frame
  std::uint32_t stream = 0;  // the luminaire's number: luminaires of one frame draw independently
  float max_samples_per_image = 0;  // K_max of THEORY.md 6.2; 0: no bound
  std::uint32_t first_pixel =
      0;  // added to the pixel number in the random streams (tiles of one picture)
};

// What an estimator promises; printed by `luxfield render --help` and checked by the tests.
struct EstimatorTraits {
  std::string name;
  bool needs_tables = false;  // without shadows
  bool needs_tables_for_shadows = false;
  bool needs_non_negative = false;  // C >= 0 (tables imply it)
  bool unbiased = false;            // expectation = E_n(p), without shadows
  bool unbiased_with_shadows = false;
  bool noise_free = false;  // without shadows
  std::string guarantee;    // one sentence
};

class Estimator {
 public:
  virtual ~Estimator() = default;
  virtual const EstimatorTraits& traits() const = 0;

  // Adds the luminaire's light for every pixel of the G-buffer that hit something (w != 0); other
  // pixels are left alone.
  //   irradiance  float4 per pixel, linear Rec. 709 in .xyz (a one-channel luminaire adds to all
  //   three), .w untouched variance    float per pixel: estimated variance of the luminance of what
  //   was added samples     uint per pixel: light samples taken
  // `bvh` null: no shadows. Enqueues on the device's queue and returns. A pixel's result does not
  // depend on work-group sizes or on how pixels are split over calls (for `exact`, whose
  // neighbouring pixels share sums, up to rounding). Throws InputError if tables are needed and
  // absent, DeviceError.
  virtual void Light(const GBuffer& gbuffer, const DeviceBvh* bvh,
                     const LuminaireOnDevice& luminaire, const scene::Pose& world_from_luminaire,
                     const EstimatorOptions& options, Buffer& irradiance, Buffer& variance,
                     Buffer& samples) = 0;
};

// "exact", "windowed", "thesis"; InputError on other names. Builds the kernels (cached on disk).
std::unique_ptr<Estimator> MakeEstimator(const std::string& name, const Device& device);
// Traits of every estimator, without a device.
std::vector<EstimatorTraits> EstimatorList();

}  // namespace luxfield::render
