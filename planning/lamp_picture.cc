#include "luxfield/planning/lamp_picture.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/random.h"
#include "luxfield/planning/seen_surfaces.h"
#include "luxfield/scene/ray_caster.h"

namespace luxfield::planning {
namespace {

using lightfield::Vec2;
using lightfield::Vec3;

constexpr std::uint64_t kStream = 0x7069637475726573;  // of random numbers

Vec3 ToVec3(const cl_float4& v) { return {v.s[0], v.s[1], v.s[2]}; }

// Off the surface by more than single precision moves the point.
Vec3 ShadowOrigin(Vec3 p, Vec3 n) {
  const double size = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  return p + (1e-6 + 1e-5 * size) * n;
}

struct Images {
  core::Image irradiance, radiance, shadowed;
  Images(int width, int height)
      : irradiance(width, height, 3), radiance(width, height, 3), shadowed(width, height, 3) {}
};

}  // namespace

LampPicture TraceLampPicture(const render::LitScene& lit, const scene::Scene& scene,
                             const TracedLamp& lamp, const LampPictureOptions& options) {
  if (lit.geometry().glossy)
    throw InputError(scene.file.string(), "has glossy surfaces, on which the lamp is not traced",
                     "give them Lambertian materials");
  render::RenderOptions size;
  size.width = options.width;
  size.height = options.height;
  const SeenSurfaces seen = SeeSurfaces(lit, size);
  const scene::RayCaster caster(scene.geometry);
  const FibonacciLattice points(options.points);
  Images halves[2] = {{seen.width, seen.height}, {seen.width, seen.height}};
  core::Progress progress("tracing the lamp", static_cast<std::uint64_t>(seen.height));
  core::ParallelFor(seen.pixel_count(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (i % seen.width == 0) {
        core::ThrowIfInterrupted();
        progress.Advance();
      }
      if (!seen.hit(i)) continue;
      core::Random random(options.seed, kStream, static_cast<std::uint32_t>(i));
      const Vec3 p = ToVec3(seen.position[i]), n = ToVec3(seen.normal[i]);
      const Vec3 origin = ShadowOrigin(p, n);
      for (Images& half : halves) {
        TracedLamp::Light sum;
        for (const scene::Luminaire& luminaire : scene.luminaires) {
          const scene::Pose& pose = luminaire.world_from_luminaire;
          const scene::Pose inverse = pose.Inverse();
          const double x = random.Uniform();
          const auto light = lamp.Irradiance(
              {inverse.Point(p), inverse.Vector(n)}, points, {x, random.Uniform()}, [&](Vec2 u) {
                return !caster.Occluded({origin, pose.Point({u.x, u.y, 0}) - origin, 0, 1});
              });
          for (int c = 0; c < 3; ++c) {
            sum.open[c] += luminaire.scale * luminaire.colour[c] * light.open[c];
            sum.seen[c] += luminaire.scale * luminaire.colour[c] * light.seen[c];
          }
        }
        for (int c = 0; c < 3; ++c) {
          half.irradiance.plane(c)[i] = static_cast<float>(sum.open[c]);
          half.radiance.plane(c)[i] = static_cast<float>(seen.reflectance(i, c) * sum.open[c]);
          half.shadowed.plane(c)[i] = static_cast<float>(seen.reflectance(i, c) * sum.seen[c]);
        }
      }
    }
  });
  return {MakeReference(std::move(halves[0].irradiance), std::move(halves[1].irradiance)),
          MakeReference(std::move(halves[0].radiance), std::move(halves[1].radiance)),
          MakeReference(std::move(halves[0].shadowed), std::move(halves[1].shadowed))};
}

StageError ErrorAgainst(const core::Image& image, const ReferencePicture& truth) {
  double square = 0, power = 0;
  for (std::size_t k = 0; k < image.data.size(); ++k) {
    square += (double{image.data[k]} - truth.a.data[k]) * (double{image.data[k]} - truth.b.data[k]);
    power += double{truth.a.data[k]} * truth.b.data[k];
  }
  return {Compare(image, truth).rel_rmse, std::sqrt(std::max(square, 0.0) / power)};
}

}  // namespace luxfield::planning
