// Runs kernels on windows over a G-buffer, in batches that bound their scratch memory. Internal to
// estimators/.
#pragma once

#include <map>
#include <span>
#include <string>
#include <utility>
#include <variant>

#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/estimators/shadow_rays.h"
#include "luxfield/render/lights/shadow_maps.h"

namespace luxfield::render {

// What has a window each per receiver, and a table: images, or knot cells on F.
enum class WindowsOf { kImages, kCells };

// Pixels of a batch.
struct PixelBatch {
  std::size_t first = 0, count = 0;
  const Buffer& sampling;  // SamplingParams of the launch
};

// Kernels that start with LUMINAIRE_ARGUMENTS, SURFACE_ARGUMENTS, SHADOW_RAY_ARGUMENTS,
// TASK_ARGUMENTS and WINDOW_ARGUMENTS (kernels/luminaire/window_lighting.clh).
class WindowSampler {
 public:
  // `kernel` of the embedded source `path`. With `masses_are_seen` the masses of windows count what
  // shadow maps leave visible.
  WindowSampler(const Device& device, const std::string& path, const std::string& kernel,
                const std::string& build_options = {}, bool masses_are_seen = true,
                WindowsOf windows_of = WindowsOf::kImages);

  // InputError for an option that makes no sense.
  static void CheckOptions(const EstimatorOptions& options);

  // Lights the points of `tasks`: enqueues the kernel, whose remaining arguments are
  // `first_outputs`, `lighting` and its light's, traces its shadow rays and adds what arrives. A
  // point gets at most `rays_per_point` of them. InputError if the luminaire has no tables or an
  // option makes no sense.
  template <typename... Outputs>
  void Run(const std::string& estimator, const Receivers& receivers, const LightTasks& tasks,
           const EstimatorOptions& options, int rays_per_point, Lighting& lighting,
           const Outputs&... first_outputs) {
    RunBatches(estimator, receivers, tasks, options, rays_per_point,
               [&](const PixelBatch& batch, auto launch) {
                 launch(first_outputs..., lighting.irradiance, lighting.reflected,
                        lighting.variance, lighting.samples);
                 shadow_.Trace(batch.count);
                 shadow_.AddVisibleLight(batch.first, batch.count, lighting);
               });
  }

  // The same in steps of the caller's: light(batch, launch) is called for every batch, and
  // launch(outputs...) enqueues the kernel with its remaining arguments.
  template <typename Light>
  void RunBatches(const std::string& estimator, const Receivers& receivers, const LightTasks& tasks,
                  const EstimatorOptions& options, int rays_per_point, Light light) {
    const GBuffer& gbuffer = receivers.gbuffer;
    const Visibility& visibility = receivers.visibility;
    const LuminaireOnDevice& luminaire = LuminaireOf(tasks);
    shadow_.Start(visibility.rays, gbuffer.glossy(), static_cast<std::size_t>(rays_per_point),
                  tasks.end - tasks.begin);
    Kernel& kernel = Begin(estimator, gbuffer, tasks, options);
    const Buffer none;
    const Buffer &sat = Sat(luminaire), &sat_scale = SatScale(luminaire);
    const Buffer& own_tasks = tasks.tasks ? *tasks.tasks : none;
    const Buffer seen = visibility.maps ? visibility.maps->SeeCells(gbuffer) : Buffer();
    while (NextBatch(gbuffer, tasks, seen)) {
      const PixelBatch batch{first_, next_ - first_, sampling_params_};
      light(batch, [&](const auto&... outputs) {
        kernel
            .Set(luminaire_params_, sampling_params_, luminaire.images(), sat, sat_scale,
                 gbuffer.position, gbuffer.normal, gbuffer.albedo, gbuffer.gloss, gbuffer.eye,
                 shadow_.rays(), shadow_.ranges(), shadow_.kept(), shadow_.pending(), own_tasks,
                 seen, spans_, masses_, outputs...)
            .Enqueue(batch.count);
      });
    }
  }

  ShadowRays& shadow_rays() { return shadow_; }

 private:
  // Kernels that take tasks, and such as light all points with one light.
  struct WindowKernels {
    WindowKernels(const Device& device, const std::string& build_options);
    Kernel spans, masses;
  };
  static const LuminaireOnDevice& LuminaireOf(const LightTasks& tasks) {
    return std::get<PosedLuminaire>(tasks.lights.front()).luminaire;
  }
  const Buffer& Sat(const LuminaireOnDevice& luminaire) const {
    return windows_of_ == WindowsOf::kCells ? luminaire.cell_sat() : luminaire.sat();
  }
  const Buffer& SatScale(const LuminaireOnDevice& luminaire) const {
    return windows_of_ == WindowsOf::kCells ? luminaire.cell_scale() : luminaire.sat_scale();
  }
  // The kernel for the G-buffer's surfaces, built when first asked for.
  Kernel& Begin(const std::string& estimator, const GBuffer& gbuffer, const LightTasks& tasks,
                const EstimatorOptions& options);
  void UploadParams(const LightTasks& tasks);
  // Enqueues the windows of the next batch; false when all points are done.
  bool NextBatch(const GBuffer& gbuffer, const LightTasks& tasks, const Buffer& seen);

  Device device_;
  std::string path_, kernel_name_, build_options_;
  WindowsOf windows_of_;
  bool masses_are_seen_;
  std::map<bool, WindowKernels> window_kernels_;     // by TASKS
  std::map<std::pair<bool, bool>, Kernel> kernels_;  // by GLOSSY and TASKS
  ShadowRays shadow_;
  EstimatorOptions options_;
  // Batches hold `batch_` points, rows of scratch memory `stride_`; [first_, next_) is under way.
  std::size_t first_ = 0, next_ = 0, end_ = 0, batch_ = 0, stride_ = 0, columns_ = 0, rows_ = 0;
  Buffer luminaire_params_, window_params_, sampling_params_, spans_, masses_;
};

}  // namespace luxfield::render
