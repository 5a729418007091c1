// Runs an estimator on a list of receivers.
#pragma once

#include <memory>
#include <vector>

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

struct SurfacePoint {
  lightfield::Vec3 p, n;  // float32 values, so that device and judge see the same receiver
};

inline SurfacePoint RoundToFloat(SurfacePoint s) {
  const auto round = [](lightfield::Vec3 v) {
    return lightfield::Vec3{static_cast<float>(v.x), static_cast<float>(v.y),
                            static_cast<float>(v.z)};
  };
  return {round(s.p), round(s.n)};
}

inline GBuffer MakeGBuffer(const Device& device, const std::vector<SurfacePoint>& points,
                           bool glossy = false) {
  GBuffer gbuffer(device, static_cast<int>(points.size()), 1, glossy);
  std::vector<cl_float4> position(points.size()), normal(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto [p, n] = points[k];
    position[k] = {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 1}};
    normal[k] = {{static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z), 0}};
  }
  gbuffer.position.Upload(std::span<const cl_float4>(position));
  gbuffer.normal.Upload(std::span<const cl_float4>(normal));
  return gbuffer;
}

struct Lit {
  std::vector<cl_float4> irradiance;
  std::vector<cl_float4> reflected;  // empty where the G-buffer is Lambertian
  std::vector<float> variance;
  std::vector<cl_uint> samples;
};

// The light of one luminaire on a G-buffer, from zeroed buffers.
inline Lit LightGBuffer(const Device& device, Estimator& estimator, const GBuffer& gbuffer,
                        const LuminaireOnDevice& luminaire, const EstimatorOptions& options = {},
                        const RayScene* rays = nullptr, const scene::Pose& pose = {}) {
  Lighting lighting(device, gbuffer);
  estimator.Light({gbuffer, {.rays = rays}}, PosedLuminaire{luminaire, pose}, options, lighting);
  return {lighting.irradiance.Download<cl_float4>(),
          gbuffer.glossy() ? lighting.reflected.Download<cl_float4>() : std::vector<cl_float4>(),
          lighting.variance.Download<float>(), lighting.samples.Download<cl_uint>()};
}

// One quadrilateral in the plane z = `z`, x from x0 to x1, |y| < 10.
inline std::unique_ptr<RayScene> Blocker(const Device& device, double x0, double x1, double z) {
  scene::Geometry geometry;
  geometry.materials.resize(1);
  scene::AppendQuad({x0, -10, z}, {x1 - x0, 0, 0}, {0, 20, 0}, 0, geometry);
  return MakeRayScene(device, geometry);
}

}  // namespace luxfield::render
