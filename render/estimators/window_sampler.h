// Runs the kernels of kernels/windowed.cl over a G-buffer, in batches that bound their scratch
// memory. Internal to estimators/.
#pragma once

#include <optional>
#include <string>

#include "render/estimators/estimator.h"
#include "render/shadow_maps.h"

namespace luxfield::render {

class WindowSampler {
 public:
  // `kernel`: "Windowed", "Thesis" or "VisibleShare".
  WindowSampler(const Device& device, const std::string& kernel);

  // Enqueues the kernel for every pixel; `outputs` are its arguments behind SAMPLING_ARGUMENTS.
  // InputError if the luminaire has no tables or an option makes no sense.
  template <typename... Outputs>
  void Run(const std::string& estimator, const GBuffer& gbuffer, const Visibility& visibility,
           const LuminaireOnDevice& luminaire, const scene::Pose& world_from_luminaire,
           const EstimatorOptions& options, const Outputs&... outputs) {
    Kernel& kernel = Begin(estimator, gbuffer, luminaire, world_from_luminaire, options);
    const Buffer none;
    const DeviceBvh* bvh = visibility.bvh;
    const Buffer seen = visibility.maps ? visibility.maps->SeeCells(gbuffer) : Buffer();
    while (NextBatch()) {
      kernel
          .Set(luminaire_params_, sampling_params_, luminaire.images(), luminaire.sat(),
               luminaire.sat_scale(), gbuffer.position, gbuffer.normal, gbuffer.albedo,
               gbuffer.gloss, gbuffer.eye, bvh ? bvh->nodes : none, bvh ? bvh->triangles : none,
               seen, scratch_, outputs...)
          .Enqueue(batch_);
    }
  }

 private:
  // The kernel for the G-buffer's surfaces, built when first asked for.
  Kernel& Begin(const std::string& estimator, const GBuffer& gbuffer,
                const LuminaireOnDevice& luminaire, const scene::Pose& world_from_luminaire,
                const EstimatorOptions& options);
  bool NextBatch();  // false when all pixels are enqueued

  Device device_;
  std::string kernel_name_;
  std::optional<Kernel> diffuse_, glossy_;
  EstimatorOptions options_;
  std::size_t pixel_count_ = 0, next_ = 0, batch_ = 0;
  Buffer luminaire_params_, sampling_params_, scratch_;
};

}  // namespace luxfield::render
