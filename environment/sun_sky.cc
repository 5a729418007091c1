#include "luxfield/environment/sun_sky.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/primaries.h"
#include "luxfield/environment/disc_layout.h"
#include "luxfield/environment/spherical_polygon.h"
#include "luxfield/environment/sunlight.h"

namespace luxfield::environment {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kLeastSide = 32, kLargestSide = 8192;
constexpr double kOutlineTolerance = 1e-6;
// Of the forward peak of one scattering in a cloud.
constexpr double kPeakAsymmetry = 0.95;
// Rings of the quadrature of the sky's illuminance.
constexpr int kQuadratureRows = 192;

double AngleBetween(lightfield::Vec3 a, lightfield::Vec3 b) {
  return std::atan2(lightfield::Length(lightfield::Cross(a, b)), lightfield::Dot(a, b));
}

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

SunSky::SunSky(const SunPosition& sun, double turbidity, double ground_albedo)
    : sky_(sun.apparent_elevation_deg, turbidity, ground_albedo),
      nearness_(1 / (sun.distance_au * sun.distance_au)),
      sun_direction_(sun.direction()),
      sun_radius_(sun.angular_radius_deg() * kPi / 180),
      direct_(DirectNormalIlluminance(sun, turbidity)) {
  diffuse_ = HorizontalIlluminance();
  region_ = global_horizontal();
  Finish(ground_albedo);
}

SunSky::SunSky(const SunPosition& sun, double turbidity, double ground_albedo,
               const CloudOptions& clouds, UtcTime when)
    : SunSky(sun, turbidity, ground_albedo) {
  clouds_.emplace(clouds, when, sun_direction_);
  beam_ = direct_;
  sky_flux_ = diffuse_;
  const CloudLayer::Sight mean = clouds_->MeanSight();
  sunlit_ = clouds_->MeanSunThrough();
  // Heights over which the air and its aerosol thin out by e, 8.4 and 1.2 km.
  constexpr double kGreen = 0.55, kAirHeight = 8400, kHazeHeight = 1200;
  air_thickness_ =
      RayleighThickness(kGreen) * (1 - std::exp(-clouds.altitude_m / kAirHeight)) +
      AerosolThickness(turbidity, kGreen) * (1 - std::exp(-clouds.altitude_m / kHazeHeight));
  const double through = clouds_->SunThrough(sun_radius_);
  for (std::size_t k = 0; k < 3; ++k) {
    sun_flux_[k] = std::max(0.0, sun_direction_.z) * beam_[k];
    region_[k] =
        (sun_flux_[k] * (mean.sun_diffuse + mean.through) + sky_flux_[k] * (1 - mean.reflected)) /
        (1 - ground_albedo * mean.reflected);
    direct_[k] *= through;
  }
  Finish(ground_albedo);
  diffuse_ = HorizontalIlluminance();
}

void SunSky::Finish(double ground_albedo) {
  const double sine = std::sin(sun_radius_);
  for (std::size_t k = 0; k < 3; ++k) {
    sun_radiance_[k] = direct_[k] / (kPi * sine * sine);
    ground_radiance_[k] = ground_albedo / kPi * region_[k];
  }
}

// The midpoint rule in sin^2(theta) and azimuth: equal pieces of the projected hemisphere.
core::Rgb SunSky::HorizontalIlluminance() {
  const int rows = kQuadratureRows, columns = 2 * kQuadratureRows;
  std::vector<core::Rgb> sums(rows);
  std::vector<double> covers(rows);
  core::ParallelFor(rows, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      for (int column = 0; column < columns; ++column) {
        const double square = (double(row) + 0.5) / rows, sine = std::sqrt(square),
                     phi = 2 * kPi * (column + 0.5) / columns;
        const lightfield::Vec3 w = {sine * std::cos(phi), sine * std::sin(phi),
                                    std::sqrt(1 - square)};
        const double width = std::sqrt(kPi / (double(rows) * columns * w.z));
        const core::Rgb colour = Radiance(w, width);
        for (std::size_t k = 0; k < 3; ++k) sums[row][k] += colour[k];
        if (clouds_) covers[row] += clouds_->See(w, width).cloud / w.z;
      }
  });
  core::Rgb sum{};
  cloud_cover_ = 0;
  double pieces = 0;
  for (int row = 0; row < rows; ++row) {
    for (std::size_t k = 0; k < 3; ++k) sum[k] += sums[row][k] * kPi / (double(rows) * columns);
    cloud_cover_ += covers[row];
    pieces += columns / std::sqrt(1 - (row + 0.5) / rows);
  }
  cloud_cover_ /= pieces;
  return sum;
}

core::Rgb SunSky::global_horizontal() const {
  core::Rgb sum;
  for (std::size_t k = 0; k < 3; ++k)
    sum[k] = diffuse_[k] + std::max(0.0, sun_direction_.z) * direct_[k];
  return sum;
}

core::Rgb SunSky::SkyColour(lightfield::Vec3 direction) const {
  const double cos_gamma = std::clamp(lightfield::Dot(direction, sun_direction_), -1.0, 1.0);
  const core::Rgb xyz = sky_.Xyz(direction.z, AngleBetween(direction, sun_direction_), cos_gamma);
  core::Rgb colour = core::IntoGamut(core::Rec709FromXyz(xyz));
  for (double& value : colour) value *= nearness_;
  return colour;
}

core::Rgb SunSky::CloudedColour(lightfield::Vec3 direction, double width) const {
  const core::Rgb clear = SkyColour(direction);
  const CloudLayer::Sight sight = clouds_->See(direction, width);
  // The CIE's overcast pattern, of flux 1, and Henyey and Greenstein's lobe: n scatterings in one
  // of asymmetry g make one of asymmetry g^n.
  const double pattern = 9 / (7 * kPi) * (1 + 2 * direction.z) / 3;
  const double g = std::pow(kPeakAsymmetry, sight.forward_scatterings);
  const double base = 1 + g * g - 2 * g * Dot(direction, sun_direction_);
  const double peak = (1 - g * g) / (4 * kPi * base * std::sqrt(base));
  // Sunlit air before the clouds looks like that of the clear sky.
  const double air = sunlit_ * (1 - std::exp(-air_thickness_ * clouds_->SlantOf(direction)));
  core::Rgb colour;
  for (std::size_t k = 0; k < 3; ++k) {
    const double layer =
        sight.through * clear[k] + sight.sun_forward * beam_[k] * peak +
        pattern * (sight.sun_diffuse * sun_flux_[k] + sight.sky_diffuse * sky_flux_[k] +
                   sight.reflected * kPi * ground_radiance_[k]);
    colour[k] = air * clear[k] + (1 - air) * layer;
  }
  return colour;
}

core::Rgb SunSky::Radiance(lightfield::Vec3 direction, double width) const {
  if (!(direction.z > 0)) return ground_radiance_;
  return clouds_ ? CloudedColour(direction, width) : SkyColour(direction);
}

core::Image SunSky::Picture(EnvironmentLayout layout, int height) const {
  const PictureSize size = SizeOf(layout, height);
  const TexelEdges edges =
      MakeTexelEdges(layout, TexelRegistration::kCells, size.width, size.height);
  const bool is_disc = FindDisc(layout) != nullptr;
  core::Image image(size.width, size.height, 3);

  // What a pixel's point shows. Beyond the rim of a disc, for pixels that it cuts: the rim.
  const auto at = [&](lightfield::Vec2 p) {
    if (auto shown = DirectionFromPicture(layout, p)) return *shown;
    const double a = p.x - 0.5, b = p.y - 0.5, shrink = 0.5 * (1 - 1e-12) / std::hypot(a, b);
    return *DirectionFromPicture(layout, {0.5 + shrink * a, 0.5 + shrink * b});
  };
  // Whether a pixel lies beyond the disc: by a bound of half its diagonal, twice over.
  const auto far_from_sun = [&](double x0, double x1, double y0, double y1) {
    const lightfield::Vec3 centre = at({0.5 * (x0 + x1), 0.5 * (y0 + y1)}).direction;
    double extent = 2.5 / size.side;
    if (is_disc) {
      for (const lightfield::Vec2 corner : {lightfield::Vec2{x0, y0}, lightfield::Vec2{x1, y0},
                                            lightfield::Vec2{x0, y1}, lightfield::Vec2{x1, y1}}) {
        const auto shown = DirectionFromPicture(layout, corner);
        if (!shown) return false;  // on the rim
        extent = std::max(extent, AngleBetween(shown->direction, centre));
      }
    }
    return AngleBetween(sun_direction_, centre) > sun_radius_ + 2 * extent;
  };

  core::ParallelFor(size.height, 4, [&](std::size_t begin, std::size_t end) {
    constexpr double kNodes[] = {0.21132486540518712, 0.78867513459481288};  // Gauss-Legendre
    std::vector<lightfield::Vec3> outline, above;
    for (int row = static_cast<int>(begin); row < static_cast<int>(end); ++row)
      for (int column = 0; column < size.width; ++column) {
        const double x0 = edges.x[column], x1 = edges.x[column + 1], y0 = edges.y[row],
                     y1 = edges.y[row + 1];
        const double solid_angle = PictureRectangleSolidAngle(layout, x0, x1, y0, y1);
        if (!(solid_angle > 0)) continue;
        const double width = 0.5 * std::sqrt(solid_angle);  // of what a node stands for
        core::Rgb sum{};
        double weights = 0;
        for (const double u : kNodes)
          for (const double v : kNodes) {
            const auto [direction, weight] = at({x0 + u * (x1 - x0), y0 + v * (y1 - y0)});
            const core::Rgb radiance = Radiance(direction, width);
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

}  // namespace luxfield::environment
