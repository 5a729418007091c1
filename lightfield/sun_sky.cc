#include "lightfield/sun_sky.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/error.h"
#include "core/parallel.h"
#include "core/primaries.h"
#include "lightfield/disc_layout.h"
#include "lightfield/spherical_polygon.h"

namespace luxfield::lightfield {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kLeastSide = 32, kLargestSide = 8192;
constexpr double kOutlineTolerance = 1e-6;
// Zenith and horizon of the quadrature that scales the sky: 2e-5 of its illuminance.
constexpr int kQuadratureRows = 192;

// cubic in the sun's zenith angle and quadratic in turbidity
double ZenithChromaticity(const double (&m)[3][4], double turbidity, double theta) {
  double sum = 0;
  for (const auto& row : m)
    sum = sum * turbidity + ((row[0] * theta + row[1]) * theta + row[2]) * theta + row[3];
  return sum;
}
constexpr double kZenithX[3][4] = {{0.00166, -0.00375, 0.00209, 0},
                                   {-0.02903, 0.06377, -0.03202, 0.00394},
                                   {0.11693, -0.21196, 0.06052, 0.25886}};
constexpr double kZenithY[3][4] = {{0.00275, -0.00610, 0.00317, 0},
                                   {-0.04214, 0.08970, -0.04153, 0.00516},
                                   {0.15346, -0.26756, 0.06670, 0.26688}};

double AngleBetween(Vec3 a, Vec3 b) { return std::atan2(Length(Cross(a, b)), Dot(a, b)); }

struct PictureSize {
  int width, height, side;
};

PictureSize SizeOf(EnvironmentLayout layout, int height) {
  const bool cube = layout == EnvironmentLayout::kCube;
  const bool wide = layout == EnvironmentLayout::kLatitudeLongitude;
  const int side = cube ? height / 6 : height;
  if (side < kLeastSide || side > kLargestSide || (cube && height % 6 != 0))
    throw InputError(fmt::format("a {} picture of height {} cannot be made; choose {} to {}{}",
                                 EnvironmentLayoutName(layout), height, kLeastSide * (cube ? 6 : 1),
                                 kLargestSide * (cube ? 6 : 1), cube ? ", a multiple of 6" : ""));
  return {wide ? 2 * height : side, height, side};
}

}  // namespace

double SunSky::Perez::operator()(double cos_theta, double gamma, double cos_gamma) const {
  // On the horizon and next to it, where B / cos leaves the floating range, exp is 0.
  const double gradation = 1 + c[0] * std::exp(c[1] / std::max(cos_theta, 1e-3));
  return zenith * gradation * (1 + c[2] * std::exp(c[3] * gamma) + c[4] * cos_gamma * cos_gamma);
}

SunSky::SunSky(const SunPosition& sun, double turbidity, double ground_albedo)
    : clear_(FindClearSky(sun, turbidity, ground_albedo)),
      sun_direction_(sun.direction()),
      sun_radius_(sun.angular_radius_deg() * kPi / 180) {
  const double t = turbidity;
  luminance_.c = {0.17872 * t - 1.46303, -0.35540 * t + 0.42749, -0.02266 * t + 5.32505,
                  0.12064 * t - 2.57705, -0.06696 * t + 0.37027};
  x_.c = {-0.01925 * t - 0.25922, -0.06651 * t + 0.00081, -0.00041 * t + 0.21247,
          -0.06409 * t - 0.89887, -0.00325 * t + 0.04517};
  y_.c = {-0.01669 * t - 0.26078, -0.09495 * t + 0.00921, -0.00792 * t + 0.21023,
          -0.04405 * t - 1.65369, -0.01092 * t + 0.05291};
  const double theta_sun = std::acos(std::clamp(sun_direction_.z, -1.0, 1.0));
  const auto set_zenith = [&](Perez& perez, double value) {
    perez.zenith = 1;
    perez.zenith = value / perez(1, theta_sun, sun_direction_.z);
  };
  set_zenith(luminance_, 1);
  set_zenith(x_, ZenithChromaticity(kZenithX, t, theta_sun));
  set_zenith(y_, ZenithChromaticity(kZenithY, t, theta_sun));

  // Scale the pattern to the horizontal illuminance. The midpoint rule in sin^2(theta) and azimuth:
  // equal pieces of the projected hemisphere.
  const int rows = kQuadratureRows, columns = 2 * kQuadratureRows;
  core::Rgb sum{};
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const double sine = std::sqrt((row + 0.5) / rows), phi = 2 * kPi * (column + 0.5) / columns;
      const core::Rgb colour = SkyColour(
          {sine * std::cos(phi), sine * std::sin(phi), std::sqrt(1 - (row + 0.5) / rows)});
      for (std::size_t k = 0; k < 3; ++k) sum[k] += colour[k] * kPi / (double(rows) * columns);
    }
  scale_ = core::Luminance(clear_.diffuse_horizontal) / core::Luminance(sum);
  for (std::size_t k = 0; k < 3; ++k) {
    diffuse_[k] = scale_ * sum[k];
    const double sine = std::sin(sun_radius_);
    sun_radiance_[k] = clear_.direct_normal[k] / (kPi * sine * sine);
  }
  const core::Rgb global = global_horizontal();
  for (std::size_t k = 0; k < 3; ++k) ground_radiance_[k] = ground_albedo / kPi * global[k];
}

core::Rgb SunSky::global_horizontal() const {
  core::Rgb sum;
  for (std::size_t k = 0; k < 3; ++k)
    sum[k] = diffuse_[k] + std::max(0.0, sun_direction_.z) * clear_.direct_normal[k];
  return sum;
}

core::Rgb SunSky::SkyColour(Vec3 direction) const {
  const double cos_gamma = std::clamp(Dot(direction, sun_direction_), -1.0, 1.0);
  const double gamma = AngleBetween(direction, sun_direction_);
  const double x = x_(direction.z, gamma, cos_gamma), y = y_(direction.z, gamma, cos_gamma);
  const double luminance = luminance_(direction.z, gamma, cos_gamma);
  const core::Rgb xyz = {luminance * x / y, luminance, luminance * (1 - x - y) / y};
  core::Rgb colour = core::IntoGamut(core::Rec709FromXyz(xyz));
  for (double& value : colour) value *= scale_;
  return colour;
}

core::Rgb SunSky::Radiance(Vec3 direction) const {
  return direction.z > 0 ? SkyColour(direction) : ground_radiance_;
}

core::Image SunSky::Picture(EnvironmentLayout layout, int height) const {
  const PictureSize size = SizeOf(layout, height);
  const TexelEdges edges =
      MakeTexelEdges(layout, TexelRegistration::kCells, size.width, size.height);
  const bool is_disc = FindDisc(layout) != nullptr;
  core::Image image(size.width, size.height, 3);

  // What a pixel's point shows. Beyond the rim of a disc, for pixels that it cuts: the rim.
  const auto at = [&](Vec2 p) {
    if (auto shown = DirectionFromPicture(layout, p)) return *shown;
    const double a = p.x - 0.5, b = p.y - 0.5, shrink = 0.5 * (1 - 1e-12) / std::hypot(a, b);
    return *DirectionFromPicture(layout, {0.5 + shrink * a, 0.5 + shrink * b});
  };
  // Whether a pixel lies beyond the disc: by a bound of half its diagonal, twice over.
  const auto far_from_sun = [&](double x0, double x1, double y0, double y1) {
    const Vec3 centre = at({0.5 * (x0 + x1), 0.5 * (y0 + y1)}).direction;
    double extent = 2.5 / size.side;
    if (is_disc) {
      for (const Vec2 corner : {Vec2{x0, y0}, Vec2{x1, y0}, Vec2{x0, y1}, Vec2{x1, y1}}) {
        const auto shown = DirectionFromPicture(layout, corner);
        if (!shown) return false;  // on the rim
        extent = std::max(extent, AngleBetween(shown->direction, centre));
      }
    }
    return AngleBetween(sun_direction_, centre) > sun_radius_ + 2 * extent;
  };

  core::ParallelFor(size.height, 4, [&](std::size_t begin, std::size_t end) {
    constexpr double kNodes[] = {0.21132486540518712, 0.78867513459481288};  // Gauss-Legendre
    std::vector<Vec3> outline, above;
    for (int row = static_cast<int>(begin); row < static_cast<int>(end); ++row)
      for (int column = 0; column < size.width; ++column) {
        const double x0 = edges.x[column], x1 = edges.x[column + 1], y0 = edges.y[row],
                     y1 = edges.y[row + 1];
        const double solid_angle = PictureRectangleSolidAngle(layout, x0, x1, y0, y1);
        if (!(solid_angle > 0)) continue;
        core::Rgb sum{};
        double weights = 0;
        for (const double u : kNodes)
          for (const double v : kNodes) {
            const auto [direction, weight] = at({x0 + u * (x1 - x0), y0 + v * (y1 - y0)});
            const core::Rgb radiance = Radiance(direction);
            for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * radiance[k];
            weights += weight;
          }
        double sun_share = 0;
        if (!far_from_sun(x0, x1, y0, y1)) {
          PictureRectangleOutline(layout, x0, x1, y0, y1, kOutlineTolerance, outline);
          ClipByPlane(outline, {0, 0, 1}, above);
          sun_share =
              std::abs(CapOverlapSolidAngle(above, sun_direction_, sun_radius_)) / solid_angle;
        }
        for (int k = 0; k < 3; ++k)
          image.at(k, row, column) =
              static_cast<float>(sum[k] / weights + sun_share * sun_radiance_[k]);
      }
  });
  return image;
}

}  // namespace luxfield::lightfield
