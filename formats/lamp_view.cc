#include "luxfield/formats/lamp_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::formats {
namespace {

using lightfield::Cross;
using lightfield::Dot;
using lightfield::Length;
using lightfield::Normalized;
using lightfield::PosedLightField;
using lightfield::Vec3;

constexpr double kPi = std::numbers::pi, kDegree = kPi / 180;

// f, r and t of the header.
struct Axes {
  Vec3 forward, right, top;

  explicit Axes(const Eye& eye)
      : forward(Normalized(eye.look_at_m - eye.position_m)),
        right(Normalized(Cross(forward, eye.up))),
        top(Cross(right, forward)) {}
};

EyeRay PerspectiveRay(const Eye& eye, const Axes& axes, double x, double y) {
  const double half = std::tan(kDegree * eye.fov_deg / 2), pixel = 2 * half / eye.height;
  const double a = (2 * x - eye.width) / eye.height * half, b = (1 - 2 * y / eye.height) * half;
  const Vec3 way = axes.forward + a * axes.right + b * axes.top;
  const double length = Length(way);
  return {(1 / length) * way, pixel * pixel / (length * length * length)};
}

std::optional<EyeRay> FisheyeRay(const Eye& eye, const Axes& axes, double x, double y) {
  const double shorter = std::min(eye.width, eye.height), half = kDegree * eye.fov_deg / 2;
  const double a = (2 * x - eye.width) / shorter, b = (eye.height - 2 * y) / shorter;
  const double r = std::hypot(a, b), theta = r * half;
  if (r > 1) return {};
  const double sine_over_r = r > 1e-9 ? std::sin(theta) / r : half;
  return EyeRay{
      std::cos(theta) * axes.forward + sine_over_r * a * axes.right + sine_over_r * b * axes.top,
      sine_over_r * half * 4 / (shorter * shorter)};
}

EyeRay EquirectangularRay(const Eye& eye, const Axes& axes, double x, double y) {
  const double a = 2 * kPi * (x / eye.width - 0.5), e = kPi * (0.5 - y / eye.height);
  return {std::cos(e) * std::cos(a) * axes.forward + std::cos(e) * std::sin(a) * axes.right +
              std::sin(e) * axes.top,
          std::cos(e) * 2 * kPi * kPi / (double(eye.width) * eye.height)};
}

std::optional<EyeRay> RayOf(const Eye& eye, const Axes& axes, double x, double y) {
  switch (eye.projection) {
    case Eye::Projection::kPerspective:
      return PerspectiveRay(eye, axes, x, y);
    case Eye::Projection::kFisheye:
      return FisheyeRay(eye, axes, x, y);
    case Eye::Projection::kEquirectangular:
      return EquirectangularRay(eye, axes, x, y);
  }
  return {};
}

std::vector<Vec3> CornersOf(std::span<const PosedLightField> fields) {
  std::vector<Vec3> corners;
  for (const auto& posed : fields) {
    const auto& grid = posed.field.geometry.grid;
    const double width = (grid.width + grid.basis.cells - 1) * grid.spacing_m;
    const double height = (grid.height + grid.basis.cells - 1) * grid.spacing_m;
    for (const double u : {grid.u0_m, grid.u0_m + width})
      for (const double v : {grid.v0_m, grid.v0_m + height})
        corners.push_back(posed.luminaire_from_field.Point({u, v, 0}));
  }
  return corners;
}

bool InColours(std::span<const PosedLightField> fields) {
  return std::all_of(fields.begin(), fields.end(),
                     [](const auto& posed) { return posed.field.geometry.channels == 3; });
}

// Adds `value` of one field to a sum of three channels or of the luminance.
void Add(std::array<double, 3>& sum, const std::array<double, 3>& value, bool colours) {
  if (!colours) {
    sum[0] += core::Luminance(value);
    return;
  }
  for (std::size_t c = 0; c < 3; ++c) sum[c] += value[c];
}

struct Pixel {
  std::array<double, 3> mean{};
  double irradiance_variance = 0;
};

Pixel DrawPixel(std::span<const PosedLightField> fields, const Eye& eye, const Axes& axes,
                int samples, bool colours, int row, int column, core::Random& random) {
  Pixel pixel;
  // Rays of neighbouring parts differ by their noise and by what the picture changes from part to
  // part: half their mean square is at least the noise.
  double squares = 0;
  for (int b = 0; b < samples; ++b) {
    double before = 0;
    for (int a = 0; a < samples; ++a) {
      const auto ray = RayOf(eye, axes, column + (a + random.Uniform()) / samples,
                             row + (b + random.Uniform()) / samples);
      double light = 0;
      if (ray) {
        const auto radiance = RadianceTowards(fields, eye.position_m, ray->direction);
        for (std::size_t c = 0; c < 3; ++c) pixel.mean[c] += radiance[c];
        light = (colours ? core::Luminance(radiance) : radiance[0]) * ray->solid_angle *
                std::max(0.0, Dot(ray->direction, axes.forward));
      }
      if (a > 0) squares += (light - before) * (light - before) / 2;
      if (samples == 1) squares = light * light;
      before = light;
    }
  }
  const double count = double(samples) * samples;
  for (double& mean : pixel.mean) mean /= count;
  pixel.irradiance_variance = squares / (count * count);
  if (samples > 1) pixel.irradiance_variance *= double(samples) / (samples - 1);
  return pixel;
}

}  // namespace

void Eye::Validate() const {
  const Vec3 way = look_at_m - position_m;
  if (!(Length(way) > 0)) throw InputError("--look-at is where --eye is; name another point");
  if (!(Length(Cross(way, up)) > 1e-6 * Length(way) * Length(up)))
    throw InputError("--up is parallel to the view; name another direction");
}

std::optional<EyeRay> RayOf(const Eye& eye, double x, double y) {
  return RayOf(eye, Axes(eye), x, y);
}

Vec3 Forward(const Eye& eye) { return Axes(eye).forward; }

double FovOfWholeLamp(const Eye& eye, std::span<const PosedLightField> fields) {
  const Axes axes(eye);
  const double most = std::tan(80 * kDegree);
  double half = 0;
  for (const Vec3 corner : CornersOf(fields)) {
    const Vec3 way = corner - eye.position_m;
    const double depth = Dot(way, axes.forward);
    const double a = std::abs(Dot(way, axes.right)) / depth * eye.height / eye.width;
    const double b = std::abs(Dot(way, axes.top)) / depth;
    if (!(depth > 0) || !(std::max(a, b) < most))
      throw InputError(
          "the lamp does not fit into a perspective picture from --eye; give --fov, or "
          "--view fisheye or equirectangular");
    half = std::max({half, a, b});
  }
  return 2 * std::atan(1.1 * half) / kDegree;
}

bool ShowsWholeLamp(const Eye& eye, std::span<const PosedLightField> fields) {
  if (eye.projection == Eye::Projection::kEquirectangular) return true;
  const Axes axes(eye);
  const double half = std::tan(kDegree * eye.fov_deg / 2);
  for (const Vec3 corner : CornersOf(fields)) {
    const Vec3 way = corner - eye.position_m;
    const double depth = Dot(way, axes.forward);
    const double a = std::abs(Dot(way, axes.right)), b = std::abs(Dot(way, axes.top));
    const bool shown =
        eye.projection == Eye::Projection::kFisheye
            ? std::atan2(std::hypot(a, b), depth) < kDegree * eye.fov_deg / 2
            : depth > 0 && b < half * depth && a < half * depth * eye.width / eye.height;
    if (!shown) return false;
  }
  return true;
}

std::array<double, 3> RadianceTowards(std::span<const PosedLightField> fields, Vec3 p, Vec3 d) {
  const bool colours = InColours(fields);
  std::array<double, 3> sum{};
  for (const auto& posed : fields) {
    const auto& pose = posed.luminaire_from_field;
    const Vec3 q = pose.InverseDirection(p - pose.translation_m), e = pose.InverseDirection(d);
    if (!(q.z > 0) || !(e.z < 0)) continue;
    const double to_f = -q.z / e.z, to_i = (posed.field.geometry.delta_m - q.z) / e.z;
    Add(sum,
        lightfield::Radiance(posed.field, {q.x + to_f * e.x, q.y + to_f * e.y},
                             {q.x + to_i * e.x, q.y + to_i * e.y}),
        colours);
  }
  return sum;
}

LampPicture DrawLamp(std::span<const PosedLightField> fields, const Eye& eye, int samples,
                     std::uint64_t seed) {
  constexpr std::uint64_t kStream = 0x70696374757265;
  eye.Validate();
  const Axes axes(eye);
  const bool colours = InColours(fields);
  LampPicture picture{core::Image(eye.width, eye.height, colours ? 3 : 1), 0};
  std::vector<double> variance_of_row(static_cast<std::size_t>(eye.height), 0);
  core::Progress progress("picture", variance_of_row.size());
  core::ParallelFor(variance_of_row.size(), 1, [&](std::size_t begin, std::size_t end) {
    core::ThrowIfInterrupted();
    for (std::size_t k = begin; k < end; ++k) {
      const int row = static_cast<int>(k);
      core::Random random(seed, kStream, static_cast<std::uint32_t>(k));
      for (int column = 0; column < eye.width; ++column) {
        const Pixel pixel = DrawPixel(fields, eye, axes, samples, colours, row, column, random);
        for (int c = 0; c < picture.image.channels; ++c)
          picture.image.at(c, row, column) = static_cast<float>(pixel.mean[std::size_t(c)]);
        variance_of_row[k] += pixel.irradiance_variance;
      }
    }
    progress.Advance(end - begin);
  });
  double variance = 0;
  for (const double one : variance_of_row) variance += one;
  picture.irradiance_sigma = std::sqrt(variance);
  return picture;
}

Vec3 ReceiverOf(const Eye& eye, double width_m, double height_m, int row, int column) {
  const Axes axes(eye);
  // Seen from look_at, what the eye has at its right lies at the left.
  return eye.position_m - width_m * ((column + 0.5) / eye.width - 0.5) * axes.right +
         height_m * (0.5 - (row + 0.5) / eye.height) * axes.top;
}

core::Image DrawIrradiance(std::span<const PosedLightField> fields, const Eye& eye, double width_m,
                           double height_m) {
  eye.Validate();
  const bool colours = InColours(fields);
  const Vec3 normal = Forward(eye);
  core::Image image(eye.width, eye.height, colours ? 3 : 1);
  core::Progress progress("picture", static_cast<std::uint64_t>(eye.height));
  core::ParallelFor(
      static_cast<std::size_t>(eye.height), 1, [&](std::size_t begin, std::size_t end) {
        core::ThrowIfInterrupted();
        for (std::size_t k = begin; k < end; ++k)
          for (int column = 0; column < eye.width; ++column) {
            const Vec3 p = ReceiverOf(eye, width_m, height_m, static_cast<int>(k), column);
            std::array<double, 3> sum{};
            for (const auto& posed : fields) {
              const auto field_from_luminaire = posed.luminaire_from_field.Inverse();
              Add(sum,
                  lightfield::ExactIrradiance(posed.field, field_from_luminaire.Point(p),
                                              field_from_luminaire.Direction(normal)),
                  colours);
            }
            for (int c = 0; c < image.channels; ++c)
              image.at(c, static_cast<int>(k), column) = static_cast<float>(sum[std::size_t(c)]);
          }
        progress.Advance(end - begin);
      });
  return image;
}

std::optional<std::string> RadianceView(const Eye& eye) {
  if (eye.projection == Eye::Projection::kEquirectangular) return {};
  const Axes axes(eye);
  const bool perspective = eye.projection == Eye::Projection::kPerspective;
  const double shorter = std::min(eye.width, eye.height);
  const double across =
      perspective
          ? 2 / kDegree * std::atan(std::tan(kDegree * eye.fov_deg / 2) * eye.width / eye.height)
          : eye.fov_deg * eye.width / shorter;
  const double up = perspective ? eye.fov_deg : eye.fov_deg * eye.height / shorter;
  const Vec3 p = eye.position_m, d = axes.forward, t = axes.top;
  return fmt::format(
      "-vt{} -vp {:.9g} {:.9g} {:.9g} -vd {:.9g} {:.9g} {:.9g} -vu {:.9g} {:.9g} {:.9g} -vh {:.9g} "
      "-vv {:.9g} -vo 0 -va 0 -vs 0 -vl 0",
      perspective ? 'v' : 'a', p.x, p.y, p.z, d.x, d.y, d.z, t.x, t.y, t.z, across, up);
}

}  // namespace luxfield::formats
