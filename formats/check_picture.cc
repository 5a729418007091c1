#include <algorithm>
#include <cmath>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/formats/export_check.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::formats {
namespace {

using lightfield::Dot;
using lightfield::Length;
using lightfield::PosedLightField;
using lightfield::Vec3;

double LuminanceAt(const core::Image& image, int row, int column) {
  if (image.channels == 1) return image.at(0, row, column);
  return core::Luminance(
      {image.at(0, row, column), image.at(1, row, column), image.at(2, row, column)});
}

// By midpoints of nodes x nodes cells of the supports' rectangle of every field.
double IrradianceByQuadrature(std::span<const PosedLightField> fields, Vec3 p, Vec3 normal,
                              int nodes) {
  double sum = 0;
  for (const auto& posed : fields) {
    const auto field_from_luminaire = posed.luminaire_from_field.Inverse();
    const Vec3 q = field_from_luminaire.Point(p), n = field_from_luminaire.Direction(normal);
    if (!(q.z > 0)) continue;
    const auto& g = posed.field.geometry;
    const double width = (g.grid.width + g.grid.basis.cells - 1) * g.grid.spacing_m / nodes;
    const double height = (g.grid.height + g.grid.basis.cells - 1) * g.grid.spacing_m / nodes;
    for (int a = 0; a < nodes; ++a)
      for (int b = 0; b < nodes; ++b) {
        const lightfield::Vec2 u{g.grid.u0_m + (a + 0.5) * width, g.grid.v0_m + (b + 0.5) * height};
        const Vec3 way = q - Vec3{u.x, u.y, 0};
        const double r = Length(way), to_i = g.delta_m / way.z;
        const auto radiance =
            lightfield::Radiance(posed.field, u, {u.x + to_i * way.x, u.y + to_i * way.y});
        sum += core::Luminance(radiance) * way.z / r * std::max(0.0, -Dot(way, n) / r) / (r * r) *
               width * height;
      }
  }
  return sum;
}

}  // namespace

ExportCheck CheckLampPicture(const core::Image& read, const Eye& eye, double irradiance_sigma,
                             std::span<const PosedLightField> fields, double step,
                             const std::string& file) {
  if (!ShowsWholeLamp(eye, fields))
    throw InputError(file, "does not show the whole lamp, which --check needs",
                     "raise --fov or turn the eye to the lamp");
  const Vec3 normal = Forward(eye);
  double found = 0, largest_pixel = 0;
  for (int row = 0; row < eye.height; ++row)
    for (int column = 0; column < eye.width; ++column) {
      const auto ray = RayOf(eye, column + 0.5, row + 0.5);
      if (!ray) continue;
      found += LuminanceAt(read, row, column) * ray->solid_angle *
               std::max(0.0, Dot(ray->direction, normal));
      largest_pixel = std::max(largest_pixel, ray->solid_angle);
    }
  double exact = 0;
  for (const auto& posed : fields) {
    const auto field_from_luminaire = posed.luminaire_from_field.Inverse();
    exact += core::Luminance(lightfield::ExactIrradiance(posed.field,
                                                         field_from_luminaire.Point(eye.position_m),
                                                         field_from_luminaire.Direction(normal)));
  }
  if (!(exact > 0))
    throw InputError(file, "shows no light to check", "move --eye to where the lamp shines");
  ExportCheck check;
  check.judge = "light field's irradiance at the eye";
  check.receivers = 1;
  check.max_rel_error = std::abs(found / exact - 1);
  check.mc_sigma = irradiance_sigma / exact;
  check.stated_error = 5 * check.mc_sigma + step + 0.1 * std::sqrt(largest_pixel);
  return check;
}

ExportCheck CheckIrradiance(const core::Image& read, const Eye& eye, double width_m,
                            double height_m, std::span<const PosedLightField> fields, double step,
                            std::uint64_t seed) {
  constexpr int kReceivers = 16;
  double largest = 0;
  for (int row = 0; row < eye.height; ++row)
    for (int column = 0; column < eye.width; ++column)
      largest = std::max(largest, LuminanceAt(read, row, column));
  std::vector<std::pair<int, int>> lit;
  for (int row = 0; row < eye.height; ++row)
    for (int column = 0; column < eye.width; ++column)
      if (LuminanceAt(read, row, column) > largest / 100) lit.emplace_back(row, column);
  if (lit.empty())
    throw InputError("the plane has no light to check; move --eye to where the lamp shines");
  core::Random random(seed, 0x726563656976);
  double error = 0, quadrature = 0;
  for (int k = 0; k < kReceivers; ++k) {
    const auto [row, column] = lit[static_cast<std::size_t>(random.Uniform() * double(lit.size()))];
    const Vec3 p = ReceiverOf(eye, width_m, height_m, row, column);
    const double fine = IrradianceByQuadrature(fields, p, Forward(eye), 256);
    const double coarse = IrradianceByQuadrature(fields, p, Forward(eye), 128);
    error = std::max(error, std::abs(LuminanceAt(read, row, column) - fine));
    quadrature = std::max(quadrature, std::abs(fine - coarse));
  }
  ExportCheck check;
  check.judge = "radiance's quadrature over the filter plane";
  check.receivers = kReceivers;
  check.max_rel_error = error / largest;
  check.stated_error = step + 2 * quadrature / largest;
  return check;
}

}  // namespace luxfield::formats
