#include "luxfield/render/accuracy/car2.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"

namespace luxfield::render {
namespace {

using lightfield::Vec3;

constexpr std::uint64_t kSeed = 11;

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

GBuffer RoadGBuffer(const Device& device, int width, int height) {
  const std::size_t count = static_cast<std::size_t>(width) * height;
  std::vector<cl_float4> position(count), normal(count);
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
      position[k] = {
          {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 1}};
      normal[k] = {{static_cast<float>(hit.normal.x), static_cast<float>(hit.normal.y),
                    static_cast<float>(hit.normal.z), 0}};
    }
  GBuffer gbuffer(device, width, height);
  gbuffer.position.Upload(std::span<const cl_float4>(position));
  gbuffer.normal.Upload(std::span<const cl_float4>(normal));
  return gbuffer;
}

}  // namespace luxfield::render
