#include "luxfield/render/estimators/sampling_estimators.h"

#include <algorithm>

#include "luxfield/render/estimators/window_sampler.h"

namespace luxfield::render {
namespace {

// A kernel that takes LIGHTING_ARGUMENTS behind the arguments of WindowSampler.
struct KernelSource {
  std::string path, kernel, build_options;
};

// A sampler claims no bias and takes any BRDF and all shadows.
EstimatorTraits TraitsOf(const std::string& name, const TableNeeds& needs,
                         const std::string& guarantee, bool for_comparison = false) {
  return {.name = name,
          .needs = needs,
          .any_brdf = true,
          .map_shadows = true,
          .unbiased = true,
          .unbiased_with_shadows = true,
          .takes_tasks = true,
          .for_comparison = for_comparison,
          .guarantee = guarantee};
}

KernelSource SourceOf(const std::string& name) {
  if (name == "cells") return {"kernels/luminaire/cells.cl", "Cells", ""};
  if (name == "precomputed") return {"kernels/luminaire/precomputed.cl", "Precomputed", ""};
  return {"kernels/luminaire/windowed.cl", "Windowed",
          name == "basis"     ? "-D PROPOSAL=BASIS"
          : name == "uniform" ? "-D PROPOSAL=UNIFORM"
                              : ""};
}

class SamplingEstimator : public Estimator {
 public:
  SamplingEstimator(const Device& device, const EstimatorTraits& traits, const KernelSource& source)
      : traits_(traits),
        sampler_(device, source.path, source.kernel, source.build_options,
                 /*masses_are_seen=*/true,
                 traits.needs.cells ? WindowsOf::kCells : WindowsOf::kImages) {}

  const EstimatorTraits& traits() const override { return traits_; }

  void Light(const Receivers& receivers, const LightSource& source, const EstimatorOptions& options,
             Lighting& lighting) override {
    Light(receivers, AllPoints(source, receivers.gbuffer), options, lighting);
  }

  void Light(const Receivers& receivers, const LightTasks& tasks, const EstimatorOptions& options,
             Lighting& lighting) override {
    for (const LightSource& source : tasks.lights) RequireLuminaire(traits_, source);
    RequireShadows(traits_, receivers.visibility);
    sampler_.Run(traits_.name, receivers, tasks, options, options.samples_per_pixel, lighting);
  }

 private:
  const EstimatorTraits& traits_;
  WindowSampler sampler_;
};

}  // namespace

const std::vector<EstimatorTraits>& SamplingEstimators() {
  static const std::vector<EstimatorTraits> estimators = {
      TraitsOf("windowed", {.sat = true},
               "unbiased for receivers at any distance, with bounded contributions and one shadow "
               "ray per sample"),
      TraitsOf("cells", {.cells = true},
               "unbiased for receivers at any distance, with bounded contributions and one "
               "shadow ray per sample, at a fraction of the variance of windowed; shadow maps "
               "count cell by cell"),
      TraitsOf("basis", {.sat = true},
               "unbiased for receivers at any distance: points drawn from Phi on the filter plane; "
               "nearly free of noise where windows are smaller than a texel, noisy where they hold "
               "structure"),
      TraitsOf("uniform", {.sat = true},
               "a baseline: uniform points in each image's window, images in proportion to their "
               "windows' mass; unbiased, noisy where windows hold structure"),
      TraitsOf("precomputed", {.sat = true},
               "the baseline of precomputed light importance sampling: points drawn from all of C "
               "wherever the receiver is; unbiased but for receivers on the image plane, which get "
               "nothing, and very noisy near it",
               /*for_comparison=*/true)};
  return estimators;
}

std::unique_ptr<Estimator> MakeSamplingEstimator(const std::string& name, const Device& device,
                                                 SamplingKernel kernel) {
  const auto& estimators = SamplingEstimators();
  const auto traits = std::find_if(estimators.begin(), estimators.end(),
                                   [&](const EstimatorTraits& one) { return one.name == name; });
  if (traits == estimators.end()) return nullptr;
  KernelSource source = SourceOf(name);
  if (kernel == SamplingKernel::kDrawsOnly) source.build_options += " -D DRAWS_ONLY=1";
  return std::make_unique<SamplingEstimator>(device, *traits, source);
}

}  // namespace luxfield::render
