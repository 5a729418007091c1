#include "luxfield/photometry/point_nodes.h"

#include <algorithm>
#include <cmath>

#include "luxfield/lightfield/projected_texels.h"

namespace luxfield::photometry {
namespace {

using lightfield::PencilAxis;
using lightfield::TexelAxis;

// Abramowitz & Stegun 25.4.30, n = 4.
constexpr std::array<double, 4> kGaussX = {-0.861136311594053, -0.339981043584856,
                                           0.339981043584856, 0.861136311594053};
constexpr std::array<double, 4> kGaussW = {0.347854845137454, 0.652145154862546, 0.652145154862546,
                                           0.347854845137454};

std::vector<PointNode> NodesOf(const lightfield::Basis& basis, double u0_m, double h, int count,
                               const TexelAxis& texels, const PencilAxis& pencil, int parts) {
  std::vector<PointNode> nodes;
  const auto texel_of = [&](double w) {
    return std::floor((pencil.s_pivot_m + w * pencil.s_per_w - texels.origin_m) / texels.step_m);
  };
  const auto add_piece = [&](double lo, double hi, int cell, double start) {
    const double texel = texel_of(0.5 * (lo + hi)), half = 0.5 * (hi - lo) / parts;
    if (!(half > 0 && texel >= 0 && texel < texels.count)) return;
    for (int part = 0; part < parts; ++part)
      for (std::size_t k = 0; k < kGaussX.size(); ++k) {
        const double w = lo + half * (2 * part + 1 + kGaussX[k]);
        PointNode node{
            w + pencil.moment_offset_m, half * kGaussW[k], cell, static_cast<int>(texel), {}};
        for (int n = 0; n < basis.cells; ++n)
          node.phi[n] = basis.CellValue(basis.cells - 1 - n, (w - start) / h);
        nodes.push_back(node);
      }
  };
  std::vector<double> breaks;
  for (int cell = 0; cell < count + basis.cells - 1; ++cell) {
    const double a = u0_m + cell * h - pencil.u_pivot_m, b = a + h;
    breaks.assign({a, b});
    const double from = std::clamp(std::min(texel_of(a), texel_of(b)), -1.0, 1.0 * texels.count);
    const double to = std::clamp(std::max(texel_of(a), texel_of(b)), -1.0, 1.0 * texels.count);
    for (double k = from + 1; k <= to; ++k)
      breaks.push_back(std::clamp(
          (texels.origin_m - pencil.s_pivot_m + k * texels.step_m) / pencil.s_per_w, a, b));
    std::sort(breaks.begin(), breaks.end());
    for (std::size_t k = 0; k + 1 < breaks.size(); ++k)
      add_piece(breaks[k], breaks[k + 1], cell, a);
  }
  return nodes;
}

// The first texel along an axis and how many there are.
std::pair<int, int> TexelsOf(const std::vector<PointNode>& nodes) {
  if (nodes.empty()) return {};
  const auto [least, most] =
      std::minmax_element(nodes.begin(), nodes.end(),
                          [](const PointNode& a, const PointNode& b) { return a.texel < b.texel; });
  return {least->texel, most->texel - least->texel + 1};
}

}  // namespace

PointNodes NodesAt(const lightfield::LuminaireGeometry& g, lightfield::Vec3 p, int parts) {
  if (!(p.z > 0)) return {};
  const lightfield::BasisGrid& grid = g.grid;
  PointNodes nodes;
  nodes.x =
      NodesOf(grid.basis, grid.u0_m, grid.spacing_m, grid.width, TexelAxis::Columns(g.lattice),
              PencilAxis::ThroughPoint(p.x, p.z, g.delta_m), parts);
  nodes.y = NodesOf(grid.basis, grid.v0_m, grid.spacing_m, grid.height, TexelAxis::Rows(g.lattice),
                    PencilAxis::ThroughPoint(p.y, p.z, g.delta_m), parts);
  nodes.z = p.z;
  nodes.scale = g.delta_m / p.z * (g.delta_m / p.z) / p.z;
  nodes.width = grid.width;
  nodes.height = grid.height;
  nodes.cells = grid.basis.cells;
  return nodes;
}

TexelWindow WindowOf(const PointNodes& nodes) {
  const auto [row0, rows] = TexelsOf(nodes.y);
  const auto [column0, columns] = TexelsOf(nodes.x);
  return {row0, rows, column0, columns};
}

}  // namespace luxfield::photometry
