#include "luxfield/hal/sim/print.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/random.h"

namespace luxfield::hal::sim {

FilterPrint::FilterPrint(const rig::FilterSheet& sheet, const PrintErrors& errors,
                         std::uint64_t seed)
    : sheet_(sheet), errors_(errors), seed_(seed) {}

double FilterPrint::half_width_m() const {
  const double support = sheet_.basis.cells * sheet_.spacing_m;
  return 0.5 * support + std::max(std::abs(errors_.shift_m.x), std::abs(errors_.shift_m.y)) +
         support * std::abs(errors_.rotation_rad);
}

// Value noise: independent normals on a square lattice, interpolated; scaled to unit variance on
// average over a cell (the squared weights of linear interpolation average 2/3 per axis).
double FilterPrint::Grain(Vec2 offset) const {
  const double x = offset.x / errors_.grain_size_m, y = offset.y / errors_.grain_size_m;
  const double x0 = std::floor(x), y0 = std::floor(y), fx = x - x0, fy = y - y0;
  const auto knot = [&](int di, int dj) {
    const auto i = static_cast<std::int32_t>(x0) + di, j = static_cast<std::int32_t>(y0) + dj;
    const auto key =
        (std::uint64_t{static_cast<std::uint32_t>(i)} << 32) | static_cast<std::uint32_t>(j);
    return core::Random(seed_, key, 0x67726Eu).Normal();
  };
  return 1.5 * ((1 - fx) * (1 - fy) * knot(0, 0) + fx * (1 - fy) * knot(1, 0) +
                (1 - fx) * fy * knot(0, 1) + fx * fy * knot(1, 1));
}

Vec2 FilterPrint::OnSheet(Vec2 offset) const {
  const double c = std::cos(errors_.rotation_rad), s = std::sin(errors_.rotation_rad);
  const Vec2 shifted = offset - errors_.shift_m;
  return {c * shifted.x + s * shifted.y, -s * shifted.x + c * shifted.y};
}

double FilterPrint::MeanGrain(Vec2 offset, double patch_m) const {
  constexpr int kMost = 12;  // per axis, two a grain
  const int points =
      std::clamp(static_cast<int>(std::ceil(2 * patch_m / errors_.grain_size_m)), 1, kMost);
  double sum = 0;
  for (int y = 0; y < points; ++y)
    for (int x = 0; x < points; ++x)
      sum += Grain(offset + Vec2{((x + 0.5) / points - 0.5) * patch_m,
                                 ((y + 0.5) / points - 0.5) * patch_m});
  return sum / (points * points);
}

double FilterPrint::WithErrors(double ideal, Vec2 own, double patch_m) const {
  double value = ideal;
  if (value <= 0) return 0;
  if (errors_.density_gamma != 0) value = std::pow(value, 1 + errors_.density_gamma);
  value *= 1 + errors_.density;
  if (errors_.grain > 0) value *= std::max(0.0, 1 + errors_.grain * MeanGrain(own, patch_m));
  return value;
}

double FilterPrint::Transmittance(Vec2 offset, int print, double patch_m) const {
  const Vec2 own = OnSheet(offset);
  return WithErrors(sheet_.FilterTransmittance(own, print), own, patch_m);
}

double FilterPrint::SheetTransmittance(Vec2 offset, int print) const {
  const Vec2 own = OnSheet(offset);
  return WithErrors(sheet_.Transmittance(own, print), own, 0);
}

}  // namespace luxfield::hal::sim
