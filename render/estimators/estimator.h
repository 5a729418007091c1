// Estimators: the light of a source on G-buffer points. Of a measured luminaire (docs/theory.md 6
// and 7),
//   E_n(p) = sum_m delta^2 / z^3 * integral_F C_m(s(u)) Phi_m(u) (n.(u - p))+ V(p, u) du
//   L_o(p) = the same with f_r(w) under the integral,   w = (u - p) / |u - p|,   z = p_z > 0
//
// in the luminaire's frame, n the receiver's normal, V the visibility of u on F from p, f_r the
// BRDF towards the eye. p behind the luminaire (z <= 0) gets nothing. A Lambertian surface of
// albedo rho shows the radiance rho / pi E_n. Of an environment map estimators/environment.h has the
// integral, of any light estimators/mis.h.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "luxfield/render/device/device.h"
#include "luxfield/render/estimators/knobs.h"
#include "luxfield/render/lights/light_source.h"
#include "luxfield/render/scene/gbuffer.h"
#include "luxfield/render/scene/ray_scene.h"

namespace luxfield::render {

struct EstimatorOptions {
  int samples_per_pixel = 200;  // K, for this luminaire
  std::uint64_t seed = 1;       // of the frame
  std::uint32_t stream = 0;  // the luminaire's number: luminaires of one frame draw independently
  float max_samples_per_image = 0;  // K_max of docs/theory.md 6.2; 0: no bound
  float max_error = 2e-3f;          // asked of estimators that approximate without noise, relative
  std::uint32_t first_pixel =
      0;  // added to the pixel number in the random streams (tiles of one picture)
  Knobs knobs{};
};

// Which tables an estimator reads; the renderer builds those that no file holds.
struct TableNeeds {
  bool sat = false;
  bool cells = false;
  bool volume = false;
  bool patches = false;
};

// What an estimator needs and promises; printed by `luxfield render --help` and checked by the
// tests.
struct EstimatorTraits {
  std::string name;
  TableNeeds needs{};              // without shadows
  TableNeeds needs_for_shadows{};  // what traced shadows need besides
  bool any_brdf = false;           // false: Lambertian surfaces only
  // Which visibility it takes, besides none.
  bool traced_shadows = true, map_shadows = false, soft_map_shadows = false;
  bool unbiased = false;  // expectation = E_n(p) and L_o(p), without shadows
  bool unbiased_with_shadows = false;
  bool noise_free = false;   // without shadows
  bool takes_tasks = false;  // LightTasks()
  // Kept to compare with: another estimator is never worse, so that it is taken only where it is named.
  bool for_comparison = false;
  double rel_error = 0;  // bound on the relative RMSE of a noise-free picture; 0: none is known
  // That bound is the error asked for (EstimatorOptions::max_error, the volume's); rel_error is its
  // default.
  bool error_is_asked = false;
  std::string guarantee;  // one sentence
};

// How it is found what stands between a luminaire and the receivers.
enum class Shadows {
  kNone,        // nothing does
  kTraced,      // a ray per light sample
  kMaps,        // shadow maps from the centres of the luminaire's u-cells
  kThesisMaps,  // shadow maps from the cells' reference positions on I
  kSoftMaps,    // shadow maps from patches of the luminaire's filter plane, weighed by their light
};
// "none", "traced", "maps", "thesis-maps", "soft-maps"
std::string ShadowsName(Shadows shadows);
Shadows ShadowsFromName(const std::string& name);  // InputError on other names

class ShadowMaps;    // render/lights/shadow_maps.h
class PatchShadows;  // render/lights/patch_shadows.h

// What a light's shadows are found with: at most one of the three; none: everything is visible.
struct Visibility {
  const RayScene* rays = nullptr;         // rays are traced
  const ShadowMaps* maps = nullptr;       // of this luminaire at this pose; of luminaires alone
  const PatchShadows* patches = nullptr;  // likewise
};

// What is lit.
struct Receivers {
  const GBuffer& gbuffer;
  Visibility visibility{};
};

// Per-pixel sums in device memory that estimators add to.
struct Lighting {
  Buffer irradiance;  // float4: linear Rec. 709 in xyz (a one-channel luminaire adds to all three)
  Buffer reflected;   // float4: radiance towards the eye, likewise; null for a Lambertian G-buffer
  Buffer variance;  // float: estimated variance of the luminance of what was added to `reflected`,
                    // to `irradiance` where that is null
  Buffer samples;   // uint: light samples taken
  // float, no sum: the share of the samples that followed the light where those that follow the
  // BRDF are combined with them, of pixels that hit something (estimators/mis.h). Null: it is not
  // asked for.
  const Buffer* light_share = nullptr;

  Lighting() = default;
  Lighting(const Device& device, const GBuffer& gbuffer);  // zeros, without light_share
  void Clear();                                            // the sums
};

// Points [begin, end) of a G-buffer, each lit by one of several lights with samples of its own.
struct LightTasks {
  // Of one kind; luminaires show the same LuminaireOnDevice. At most kMostLights: kernels read their
  // parameters from constant memory, of which OpenCL promises 64 KiB.
  static constexpr std::size_t kMostLights = 128;
  std::span<const LightSource> lights;
  // LightTask of every point of the G-buffer, kernels/sample/light_task.clh. Null: all are lit by the
  // first light as `options` say.
  const Buffer* tasks = nullptr;
  std::size_t begin = 0, end = 0;
};

// All points of a G-buffer lit by `source`, which the caller keeps.
inline LightTasks AllPoints(const LightSource& source, const GBuffer& gbuffer) {
  return {std::span(&source, 1), nullptr, 0, gbuffer.pixel_count()};
}

class Estimator {
 public:
  virtual ~Estimator() = default;
  virtual const EstimatorTraits& traits() const = 0;

  // Adds the light of `source` for every pixel of the G-buffer that hit something (w != 0); other
  // pixels are left alone. Enqueues on the device's queue and returns. A pixel's result does not
  // depend on work-group sizes or on how pixels are split over calls (for `exact`, whose
  // neighbouring pixels share sums, up to rounding). Throws InputError for a kind of light that the
  // estimator does not take, if tables are needed and absent, the G-buffer is glossy and the
  // estimator's any_brdf is false, its traits do not name the kind of visibility, or options make
  // no sense; DeviceError; Interrupted between batches of shadow rays.
  virtual void Light(const Receivers& receivers, const LightSource& source,
                     const EstimatorOptions& options, Lighting& lighting) = 0;

  // The same for points that each have a task: its light, number of samples, pixel and stream stand
  // for those of `options`, whose samples_per_pixel is the most that a task has. Of shadow maps there
  // is one luminaire's. Throws InputError besides if the estimator's traits do not say takes_tasks.
  virtual void Light(const Receivers& receivers, const LightTasks& tasks,
                     const EstimatorOptions& options, Lighting& lighting);
};

// Throw the InputErrors of Light() for a glossy G-buffer and for shadows it cannot take.
void RequireLambertian(const EstimatorTraits& traits, const GBuffer& gbuffer);
void RequireShadows(const EstimatorTraits& traits, const Visibility& visibility);
void RequireShadows(const EstimatorTraits& traits, Shadows shadows);
// The luminaire that `source` is; throws the InputError of Light() for other kinds.
const PosedLuminaire& RequireLuminaire(const EstimatorTraits& traits, const LightSource& source);
// Likewise.
const EnvironmentLight& RequireEnvironmentLight(const EstimatorTraits& traits,
                                                const LightSource& source);

// A name of EstimatorList(); InputError on other names. Builds the kernels (cached on disk).
std::unique_ptr<Estimator> MakeEstimator(const std::string& name, const Device& device);
// Traits of every estimator, without a device.
std::vector<EstimatorTraits> EstimatorList();

}  // namespace luxfield::render
