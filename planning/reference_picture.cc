#include "luxfield/planning/reference_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/planning/seen_surfaces.h"
#include "luxfield/render/accuracy/sample_density.h"

namespace luxfield::planning {
namespace {

constexpr std::uint64_t kReferenceSeed = 0x7265666572656e63;  // nobody counts up to it
constexpr int kPilotSamples = 256, kPilotPasses = 8;
constexpr int kPilotShrink = 3;  // of each side
// The pilot that deals out samples, of the picture's size; no pixel gets less than half.
constexpr int kDealSamples = 64, kDealPasses = 8;
constexpr double kLeastDensity = 0.5;
constexpr double kPrudence = 1.5;  // on the pilot's variance, which misses rare bright samples

// The light of the closed form on the surfaces that the renderer sees.
ReferencePicture ClosedForm(const render::LitScene& scene, const render::RenderOptions& picture) {
  const SeenSurfaces seen = SeeSurfaces(scene, picture);
  std::map<const render::LoadedLightField*, lightfield::LightField> fields;
  for (const auto& luminaire : scene.luminaires())
    if (const auto* of = luminaire.light_field.get(); !fields.contains(of))
      fields.emplace(of, of->on_device.Download());
  core::Image radiance(seen.width, seen.height, 3);
  core::ParallelFor(seen.pixel_count(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!seen.hit(i)) continue;
      std::array<double, 3> sum{};
      for (const auto& luminaire : scene.luminaires()) {
        const scene::Pose luminaire_from_world = luminaire.world_from_luminaire.Inverse();
        const auto& p = seen.position[i].s;
        const auto& n = seen.normal[i].s;
        const auto e = lightfield::ExactIrradiance(fields.at(luminaire.light_field.get()),
                                                   luminaire_from_world.Point({p[0], p[1], p[2]}),
                                                   luminaire_from_world.Vector({n[0], n[1], n[2]}));
        for (int c = 0; c < 3; ++c) sum[c] += luminaire.scale[c] * e[c];
      }
      for (int c = 0; c < 3; ++c)
        radiance.plane(c)[i] = static_cast<float>(seen.reflectance(i, c) * sum[c]);
    }
  });
  return MakeReference(radiance, radiance);
}

struct Unbiased {
  std::string estimator;
  double rel_variance = 0;  // of the luminance, mean over the pixels, at kPilotSamples
};

// The unbiased estimator with the least variance times time, from a small picture.
Unbiased BestUnbiased(render::LitScene& scene, render::RenderOptions picture) {
  const bool glossy = scene.geometry().glossy;
  const bool shadows = picture.shadows != render::Shadows::kNone;
  picture.width =
      std::max(1, (picture.width > 0 ? picture.width : scene.camera().width) / kPilotShrink);
  picture.height =
      std::max(1, (picture.height > 0 ? picture.height : scene.camera().height) / kPilotShrink);
  picture.samples_per_pixel = kPilotSamples;
  picture.passes = kPilotPasses;
  Unbiased best;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& traits : render::EstimatorList()) {
    if ((glossy && !traits.any_brdf) || !(shadows ? traits.unbiased_with_shadows : traits.unbiased))
      continue;
    picture.estimator = traits.name;
    render::Renderer renderer(scene, picture);
    renderer.Render();  // compiles
    const render::Frame frame = renderer.Render();
    double variance = 0, luminance = 0;
    for (const float v : frame.variance.data) variance += v;
    for (const float y : core::LuminanceImage(frame.radiance).data) luminance += y;
    if (variance * frame.times.lighting_core_s < least) {
      least = variance * frame.times.lighting_core_s;
      const auto pixels = static_cast<double>(frame.variance.data.size());
      best = {traits.name, luminance > 0 ? variance * pixels / (luminance * luminance) : 0};
    }
  }
  if (best.estimator.empty())
    throw InputError(
        fmt::format("no estimator is unbiased for {}{} surfaces, so there is no "
                    "reference to judge pictures by",
                    shadows ? "shadowed " : "", glossy ? "glossy" : "Lambertian"));
  return best;
}

}  // namespace

ReferencePicture MakeReference(core::Image a, core::Image b) {
  ReferencePicture reference{std::move(a), std::move(b), {}, 0};
  reference.rel_rmse = 0.5 * core::Compare(reference.a, reference.b).rel_rmse;
  reference.mean = reference.a;
  for (std::size_t i = 0; i < reference.mean.data.size(); ++i)
    reference.mean.data[i] = 0.5f * (reference.a.data[i] + reference.b.data[i]);
  return reference;
}

ReferencePicture RenderReference(render::LitScene& scene, const render::RenderOptions& options,
                                 int samples, double rel_rmse) {
  if (options.shadows == render::Shadows::kMaps || options.shadows == render::Shadows::kThesisMaps)
    throw InputError("shadow maps have no reference; ask for one with traced shadows or none");
  render::RenderOptions picture = options;
  picture.antialias = 1;
  picture.seed = kReferenceSeed;
  if (picture.shadows == render::Shadows::kNone && !scene.geometry().glossy)
    return ClosedForm(scene, picture);
  const Unbiased best = BestUnbiased(scene, picture);
  picture.estimator = best.estimator;
  picture.passes = kDealPasses;
  picture.samples_per_pixel = kDealSamples;
  const render::SampleDensity density =
      render::DensityFrom(render::Renderer(scene, picture).Render(), kLeastDensity);
  if (rel_rmse > 0)
    samples =
        static_cast<int>(std::min<double>(samples, kPrudence * density.variance * kPilotSamples *
                                                       best.rel_variance / (rel_rmse * rel_rmse)));
  picture.sample_density = density.density;
  picture.passes = 1;
  picture.samples_per_pixel = std::max(1, samples / 2);
  picture.seed = kReferenceSeed + 1;
  core::Image a = render::Renderer(scene, picture).Render().radiance;
  picture.seed = kReferenceSeed + 2;
  return MakeReference(std::move(a), render::Renderer(scene, picture).Render().radiance);
}

ReferencePicture LuminanceOf(const ReferencePicture& reference) {
  return MakeReference(core::LuminanceImage(reference.a), core::LuminanceImage(reference.b));
}

core::Difference Compare(const core::Image& x, const ReferencePicture& reference) {
  core::Difference difference = core::Compare(x, reference.mean);
  const double mean = difference.mean_reference, eps = 1e-4 * mean * mean;
  double squares = 0, relative = 0;
  for (std::size_t i = 0; i < x.data.size(); ++i) {
    const double square =
        (double{x.data[i]} - reference.a.data[i]) * (double{x.data[i]} - reference.b.data[i]);
    squares += square;
    const double r = reference.mean.data[i];
    if (square != 0) relative += square / (r * r + eps);
  }
  const auto count = static_cast<double>(x.data.size());
  const double rmse = std::sqrt(std::max(squares, 0.0) / count);
  difference.rel_rmse = std::max(mean > 0 ? rmse / mean : 0, reference.rel_rmse);
  difference.rel_mse = std::max(relative / count, 0.0);
  return difference;
}

}  // namespace luxfield::planning
