// The rule behind integrals over the directions in which light is seen from a point that have no
// closed form (functional.h): Gauss nodes on F between knots and borders of texels as seen from there,
//
//   integral L(w) k(w) dw = delta^2 / z^3 sum_m integral_F C_m(s(u)) Phi_m(u) k(w) |u - p| du
//
// p = (x, y, z) and w in the field's own frame, metres.
#pragma once

#include <array>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/photometry/functional.h"

namespace luxfield::photometry {

struct PointNode {
  double offset = 0;  // u - p
  double weight = 0;  // m
  int cell = 0, texel = 0;
  std::array<double, lightfield::Basis::kMaxCells> phi{};  // of functions cell - n + 1 ... cell
};

struct PointNodes {
  std::vector<PointNode> x, y;  // along both axes; empty: F lies before the point
  double z = 0, scale = 0;      // of the point, m; delta^2 / z^3, 1/m
  int width = 0, height = 0;    // of the grid
  int cells = 0;                // of a basis function, along an axis
};

// Four nodes in each of `parts` pieces of every stretch.
PointNodes NodesAt(const lightfield::LuminaireGeometry& g, lightfield::Vec3 p, int parts);

// The texels that nodes lie in.
TexelWindow WindowOf(const PointNodes& nodes);

// visit(m, row, column, weight) of coefficients; one is visited at every node that sees it.
template <typename Kernel, typename Visit>
void ForWeights(const PointNodes& nodes, Kernel&& kernel, Visit&& visit) {
  const int n = nodes.cells;
  for (const PointNode& b : nodes.y)
    for (const PointNode& a : nodes.x) {
      const lightfield::Vec3 to_light{a.offset, b.offset, -nodes.z};
      const double r = lightfield::Length(to_light);
      const double value = nodes.scale * a.weight * b.weight * r * kernel((1 / r) * to_light);
      if (value == 0) continue;
      for (int l = 0; l < n; ++l)
        for (int k = 0; k < n; ++k) {
          const int i = a.cell - n + 1 + k, j = b.cell - n + 1 + l;
          if (i < 0 || i >= nodes.width || j < 0 || j >= nodes.height) continue;
          visit(j * nodes.width + i, b.texel, a.texel, value * a.phi[k] * b.phi[l]);
        }
    }
}

// The integral of one field as weights of its coefficients, k of directions in its own frame.
template <typename Kernel>
FieldFunctional OfKernel(const lightfield::LuminaireGeometry& g, lightfield::Vec3 p, int parts,
                         Kernel&& kernel) {
  const PointNodes nodes = NodesAt(g, p, parts);
  FieldFunctional out;
  const TexelWindow window = WindowOf(nodes);
  if (window.size() == 0) return out;
  out.window = window;
  out.weights.assign(g.grid.count() * window.size(), 0.0);
  ForWeights(nodes, kernel, [&](int m, int row, int column, double weight) {
    out.weights[(std::size_t(m) * window.rows + row - window.row0) * window.columns + column -
                window.column0] += weight;
  });
  return out;
}

}  // namespace luxfield::photometry
