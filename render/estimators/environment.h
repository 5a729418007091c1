// Lights a G-buffer with an environment map (docs/theory.md 8).
//
//   E(n) = integral of L(w) (n . w)+ V(w) dw,   L_o = the same with f_r(w) under the integral
#pragma once

#include <map>
#include <string>

#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/estimators/shadow_rays.h"

namespace luxfield::render {

// Of samples_per_pixel N_s, ceil(brdf_share N_s) follow the receiver's BRDF (the cosine where it is
// Lambertian) and the rest the map: N_f of them, a real number, tile f, by `balance`
//
//   cosine    N_f ~ F_f P_f, F_f the pseudo form factor of the tile (thesis chapter 3)
//   uniform   N_f the same for all tiles that are lit
//   energy    N_f ~ P_f
//   none      all are drawn over the whole map at once, one distribution for all pixels
//
// each with the weight clamp(N_f - i, 0, 1), combined by the balance heuristic. Where the shares
// prefer nothing that is lit, the samples of the map are left out. A tile of less than one sample
// costs one: with many tiles more samples are taken (Lighting::samples) than asked for.
//
// `sets` says which samples of a tile a pixel takes: those of all pixels (shared, the thesis'),
// those of every fourth pixel along each axis (interleaved), or its own (scrambled). Shared samples
// show no noise from pixel to pixel, but errors that are alike over the picture. All are unbiased:
// over seeds every sample is uniform in its tile's distribution.
//
// Options::knobs.environment sets all of this, EnvironmentTableOptions of the light the tables.
class EnvironmentEstimator : public Estimator {
 public:
  // `build_options`: "-D COUNT_USEFUL=1" counts only samples that can bring light.
  explicit EnvironmentEstimator(const Device& device, const std::string& build_options = {});

  const EstimatorTraits& traits() const override { return Traits(); }
  static const EstimatorTraits& Traits();

  // Of an environment map. Reads samples_per_pixel, seed, stream, first_pixel and
  // knobs.environment. A pixel's result depends on its number in the picture, not on how pixels are
  // split over calls of full rows. Throws InputError besides for a light whose tables leave
  // something to BRDF samples where there are none.
  void Light(const Receivers& receivers, const LightSource& source, const EstimatorOptions& options,
             Lighting& lighting) override;

 private:
  Kernel& KernelFor(bool glossy);

  Device device_;
  std::string build_options_;
  ShadowRays shadow_;
  Kernel draw_sets_;
  std::map<bool, Kernel> kernels_;  // by GLOSSY
};

}  // namespace luxfield::render
