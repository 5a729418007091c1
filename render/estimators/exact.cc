#include "luxfield/render/estimators/exact.h"

#include <optional>

#include "luxfield/render/estimators/visible_share.h"
#include "luxfield/render/lights/luminaire_params.h"
#include "luxfield/render/lights/shadow_maps.h"

namespace luxfield::render {
namespace {

// Of pixels that cores light one after another.
constexpr int kTileRows = 32;

class Exact : public Estimator {
 public:
  explicit Exact(const Device& device)
      : device_(device), all_seen_(device, "-D SHADOW_MAPS=0"), share_(device) {}

  const EstimatorTraits& traits() const override { return ExactTraits(); }

  void Light(const Receivers& receivers, const LightSource& source, const EstimatorOptions& options,
             Lighting& lighting) override {
    const PosedLuminaire& posed = RequireLuminaire(traits(), source);
    const auto& [luminaire, world_from_luminaire] = posed;
    const auto& [gbuffer, visibility] = receivers;
    RequireLambertian(traits(), gbuffer);
    RequireShadows(traits(), visibility);
    const LuminaireParams params =
        MakeLuminaireParams(luminaire.geometry(), luminaire.row_stride(), world_from_luminaire);
    const Buffer device_params =
        Buffer::From(device_, std::span<const LuminaireParams>(&params, 1));
    const Buffer share =
        share_.Trace(traits().name, receivers, posed, options, lighting.samples).irradiance;
    Buffer seen;  // by shadow maps; null: everything is visible
    if (visibility.maps) {
      seen = visibility.maps->SeeCells(gbuffer);
      if (!by_maps_) by_maps_.emplace(device_, "-D SHADOW_MAPS=1");
    }
    Kernels& kernels = visibility.maps ? *by_maps_ : all_seen_;
    const auto count = static_cast<cl_int>(gbuffer.pixel_count());
    const auto whole_times = [](int parts, int of) {
      return static_cast<std::size_t>((parts + of - 1) / of);
    };
    kernels.whole
        .Set(device_params, luminaire.images(), gbuffer.position, gbuffer.normal,
             cl_int{gbuffer.width}, cl_int{gbuffer.height}, cl_int{kTileRows}, share, seen,
             lighting.irradiance, lighting.variance)
        .Enqueue(whole_times(gbuffer.width, device_.tuning().pixels_per_item) *
                 whole_times(gbuffer.height, kTileRows) * kTileRows);
    kernels.cut
        .Set(device_params, luminaire.images(), gbuffer.position, gbuffer.normal, count, share,
             seen, lighting.irradiance, lighting.variance)
        .Enqueue(gbuffer.pixel_count());
  }

 private:
  struct Kernels {
    Program program;
    Kernel whole, cut;
    Kernels(const Device& device, const std::string& options)
        : program(Program::Build(device, "kernels/luminaire/exact.cl", options)),
          whole(program, "ExactIrradiance"),
          cut(program, "ExactCutIrradiance") {}
  };

  Device device_;
  Kernels all_seen_;
  std::optional<Kernels> by_maps_;  // built when they are first used
  VisibleShare share_;
};

}  // namespace

const EstimatorTraits& ExactTraits() {
  static const EstimatorTraits traits{
      .name = "exact",
      .needs_for_shadows = {.cells = true},
      .map_shadows = true,
      .unbiased = true,
      .noise_free = true,
      .rel_error = 1e-5,
      .guarantee =
          "irradiance in closed form, error below 1e-5 of |J| from 0.05 to 100 m; traced shadows "
          "scale it by the share of light samples that see the receiver, a consistent but not "
          "unbiased ratio; shadow maps scale each image by its visibility, without noise"};
  return traits;
}

std::unique_ptr<Estimator> MakeExact(const Device& device) {
  return std::make_unique<Exact>(device);
}

}  // namespace luxfield::render
