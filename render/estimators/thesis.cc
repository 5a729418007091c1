#include "luxfield/render/estimators/thesis.h"

#include "luxfield/render/estimators/sequences.h"
#include "luxfield/render/estimators/window_sampler.h"

namespace luxfield::render {
namespace {

class Thesis : public Estimator {
 public:
  explicit Thesis(const Device& device)
      : device_(device), sampler_(device, "kernels/luminaire/thesis.cl", "Thesis", {}, false) {}

  const EstimatorTraits& traits() const override { return ThesisTraits(); }

  void Light(const Receivers& receivers, const LightSource& source, const EstimatorOptions& options,
             Lighting& lighting) override {
    Light(receivers, AllPoints(source, receivers.gbuffer), options, lighting);
  }

  void Light(const Receivers& receivers, const LightTasks& tasks, const EstimatorOptions& options,
             Lighting& lighting) override {
    for (const LightSource& source : tasks.lights) RequireLuminaire(traits(), source);
    RequireShadows(traits(), receivers.visibility);
    WindowSampler::CheckOptions(options);
    sampler_.Run(traits().name, receivers, tasks, options, MostRays(options), lighting,
                 SequenceFor(options));
  }

 private:
  // Rounding makes at most 2 x samples of an image's share x.
  static int MostRays(const EstimatorOptions& options) { return 2 * options.samples_per_pixel; }
  // An image gets K samples at most, and one more where systematic sums round up.
  Buffer SequenceFor(const EstimatorOptions& options) const {
    return Buffer::From(
        device_, MakeSequence(options.knobs.sequence, options.samples_per_pixel + 1, options.seed));
  }

  Device device_;
  WindowSampler sampler_;
};

}  // namespace

const EstimatorTraits& ThesisTraits() {
  static const EstimatorTraits traits{
      .name = "thesis",
      .needs = {.sat = true},
      .any_brdf = true,
      .map_shadows = true,
      .takes_tasks = true,
      .guarantee =
          "the estimator as the thesis prints it, a baseline: biased by tens of per cent on "
          "structured images; the variance it reports does not contain the bias"};
  return traits;
}

std::unique_ptr<Estimator> MakeThesis(const Device& device) {
  return std::make_unique<Thesis>(device);
}

}  // namespace luxfield::render
