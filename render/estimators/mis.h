// Lights a G-buffer with samples of two strategies, those that follow a light and those that follow
// the BRDF (docs/theory.md 9).
//
//   E(n) = integral of L(w) (n . w)+ V(w) dw,   L_o = the same with f_r(w) under the integral
//
// Of samples_per_pixel N, alpha_l N follow the light with density p_l and the rest the BRDF with
// density p_b, for every pixel and light by itself. Options::knobs.strategies:
//
//   strategies     alpha_l   a sample counts
//   balance        1/2       f / (N p), p = alpha_l p_l + (1 - alpha_l) p_b (Veach and Guibas 1995)
//   power          1/2       by the power heuristic, exponent 2
//   maximum        1/2       by the maximum heuristic
//   light, brdf    1, 0      f / (N p_l), f / (N p_b)
//   fixed          given     as balance
//   second-order   chosen    as balance
//   newton         chosen    as balance
//   lobe           by lobe   as power
//   given          the caller's, of every pixel: as balance
//
// By lobe: 1 where the light's density exceeds the largest P of the BRDF's samples, which bounds
// every sample's weight, else 1 - (1 - p_l / P) / 2; 1/2 of lights whose density is uneven,
// environment and luminaires. alpha_l N is a whole number then, and of `given`.
//
// A chosen alpha_l lies in [0.025, 0.975] and comes from a pilot of at most half of the samples,
// drawn half and half; second-order takes the thesis' formula, newton the least second moment of
// the pilot's samples and two more that guard it (kernels/mis/light_share.clh). The pilot counts in
// the result. All are unbiased.
//
// Of lights:
//
//   rectangle     p_l uniform over the solid angle it is seen under, over its area where that is
//                 below 0.01 sr
//   sphere        p_l uniform over its cone
//   classical     points and lines by samples that follow them alone, areas as rectangles
//                 (render/lights/classical_light.h)
//   environment   p_l by its tables, tiles by knobs.environment.balance; samples are the pixel's
//                 own
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/estimators/window_sampler.h"

namespace luxfield::render {

class MisEstimator : public Estimator {
 public:
  explicit MisEstimator(const Device& device) : device_(device), shadow_(device) {}

  const EstimatorTraits& traits() const override;

  // Of any light. Lighting::light_share, if it is not null, receives alpha_l; `given` reads it
  // there. Reads samples_per_pixel, seed, stream, first_pixel, knobs.strategies and
  // knobs.environment. Throws InputError besides for an environment whose tables leave light to
  // BRDF samples where there are none and for sample sets that pixels share, for a luminaire
  // without tables of cells, for a bound of its samples per image, and for a point or linear light
  // lit by the BRDF alone.
  void Light(const Receivers& receivers, const LightSource& source, const EstimatorOptions& options,
             Lighting& lighting) override;
  // Of area lights of one kind, of luminaires, and of classical lights of one distribution that are
  // areas or are not. light_share has to be null.
  void Light(const Receivers& receivers, const LightTasks& tasks, const EstimatorOptions& options,
             Lighting& lighting) override;

 private:
  WindowSampler& SamplerFor(const EstimatorOptions& options);
  void LightBy(const PosedLuminaire& luminaire, const Receivers& receivers,
               const EstimatorOptions& options, Lighting& lighting);
  void LightBy(const AreaLightSource& light, const Receivers& receivers,
               const EstimatorOptions& options, Lighting& lighting);
  void LightBy(const ClassicalLightSource& light, const Receivers& receivers,
               const EstimatorOptions& options, Lighting& lighting);
  void LightByLuminaires(const Receivers& receivers, const LightTasks& tasks,
                         const EstimatorOptions& options, Lighting& lighting);
  void LightByAreas(const Receivers& receivers, const LightTasks& tasks,
                    const EstimatorOptions& options, Lighting& lighting);
  void LightByClassicalLights(const Receivers& receivers, const LightTasks& tasks,
                              const EstimatorOptions& options, Lighting& lighting);
  void LightBy(const EnvironmentLight& light, const Receivers& receivers,
               const EstimatorOptions& options, Lighting& lighting);
  Kernel& KernelFor(const std::string& light, bool glossy, bool has_tasks,
                    const EstimatorOptions& options);

  Kernel& ChooseShares(bool glossy, bool has_tasks);
  // Where a pilot leaves the shares that it chooses, if the caller does not say; null without one.
  Buffer OwnShares(const Receivers& receivers, const EstimatorOptions& options,
                   const Lighting& lighting) const;
  // Lights one batch, the pilot's rays traced before the rest is drawn; its rays are traced then but
  // not added up. launch(shares, first_stage, end_stage) enqueues the kernel.
  template <typename Launch>
  void LightBatch(const PixelBatch& batch, const ShadowRays& shadow, bool glossy,
                  const Buffer* tasks, const EstimatorOptions& options, const Buffer& shares,
                  Launch launch);
  // Lights the points of `tasks` in batches; launch(sampling, shares, first_stage, end_stage) sets a kernel's
  // arguments.
  template <typename Launch>
  void LightBatches(const Receivers& receivers, const LightTasks& tasks,
                    const EstimatorOptions& options, Lighting& lighting, Launch launch);

  // Lights the points of `tasks` with a kernel whose first arguments are `light`.
  template <typename... LightArguments>
  void LightWith(Kernel& kernel, const Receivers& receivers, const LightTasks& tasks,
                 const EstimatorOptions& options, Lighting& lighting,
                 const LightArguments&... light);

  Device device_;
  ShadowRays shadow_;                                              // of lights without windows
  std::map<std::pair<bool, bool>, Kernel> choose_shares_;          // by GLOSSY and TASKS
  std::map<std::pair<std::string, std::string>, Kernel> kernels_;  // by light and build options
  std::map<std::string, WindowSampler> samplers_;                  // of luminaires, by the latter
};

// How the samples that follow the map are shared out to its faces (environment/cube_map.h) by
// TileBalance::kCosine: six numbers a pixel, of sum 1; 0 where nothing was hit and where no lit
// tile is preferred.
std::vector<float> EnvironmentFaceShares(const Device& device, const GBuffer& gbuffer,
                                         const EnvironmentLight& light);

}  // namespace luxfield::render
