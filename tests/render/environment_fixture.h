// Synthetic environment maps, and what an environment light does to receivers.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "luxfield/core/random.h"
#include "luxfield/environment/cube_map.h"
#include "luxfield/render/estimators/environment.h"
#include "tests/render/estimator_fixture.h"

namespace luxfield::render {

inline lightfield::Vec3 TexelCentre(int face_size, int face, int row, int column) {
  return Normalized(environment::CubeVector(
      {face, -1 + (2.0 * column + 1) / face_size, 1 - (2.0 * row + 1) / face_size}));
}

inline environment::CubeMap MakeMap(
    int face_size, const std::function<core::Rgb(lightfield::Vec3 direction)>& radiance) {
  environment::CubeMap map(face_size);
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < face_size; ++row)
      for (int column = 0; column < face_size; ++column) {
        const core::Rgb value = radiance(TexelCentre(face_size, face, row, column));
        for (int channel = 0; channel < 3; ++channel)
          map.at(face, row, column, channel) = static_cast<float>(value[channel]);
      }
  return map;
}

// A sky brighter at the horizon, a brown ground, a sun of 2.5 degrees: 99.9 % of a face's energy.
inline environment::CubeMap SunAndSky(int face_size, double sun = 3000) {
  const auto to_sun = Normalized(lightfield::Vec3{0.3, 0.5, 0.8});
  const double cosine = std::cos(2.5 * M_PI / 180);
  return MakeMap(face_size, [=](lightfield::Vec3 w) -> core::Rgb {
    if (w.z < 0) return {0.2, 0.15, 0.1};
    const double glow = Dot(w, to_sun) > cosine ? sun : 0;
    return {0.5 - 0.2 * w.z + glow, 0.7 - 0.1 * w.z + 0.9 * glow, 1.0 + 0.7 * glow};
  });
}

// Every texel of its own, over two decades.
inline environment::CubeMap NoiseMap(int face_size) {
  core::Random random(20140404, 0);
  return MakeMap(face_size, [&](lightfield::Vec3) -> core::Rgb {
    const double y = std::exp(1.2 * random.Normal());
    return {y * random.Uniform(), y, y * random.Uniform()};
  });
}

// Unit vectors spread over the sphere (Fibonacci), rotated so that none is special to the cube.
inline std::vector<lightfield::Vec3> Orientations(int count) {
  std::vector<lightfield::Vec3> normals;
  for (int k = 0; k < count; ++k) {
    const double z = 1 - (2 * k + 1.0) / count, phi = k * M_PI * (3 - std::sqrt(5.0)) + 0.3,
                 r = std::sqrt(1 - z * z);
    normals.push_back({r * std::cos(phi), r * std::sin(phi), z});
  }
  return normals;
}

// Receivers at the origin.
inline GBuffer FacingGBuffer(const Device& device, const std::vector<lightfield::Vec3>& normals,
                             bool glossy = false) {
  std::vector<SurfacePoint> points;
  for (const auto& n : normals) points.push_back(RoundToFloat({{0, 0, 0}, n}));
  return MakeGBuffer(device, points, glossy);
}

inline Lit LightByEnvironment(const Device& device, EnvironmentEstimator& estimator,
                              const GBuffer& gbuffer, const EnvironmentLight& light,
                              const EstimatorOptions& options, const RayScene* rays = nullptr) {
  Lighting lighting(device, gbuffer);
  estimator.Light({gbuffer, {.rays = rays}}, light, options, lighting);
  return {lighting.irradiance.Download<cl_float4>(),
          gbuffer.glossy() ? lighting.reflected.Download<cl_float4>() : std::vector<cl_float4>(),
          lighting.variance.Download<float>(), lighting.samples.Download<cl_uint>()};
}

}  // namespace luxfield::render
