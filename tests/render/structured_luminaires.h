// Light fields whose images are not separable: rings, facets, a filament. Where a sampler restricts
// its marginal in one axis only, these show its bias (docs/theory.md 6.1).
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_field.h"

namespace luxfield::render {

struct LuminaireShape {
  lightfield::Basis basis = lightfield::Basis::Make(lightfield::BasisKind::kBspline2);
  int grid_width = 3, grid_height = 2;
  int width = 40, height = 30;
  int channels = 1;
  double delta_m = 0.3, spacing_m = 0.0165, image_m = 0.3;
};

inline lightfield::LightField EmptyLuminaire(const LuminaireShape& shape) {
  lightfield::LuminaireGeometry g;
  g.delta_m = shape.delta_m;
  g.grid = lightfield::BasisGrid::Centred(shape.basis, shape.grid_width, shape.grid_height,
                                          shape.spacing_m);
  const double ds = shape.image_m / shape.width;
  g.lattice = {shape.width, shape.height, -0.5 * shape.image_m, 0.5 * ds * shape.height, ds, ds};
  g.channels = shape.channels;
  return lightfield::LightField(g);
}

// `kind`: "rings", "facets", "filament", or "noise" (five decades, independent texels). Values from
// 1e-5 to 1.
inline lightfield::LightField StructuredLuminaire(const std::string& kind,
                                                  const LuminaireShape& shape,
                                                  std::uint64_t seed = 1) {
  lightfield::LightField field = EmptyLuminaire(shape);
  const double half_width = 0.5 * shape.width, half_height = 0.5 * shape.height;
  for (int m = 0; m < field.geometry.grid.count(); ++m) {
    core::Random random(seed, m);
    const double shift_x = 0.4 * (random.Uniform() - 0.5), shift_y = 0.4 * (random.Uniform() - 0.5);
    const double strength = 0.5 + random.Uniform();
    for (int r = 0; r < shape.height; ++r)
      for (int c = 0; c < shape.width; ++c) {
        const double x = (c + 0.5 - half_width) / half_width - shift_x,
                     y = (r + 0.5 - half_height) / half_height - shift_y;
        double value = 1e-5;
        if (kind == "rings") {
          value += std::pow(std::max(0.0, std::cos(14 * std::hypot(x, y))), 8.0) *
                   std::exp(-2 * (x * x + y * y));
        } else if (kind == "facets") {
          const int tile = static_cast<int>(std::floor(4 * (x + y))) * 7 +
                           static_cast<int>(std::floor(4 * (x - y)));
          value += std::pow(
              core::Random(seed + 1, m, static_cast<std::uint32_t>(tile + 1000)).Uniform(), 6.0);
        } else if (kind == "filament") {
          const double along = x * 0.8 + y * 0.6,
                       across = y * 0.8 - x * 0.6 - 0.15 * std::sin(9 * along);
          value += std::exp(-across * across / 0.003) * (std::abs(along) < 0.8 ? 1.0 : 0.0);
        } else if (kind == "grain") {
          value = std::pow(10.0, -random.Uniform());
        } else {
          value = std::pow(10.0, -5 * random.Uniform());
        }
        for (int channel = 0; channel < shape.channels; ++channel)
          field.image(m, channel)[r * shape.width + c] = static_cast<float>(
              strength * value *
              (shape.channels == 1 ? 1.0 : 0.3 + 0.7 * (channel == (m + r / 4) % 3)));
      }
  }
  return field;
}

// Half as much and below 0 in 30 % of the values, channels for themselves: what noise and sharp
// edges leave behind a least-squares solve, only worse.
inline lightfield::LightField WithSigns(lightfield::LightField field, std::uint64_t seed = 1) {
  core::Random random(seed, 77);
  for (float& c : field.data)
    if (random.Uniform() < 0.3) c *= -0.5f;
  return field;
}

}  // namespace luxfield::render
