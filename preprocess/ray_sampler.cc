#include "luxfield/preprocess/ray_sampler.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"

namespace luxfield::preprocess {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::LightField;

// Luminance of C_m at a texel.
double Coefficient(const LightField& field, int image, std::size_t texel) {
  if (field.geometry.channels == 1) return field.image(image, 0)[texel];
  return core::Luminance(
      {field.image(image, 0)[texel], field.image(image, 1)[texel], field.image(image, 2)[texel]});
}

// x in [0, n) with density B(x) over its integral.
double DrawFromBasis(const Basis& basis, core::Random& random) {
  switch (basis.kind) {
    case BasisKind::kBox:
      return random.Uniform();
    case BasisKind::kBilinear:
      return random.Uniform() + random.Uniform();
    case BasisKind::kBspline2:
      return random.Uniform() + random.Uniform() + random.Uniform();
    case BasisKind::kQuadratic:
      break;
  }
  // The tent times 1 - a |x - 1|.
  const double most = std::max(1.0, 1 - basis.a);
  while (true) {
    const double x = random.Uniform() + random.Uniform();
    if (random.Uniform() * most < 1 - basis.a * std::abs(x - 1)) return x;
  }
}

// sum max(C, 0) Phi and sum C Phi at u, over one texel.
struct Densities {
  double positive = 0, all = 0;
};

Densities DensitiesAt(const LightField& field, lightfield::Vec2 u, std::size_t texel) {
  const auto& grid = field.geometry.grid;
  const double x = (u.x - grid.u0_m) / grid.spacing_m, y = (u.y - grid.v0_m) / grid.spacing_m;
  const int i1 = static_cast<int>(std::floor(x)), j1 = static_cast<int>(std::floor(y));
  Densities sums;
  for (int j = std::max(0, j1 - grid.basis.cells + 1); j <= std::min(j1, grid.height - 1); ++j)
    for (int i = std::max(0, i1 - grid.basis.cells + 1); i <= std::min(i1, grid.width - 1); ++i) {
      const double term = Coefficient(field, grid.index(i, j), texel) * grid.Phi(i, j, u);
      sums.all += term;
      sums.positive += std::max(term, 0.0);
    }
  return sums;
}

}  // namespace

RaySampler::RaySampler(std::span<const lightfield::PosedLightField> fields, const std::string& file)
    : fields_(fields) {
  double positive = 0, negative = 0;
  for (const auto& posed : fields) {
    const auto& g = posed.field.geometry;
    first_row_.push_back(cumulative_.size());
    const double flux_of_one = g.lattice.texel_area_m2() * g.grid.PhiIntegral();
    for (int m = 0; m < g.grid.count(); ++m)
      for (int row = 0; row < g.lattice.height; ++row) {
        for (int column = 0; column < g.lattice.width; ++column) {
          const double c = Coefficient(posed.field, m, std::size_t(row) * g.lattice.width + column);
          (c > 0 ? positive : negative) += flux_of_one * std::abs(c);
        }
        cumulative_.push_back(positive);
      }
  }
  first_row_.push_back(cumulative_.size());
  flux_ = positive - negative;
  if (!(flux_ > 0))
    throw InputError(file, "has no light to draw rays from", "name a lamp that shines");
  positive_flux_ = positive;
}

RaySampler::Row RaySampler::RowOf(std::size_t index) const {
  const auto after = std::upper_bound(first_row_.begin(), first_row_.end(), index);
  const auto field = static_cast<std::size_t>(after - first_row_.begin()) - 1;
  const int within = static_cast<int>(index - first_row_[field]);
  const int height = fields_[field].field.geometry.lattice.height;
  return {field, within / height, within % height};
}

DrawnRay RaySampler::Draw(core::Random& random) const {
  for (DrawnRay ray;; ++ray.proposals) {
    const double target = random.Uniform() * cumulative_.back();
    const auto at = static_cast<std::size_t>(
        std::upper_bound(cumulative_.begin(), cumulative_.end(), target) - cumulative_.begin());
    const Row row = RowOf(std::min(at, cumulative_.size() - 1));
    const auto& [name, pose, field] = fields_[row.field];
    const auto& g = field.geometry;
    // The texel in the row, by the same target.
    const double flux_of_one = g.lattice.texel_area_m2() * g.grid.PhiIntegral();
    double rest = (target - (at == 0 ? 0 : cumulative_[at - 1])) / flux_of_one;
    int column = -1;
    const std::size_t row_start = std::size_t(row.row) * g.lattice.width;
    for (int k = 0; k < g.lattice.width; ++k) {
      const double c = Coefficient(field, row.image, row_start + k);
      if (!(c > 0)) continue;
      column = k;  // the last of them, where rounding leaves a rest
      if (rest < c) break;
      rest -= c;
    }
    if (column < 0) continue;
    const int i = row.image % g.grid.width, j = row.image / g.grid.width;
    const double h = g.grid.spacing_m;
    const double du = DrawFromBasis(g.grid.basis, random);
    const double dv = DrawFromBasis(g.grid.basis, random);
    const lightfield::Vec2 u{g.grid.u0_m + (i + du) * h, g.grid.v0_m + (j + dv) * h};
    const double fraction_s = random.Uniform(), fraction_t = random.Uniform();
    const lightfield::Vec2 s{g.lattice.s_of_column(column + fraction_s),
                             g.lattice.t_of_row(row.row + fraction_t)};
    if (positive_flux_ > flux_) {
      const Densities density = DensitiesAt(field, u, row_start + std::size_t(column));
      if (random.Uniform() * density.positive >= density.all) continue;
    }
    ray.position_m = pose.Point({u.x, u.y, 0});
    ray.direction = pose.Direction(lightfield::Normalized({s.x - u.x, s.y - u.y, g.delta_m}));
    if (g.channels == 3) {
      const auto rgb = FluxDensity(field, u, s);
      const double luminance = core::Luminance({rgb[0], rgb[1], rgb[2]});
      if (luminance > 0)
        for (std::size_t c = 0; c < 3; ++c) ray.colour[c] = rgb[c] / luminance;
    }
    return ray;
  }
}

}  // namespace luxfield::preprocess
