#include "study/bench_nearfield.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/measures.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/stopwatch.h"
#include "lightfield/light_vector.h"
#include "preprocess/tables.h"
#include "render/estimators/estimator.h"

namespace luxfield::study {
namespace {

using lightfield::Vec3;

constexpr std::uint64_t kSeed = 11;

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double Bell(double x, double width) { return std::exp(-x * x / (2 * width * width)); }

// Intensity of the low beam in direction (tan right, tan up), 0 .. 1: a flat spread under a horizon
// that rises by 15 degrees on the right, a hot spot below the kink.
double LowBeam(double right, double up) {
  const double horizon = right > 0 ? 0.268 * std::min(right, 0.15) : 0.0;
  const double cut_off = 1 / (1 + std::exp((up - horizon) / 0.004));
  const double spread = 0.1 * Bell(right, 0.35) * Bell(up + 0.07, 0.06);
  const double hot_spot = Bell(right - 0.03, 0.06) * Bell(up + 0.025, 0.02);
  return (0.001 + 0.999 * cut_off) * (spread + hot_spot);
}

struct Hit {
  double t = 1e9;
  Vec3 normal;
};

void HitSphere(Vec3 eye, Vec3 ray, Vec3 centre, double radius, Hit& hit) {
  const Vec3 from = eye - centre;
  const double a = Dot(ray, ray), b = Dot(from, ray), c = Dot(from, from) - radius * radius;
  const double discriminant = b * b - a * c;
  if (discriminant <= 0) return;
  const double t = (-b - std::sqrt(discriminant)) / a;
  if (t > 0 && t < hit.t) hit = {t, (1 / radius) * (from + t * ray)};
}

// The plane axis = at, seen from the side of `normal`.
void HitPlane(double eye, double ray, double at, Vec3 normal, Hit& hit) {
  const double t = (at - eye) / ray;
  if (t > 0 && t < hit.t) hit = {t, normal};
}

// An axis-parallel box by slabs.
void HitBox(Vec3 eye, Vec3 ray, Vec3 low, Vec3 high, Hit& hit) {
  double enter = 0, leave = hit.t;
  Vec3 normal;
  const auto slab = [&](double e, double d, double a, double b, Vec3 axis) {
    const double t0 = (d > 0 ? a - e : b - e) / d, t1 = (d > 0 ? b - e : a - e) / d;
    if (t0 > enter) {
      enter = t0;
      normal = d > 0 ? -1.0 * axis : axis;
    }
    leave = std::min(leave, t1);
  };
  slab(eye.x, ray.x, low.x, high.x, {1, 0, 0});
  slab(eye.y, ray.y, low.y, high.y, {0, 1, 0});
  slab(eye.z, ray.z, low.z, high.z, {0, 0, 1});
  if (enter > 0 && enter < leave) hit = {enter, normal};
}

struct Pixels {
  std::vector<cl_float4> position, normal;
};

// Light of the pixels `chosen` of the reference, 3 channels, in double rounded to float32.
core::Image Reference(const lightfield::LightField& field, const Pixels& pixels,
                      const std::vector<std::size_t>& chosen) {
  core::Image image(static_cast<int>(chosen.size()), 1, 3);
  core::ParallelFor(chosen.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const auto& p = pixels.position[chosen[k]];
      const auto& n = pixels.normal[chosen[k]];
      const auto e =
          lightfield::ExactIrradiance(field, {p.s[0], p.s[1], p.s[2]}, {n.s[0], n.s[1], n.s[2]});
      for (int channel = 0; channel < 3; ++channel)
        image.at(channel, 0, static_cast<int>(k)) = static_cast<float>(e[channel]);
    }
  });
  return image;
}

core::Image Chosen(const std::vector<cl_float4>& irradiance,
                   const std::vector<std::size_t>& chosen) {
  core::Image image(static_cast<int>(chosen.size()), 1, 3);
  for (std::size_t k = 0; k < chosen.size(); ++k)
    for (int channel = 0; channel < 3; ++channel)
      image.at(channel, 0, static_cast<int>(k)) = irradiance[chosen[k]].s[channel];
  return image;
}

struct Timing {
  double wall_s = 0, core_s = 0;
  std::vector<cl_float4> irradiance;
};

Timing Time(const render::Device& device, render::Estimator& estimator,
            const render::GBuffer& gbuffer, const render::LuminaireOnDevice& luminaire,
            int samples_per_pixel, int repeats) {
  render::Lighting lighting(device, gbuffer);
  render::EstimatorOptions options;
  options.samples_per_pixel = samples_per_pixel;
  std::vector<double> wall_s, core_s;
  // The first run compiles and touches memory; it is not timed.
  for (int run = 0; run <= repeats; ++run) {
    lighting.Clear();
    device.Finish();
    const core::Stopwatch stopwatch;
    estimator.Light(gbuffer, {}, luminaire, {}, options, lighting);
    device.Finish();
    if (run == 0) continue;
    wall_s.push_back(stopwatch.WallSeconds());
    core_s.push_back(stopwatch.CoreSeconds());
  }
  return {Median(wall_s), Median(core_s), lighting.irradiance.Download<cl_float4>()};
}

}  // namespace

lightfield::LightField SyntheticCar2(const SyntheticCar2Options& options) {
  if (std::min({options.grid_width, options.grid_height, options.size}) < 1 ||
      (options.channels != 1 && options.channels != 3))
    throw InputError("synthetic car2: grid and size must be at least 1, channels 1 or 3");
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                                          options.grid_width, options.grid_height, 0.0165);
  g.lattice = {options.size, options.size, -0.3, 0.3, 0.6 / options.size, 0.6 / options.size};
  g.channels = options.channels;
  lightfield::LightField field(g);
  core::ParallelFor(g.grid.count(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      const int i = static_cast<int>(m) % options.grid_width,
                j = static_cast<int>(m) / options.grid_width;
      const auto u = g.grid.centre(i, j);
      core::Random random(kSeed, m);
      // A facet of the reflector: its own strength, tilt and white.
      const double strength = 1e4 * Bell(std::hypot(u.x, u.y), 0.07) * (0.5 + random.Uniform());
      const double tilt_right = 0.1 * (random.Uniform() - 0.5),
                   tilt_up = 0.01 * (random.Uniform() - 0.5);
      const double white[3] = {0.9 + 0.2 * random.Uniform(), 1.0, 0.8 + 0.4 * random.Uniform()};
      for (int r = 0; r < options.size; ++r)
        for (int c = 0; c < options.size; ++c) {
          const auto s = g.lattice.centre(r, c);
          const double beam =
              LowBeam((s.x - u.x) / g.delta_m - tilt_right, (s.y - u.y) / g.delta_m - tilt_up);
          const double value = strength * (1e-6 + beam) * (0.98 + 0.04 * random.Uniform());
          for (int channel = 0; channel < options.channels; ++channel)
            field.image(static_cast<int>(m),
                        channel)[static_cast<std::size_t>(r) * options.size + c] =
                static_cast<float>(value * (options.channels == 3 ? white[channel] : 1.0));
        }
    }
  });
  return field;
}

render::GBuffer RoadGBuffer(const render::Device& device, int width, int height) {
  Pixels pixels;
  const std::size_t count = static_cast<std::size_t>(width) * height;
  pixels.position.assign(count, {});
  pixels.normal.assign(count, {});
  const Vec3 eye{0.4, 0.9, -1.5};
  const double pitch = 0.15, half_width = 0.6, half_height = half_width * height / width;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const double right = half_width * (2 * (column + 0.5) / width - 1),
                   up = half_height * (1 - 2 * (row + 0.5) / height);
      const Vec3 ray{right, up * std::cos(pitch) - std::sin(pitch),
                     up * std::sin(pitch) + std::cos(pitch)};
      Hit hit;
      if (ray.y < 0) HitPlane(eye.y, ray.y, -0.65, {0, 1, 0}, hit);
      HitPlane(eye.z, ray.z, 10.3, {0, 0, -1}, hit);
      HitSphere(eye, ray, {-0.25, -0.3, 0.95}, 0.15, hit);
      HitSphere(eye, ray, {0.7, -0.2, 2.5}, 0.35, hit);
      HitSphere(eye, ray, {-1.3, 0.1, 6.0}, 0.7, hit);
      HitBox(eye, ray, {1.0, -0.65, 4.5}, {2.2, 0.4, 5.5}, hit);
      const Vec3 p = eye + hit.t * ray;
      if (hit.t == 1e9 || p.z < 0.5)
        continue;  // the lamp and what is beside it are not part of the bench
      const std::size_t k = static_cast<std::size_t>(row) * width + column;
      pixels.position[k] = {
          {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 1}};
      pixels.normal[k] = {{static_cast<float>(hit.normal.x), static_cast<float>(hit.normal.y),
                           static_cast<float>(hit.normal.z), 0}};
    }
  render::GBuffer gbuffer(device, width, height);
  gbuffer.position.Upload(std::span<const cl_float4>(pixels.position));
  gbuffer.normal.Upload(std::span<const cl_float4>(pixels.normal));
  return gbuffer;
}

nlohmann::json BenchNearfield(const BenchNearfieldOptions& options) {
  if (std::min({options.width, options.height, options.repeats}) < 1 ||
      options.reference_pixels < 0)
    throw InputError(
        "bench nearfield: width, height and repeats must be at least 1, reference pixels at least "
        "0");
  const auto device = render::Device::Open(options.device, options.threads);
  for (const auto& name : options.estimators)
    render::MakeEstimator(name, device);  // refuses unknown names
  const auto field = SyntheticCar2(options.car2);
  const core::Stopwatch stopwatch;
  const auto tables = preprocess::BuildTables(field, "synthetic car2", std::string(64, '0'));
  const double tables_core_s = stopwatch.CoreSeconds();
  const render::LuminaireOnDevice luminaire(device, field, {.sat = &tables});
  const auto gbuffer = RoadGBuffer(device, options.width, options.height);

  const Pixels pixels{gbuffer.position.Download<cl_float4>(), gbuffer.normal.Download<cl_float4>()};
  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < pixels.position.size(); ++k)
    if (pixels.position[k].s[3] != 0) chosen.push_back(k);
  if (options.reference_pixels > 0 &&
      chosen.size() > static_cast<std::size_t>(options.reference_pixels)) {
    core::Random random(kSeed, ~std::uint64_t{0});
    std::shuffle(chosen.begin(), chosen.end(), random);
    chosen.resize(options.reference_pixels);
  }
  const core::Image reference = Reference(field, pixels, chosen);

  nlohmann::json rows = nlohmann::json::array();
  for (const auto& traits : render::EstimatorList()) {
    if (!options.estimators.empty() &&
        std::find(options.estimators.begin(), options.estimators.end(), traits.name) ==
            options.estimators.end())
      continue;
    const auto estimator = render::MakeEstimator(traits.name, device);
    for (const int samples : traits.noise_free ? std::vector<int>{0} : options.samples_per_pixel) {
      const Timing timing =
          Time(device, *estimator, gbuffer, luminaire, std::max(samples, 1), options.repeats);
      const auto difference = core::Compare(Chosen(timing.irradiance, chosen), reference);
      rows.push_back({{"scene", "car2"},
                      {"estimator", traits.name},
                      {"spp", samples},
                      {"width", options.width},
                      {"height", options.height},
                      {"images", field.geometry.grid.count()},
                      {"channels", field.geometry.channels},
                      {"threads", device.info().compute_units},
                      {"build_core_s", traits.needs.sat ? tables_core_s : 0.0},
                      {"fps", 1 / timing.wall_s},
                      {"core_s", timing.core_s},
                      {"rel_rmse", difference.rel_rmse},
                      {"mean_lab", difference.mean_lab},
                      {"bias", difference.bias}});
    }
  }
  return rows;
}

}  // namespace luxfield::study
