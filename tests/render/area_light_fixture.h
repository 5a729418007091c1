// Rectangular and spherical lights in closed form, and receivers around them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "luxfield/environment/spherical_polygon.h"
#include "luxfield/render/estimators/mis.h"
#include "tests/render/sampling_fixture.h"

namespace luxfield::render {

inline scene::AreaLight Rectangle(double width, double height, const scene::Pose& pose) {
  scene::AreaLight light;
  light.radiance = {3, 2, 1};
  light.width_m = width;
  light.height_m = height;
  light.world_from_light = pose;
  return light;
}

inline scene::AreaLight Sphere(double radius, scene::Vec3 centre) {
  scene::AreaLight light;
  light.kind = scene::AreaLightKind::kSphere;
  light.radiance = {1, 2, 3};
  light.radius_m = radius;
  light.world_from_light = scene::Translation(centre);
  return light;
}

inline double Luminance(const scene::AreaLight& light) { return Luminance(light.radiance); }

// The rectangle's corners from p on, empty behind it.
inline std::vector<lightfield::Vec3> CornersFrom(const scene::AreaLight& light,
                                                 lightfield::Vec3 p) {
  if (!(light.world_from_light.Inverse().Point(p).z > 0)) return {};
  const double x = light.width_m / 2, y = light.height_m / 2;
  std::vector<lightfield::Vec3> corners;
  for (const auto& [cx, cy] :
       {std::pair{-x, -y}, std::pair{-x, y}, std::pair{x, y}, std::pair{x, -y}})
    corners.push_back(light.world_from_light.Point({cx, cy, 0}) - p);
  return corners;
}

// integral of (n . w)+ dw over a cone around `axis` (unit), by Simpson's rule over the angle to the
// axis and in closed form around it. 1e-9 relative.
inline double ConeIrradiance(lightfield::Vec3 axis, double half_angle, lightfield::Vec3 n) {
  const double cosine = Dot(axis, n), sine = Length(Cross(axis, n));
  const auto ring = [&](double angle) {
    const double a = cosine * std::cos(angle), b = sine * std::sin(angle);
    if (a >= b) return 2 * std::numbers::pi * a * std::sin(angle);
    if (a <= -b) return 0.0;
    const double psi = std::acos(-a / b);
    return 2 * (a * psi + b * std::sin(psi)) * std::sin(angle);
  };
  constexpr int kSteps = 20000;
  double sum = 0;
  for (int k = 0; k <= kSteps; ++k)
    sum += (k == 0 || k == kSteps ? 1 : k % 2 ? 4 : 2) * ring(half_angle * k / kSteps);
  return sum * half_angle / kSteps / 3;
}

// Luminance of the irradiance: Lambert's polygon formula above the horizon; pi L (r/d)^2 cos of a
// sphere above it, else by ConeIrradiance.
inline double ExactIrradiance(const scene::AreaLight& light, const SurfacePoint& receiver) {
  const auto [p, n] = receiver;
  if (light.kind == scene::AreaLightKind::kRectangle) {
    const auto corners = CornersFrom(light, p);
    std::vector<lightfield::Vec3> above;
    environment::ClipByPlane(corners, n, above);
    return Luminance(light) * std::abs(Dot(n, environment::PolygonVectorIrradiance(above)));
  }
  const auto to_centre = light.world_from_light.translation - p;
  const double d = Length(to_centre), s = light.radius_m / d;
  if (s >= 1) return 0;
  const auto axis = (1 / d) * to_centre;
  const double cosine = Dot(axis, n);
  if (cosine >= s) return Luminance(light) * std::numbers::pi * s * s * cosine / Length(n);
  return Luminance(light) * ConeIrradiance(axis, std::asin(s), n);
}

// Receivers, `copies` of each: pixels draw samples of their own.
inline std::vector<SurfacePoint> Repeated(const std::vector<SurfacePoint>& points, int copies) {
  std::vector<SurfacePoint> all;
  for (const auto& point : points) all.insert(all.end(), copies, point);
  return all;
}

// Mean over copies, and its standard error, of the luminance.
inline SeedStatistics OverCopies(const std::vector<cl_float4>& values,
                                 const std::vector<float>& variance, int copies) {
  SeedStatistics statistics;
  for (std::size_t first = 0; first < values.size(); first += copies) {
    double mean = 0, squares = 0, stated = 0;
    for (int copy = 0; copy < copies; ++copy) {
      const double difference = Luminance(values[first + copy]) - mean;
      mean += difference / (copy + 1);
      squares += difference * (Luminance(values[first + copy]) - mean);
      stated += double{variance[first + copy]} / copies;
    }
    statistics.mean.push_back(mean);
    statistics.standard_error.push_back(std::sqrt(squares / (copies - 1.0) / copies));
    statistics.reported_variance.push_back(stated);
  }
  return statistics;
}

inline Lit LightByArea(const Device& device, MisEstimator& estimator, const GBuffer& gbuffer,
                       const scene::AreaLight& light, const EstimatorOptions& options,
                       const RayScene* rays = nullptr, const Buffer* light_share = nullptr) {
  Lighting lighting(device, gbuffer);
  lighting.light_share = light_share;
  const AreaLightSource source = MakeAreaLight(light);
  estimator.Light({gbuffer, {.rays = rays}}, source, options, lighting);
  return {lighting.irradiance.Download<cl_float4>(),
          gbuffer.glossy() ? lighting.reflected.Download<cl_float4>() : std::vector<cl_float4>(),
          lighting.variance.Download<float>(), lighting.samples.Download<cl_uint>()};
}

inline std::vector<Strategies> AllStrategies() {
  using enum Strategies;
  return {kBalance, kPower, kMaximum, kLight, kBrdf, kFixed, kSecondOrder, kNewton, kLobe};
}

inline EstimatorOptions WithStrategies(Strategies strategies, int samples) {
  EstimatorOptions options;
  options.samples_per_pixel = samples;
  options.seed = kSamplingSeed;
  options.knobs.strategies.strategies = strategies;
  options.knobs.strategies.light_share = 0.2f;
  return options;
}

}  // namespace luxfield::render
