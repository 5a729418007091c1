// Runs kernels on windows over a G-buffer, in batches that bound their scratch memory. Internal to
// estimators/.
#pragma once

#include <map>
#include <span>
#include <string>
#include <utility>
#include <variant>

#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/lights/shadow_maps.h"

namespace luxfield::render {

// What has a window each per receiver, and a table: images, or knot cells on F.
enum class WindowsOf { kImages, kCells };

// Kernels that start with LUMINAIRE_ARGUMENTS, SURFACE_ARGUMENTS, SCENE_ARGUMENTS and
// WINDOW_ARGUMENTS (kernels/luminaire/window_lighting.clh).
class WindowSampler {
 public:
  // `kernel` of the embedded source `path`. With `masses_are_seen` the masses of windows count what
  // shadow maps leave visible.
  WindowSampler(const Device& device, const std::string& path, const std::string& kernel,
                const std::string& build_options = {}, bool masses_are_seen = true,
                WindowsOf windows_of = WindowsOf::kImages);

  // InputError for an option that makes no sense.
  static void CheckOptions(const EstimatorOptions& options);

  // Enqueues the kernel for every pixel; `outputs` are its remaining arguments. InputError if the
  // luminaire has no tables or an option makes no sense.
  template <typename... Outputs>
  void Run(const std::string& estimator, const Receivers& receivers, const PosedLuminaire& posed,
           const EstimatorOptions& options, const Outputs&... outputs) {
    const LightSource source = posed;
    const Buffer none;
    const LightTasks all{std::span(&source, 1), none, 0, receivers.gbuffer.pixel_count()};
    Run(estimator, receivers, all, options, outputs...);
  }
  // The same for the points of `tasks`; without a buffer of them all are lit by the first light.
  template <typename... Outputs>
  void Run(const std::string& estimator, const Receivers& receivers, const LightTasks& tasks,
           const EstimatorOptions& options, const Outputs&... outputs) {
    const auto& [gbuffer, visibility] = receivers;
    Kernel& kernel = Begin(estimator, gbuffer, tasks, options);
    const LuminaireOnDevice& luminaire = LuminaireOf(tasks);
    const Buffer none;
    const DeviceBvh* bvh = visibility.bvh;
    const Buffer &sat = Sat(luminaire), &sat_scale = SatScale(luminaire);
    const Buffer seen = visibility.maps ? visibility.maps->SeeCells(gbuffer) : Buffer();
    while (NextBatch(gbuffer, tasks, seen)) {
      kernel
          .Set(luminaire_params_, sampling_params_, luminaire.images(), sat, sat_scale,
               gbuffer.position, gbuffer.normal, gbuffer.albedo, gbuffer.gloss, gbuffer.eye,
               bvh ? bvh->nodes : none, bvh ? bvh->triangles : none, tasks.tasks, seen, spans_,
               masses_, outputs...)
          .Enqueue(batch_);
    }
  }

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
  EstimatorOptions options_;
  std::size_t next_ = 0, end_ = 0, batch_ = 0, columns_ = 0, rows_ = 0;
  Buffer luminaire_params_, window_params_, sampling_params_, spans_, masses_;
};

}  // namespace luxfield::render
