// Runs an estimator on a list of receivers.
#pragma once

#include <vector>

#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/kernels/scene/bvh_types.clh"

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
                        const DeviceBvh* bvh = nullptr, const scene::Pose& pose = {}) {
  Lighting lighting(device, gbuffer);
  estimator.Light({gbuffer, {.bvh = bvh}}, PosedLuminaire{luminaire, pose}, options, lighting);
  return {lighting.irradiance.Download<cl_float4>(),
          gbuffer.glossy() ? lighting.reflected.Download<cl_float4>() : std::vector<cl_float4>(),
          lighting.variance.Download<float>(), lighting.samples.Download<cl_uint>()};
}

// One quadrilateral in the plane z = `z`, x from x0 to x1, |y| < 10, as a BVH of one leaf.
inline DeviceBvh Blocker(const Device& device, float x0, float x1, float z) {
  BvhNode node{};
  node.lower0[0] = x0;
  node.upper0[0] = x1;
  node.lower0[1] = -10;
  node.upper0[1] = 10;
  node.lower0[2] = node.upper0[2] = z;
  node.child0 = ~(0 * 16 + 2);
  for (int axis = 0; axis < 3; ++axis) {
    node.lower1[axis] = 1;  // empty
    node.upper1[axis] = -1;
  }
  node.child1 = ~0;
  const BvhTriangle triangles[2] = {{{x0, -10, z}, 0, {x1, -10, z}, 0, {x0, 10, z}, 0},
                                    {{x1, -10, z}, 1, {x1, 10, z}, 0, {x0, 10, z}, 0}};
  return {Buffer::From(device, std::span<const BvhNode>(&node, 1)),
          Buffer::From(device, std::span<const BvhTriangle>(triangles))};
}

}  // namespace luxfield::render
