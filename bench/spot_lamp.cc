#include "luxfield/bench/spot_lamp.h"

#include <cmath>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::bench {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::Vec2;

LightField SpotLamp(lightfield::LuminaireGeometry geometry, const SpotLampOptions& options,
                    std::uint64_t seed, int number) {
  constexpr int kFiner = 4;
  lightfield::BasisGrid& grid = geometry.grid;
  const Basis fine = Basis::Make(BasisKind::kBspline2);
  const int cells = grid.basis.cells;
  grid.width = kFiner * (grid.width + cells - 1) - (fine.cells - 1);
  grid.height = kFiner * (grid.height + cells - 1) - (fine.cells - 1);
  grid.spacing_m /= kFiner;
  grid.basis = fine;
  LightField lamp(geometry);
  core::Random random(seed, 0x6C616D70, static_cast<std::uint32_t>(number));
  const auto within = [&](double half) { return half * (2 * random.Uniform() - 1); };
  const auto bell = [](Vec2 off, double width) {
    return std::exp(-0.5 * (off.x * off.x + off.y * off.y) / (width * width));
  };
  const int spots = 4 + static_cast<int>(random.Uniform() * 5);
  std::vector<double> beam(geometry.plane_size());
  for (int k = 0; k < spots; ++k) {
    const Vec2 centre{within(options.reach_m), within(options.reach_m)},
        towards{within(options.beam_m), within(options.beam_m)};
    const double width =
        options.smallest_m * std::pow(options.largest_m / options.smallest_m, random.Uniform());
    const double peak = 1e6 * (0.2 + random.Uniform());
    for (std::size_t texel = 0; texel < beam.size(); ++texel) {
      const Vec2 s = geometry.lattice.centre(static_cast<int>(texel) / geometry.lattice.width,
                                             static_cast<int>(texel) % geometry.lattice.width);
      beam[texel] = peak * (0.05 + bell(s - towards, options.beam_m));
    }
    for (int m = 0; m < grid.count(); ++m) {
      const double value = bell(grid.centre(m % grid.width, m / grid.width) - centre, width);
      auto image = lamp.image(m, 0);
      for (std::size_t texel = 0; texel < beam.size(); ++texel)
        image[texel] += static_cast<float>(beam[texel] * value);
    }
  }
  return lamp;
}

}  // namespace luxfield::bench
