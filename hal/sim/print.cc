#include "hal/sim/print.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace luxfield::hal::sim {

FilterPrint::FilterPrint(const lightfield::Basis& basis, double spacing_m, double scale, bool dual,
                         const PrintErrors& errors, std::uint64_t seed)
    : basis_(basis),
      spacing_m_(spacing_m),
      scale_(scale),
      dual_(dual),
      errors_(errors),
      seed_(seed) {
  if (dual) peak_ = basis.DualPeaks();
}

double FilterPrint::half_width_m() const {
  return 0.5 * basis_.cells * spacing_m_ +
         std::max(std::abs(errors_.shift_m.x), std::abs(errors_.shift_m.y)) +
         basis_.cells * spacing_m_ * std::abs(errors_.rotation_rad);
}

double FilterPrint::Ideal(Vec2 offset, int print) const {
  const double x = offset.x / spacing_m_, y = offset.y / spacing_m_;
  if (dual_) {
    const double value = basis_.DualValue(x) * basis_.DualValue(y);
    return peak_[print] > 0 ? std::max(print == 0 ? value : -value, 0.0) / peak_[print] : 0;
  }
  const double centre = 0.5 * basis_.cells;
  return scale_ * basis_.Value(x + centre) * basis_.Value(y + centre);
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

double FilterPrint::Transmittance(Vec2 offset, int print) const {
  const double c = std::cos(errors_.rotation_rad), s = std::sin(errors_.rotation_rad);
  const Vec2 shifted = offset - errors_.shift_m;
  const Vec2 own{c * shifted.x + s * shifted.y, -s * shifted.x + c * shifted.y};
  double value = Ideal(own, print);
  if (value <= 0) return 0;
  if (errors_.density_gamma != 0) value = std::pow(value, 1 + errors_.density_gamma);
  value *= 1 + errors_.density;
  if (errors_.grain > 0) value *= std::max(0.0, 1 + errors_.grain * Grain(own));
  return value;
}

}  // namespace luxfield::hal::sim
