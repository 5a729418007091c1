// Irradiance and reflected radiance by dense Gauss-Legendre quadrature in double, independent of
// every closed form in luxfield: the basis is written out again, the integral is docs/theory.md 7's
// over I (or over F), cell by cell of texel x knot.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::render {

// 1-D bases from their formulas in docs/theory.md 2, y in [0, n].
inline double BasisByFormula(const lightfield::Basis& basis, double y) {
  using lightfield::BasisKind;
  if (y <= 0 || y >= basis.cells) return 0;
  const double from_centre = std::abs(y - 1);
  switch (basis.kind) {
    case BasisKind::kBox:
      return 1;
    case BasisKind::kBilinear:
      return 1 - from_centre;
    case BasisKind::kQuadratic:
      return (1 - from_centre) * (1 - basis.a * from_centre);
    case BasisKind::kBspline2:
      return y < 1 ? 0.5 * y * y : y < 2 ? 0.5 * (-2 * y * y + 6 * y - 3) : 0.5 * (3 - y) * (3 - y);
  }
  return 0;
}

// Calls visit(flux, u - p) for the nodes of a quadrature of
//   delta^2 / z^3 sum_m integral C_m(s(u)) Phi_m(u) ... du
// of channel 0, flux being everything but the dots: pieces bounded by knots and by the texel edges'
// projections, cut into splits^2 parts of 8 x 8 Gauss nodes each (4 x 4 are exact for polynomials
// of the light vector's degree).
template <typename Visit>
void VisitLight(const lightfield::LightField& field, lightfield::Vec3 p, int splits,
                const Visit& visit) {
  static const std::array<double, 4> node{0.18343464249564980, 0.52553240991632899,
                                          0.79666647741362674, 0.96028985649753623};
  static const std::array<double, 4> weight{0.36268378337836198, 0.31370664587788729,
                                            0.22238103445337447, 0.10122853629037626};
  const auto& g = field.geometry;
  const double z = p.z, D = z - g.delta_m, h = g.grid.spacing_m;
  struct Piece {
    double begin, end;  // on F, m
    int texel;
  };
  // Pieces of one support along one axis; s = u0 + kappa u with texel(s).
  const auto pieces = [&](double corner, double p_axis, bool is_u) {
    std::vector<double> cuts;
    for (int k = 0; k <= g.grid.basis.cells; ++k) cuts.push_back(corner + k * h);
    const int texels = is_u ? g.lattice.width : g.lattice.height;
    for (int e = 0; e <= texels; ++e) {
      const double s = is_u ? g.lattice.s_of_column(e) : g.lattice.t_of_row(e);
      if (D != 0) {
        const double u = (s * z - p_axis * g.delta_m) / D;
        if (u > cuts.front() && u < corner + g.grid.basis.cells * h) cuts.push_back(u);
      }
    }
    std::sort(cuts.begin(), cuts.end());
    std::vector<Piece> out;
    for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
      const double u = 0.5 * (cuts[k] + cuts[k + 1]);
      const double s = (u * D + p_axis * g.delta_m) / z;
      const double at = is_u ? g.lattice.column_of_s(s) : g.lattice.row_of_t(s);
      if (!(at >= 0 && at < texels && cuts[k] < cuts[k + 1])) continue;
      const double length = (cuts[k + 1] - cuts[k]) / splits;
      for (int part = 0; part < splits; ++part)
        out.push_back(
            {cuts[k] + part * length, cuts[k] + (part + 1) * length, static_cast<int>(at)});
    }
    return out;
  };
  const double scale = g.delta_m * g.delta_m / (z * z * z);
  for (int j = 0; j < g.grid.height; ++j) {
    const double v0 = g.grid.v0_m + j * h;
    const auto rows = pieces(v0, p.y, false);
    for (int i = 0; i < g.grid.width; ++i) {
      const double u0 = g.grid.u0_m + i * h;
      const auto columns = pieces(u0, p.x, true);
      for (const Piece& row : rows)
        for (const Piece& column : columns) {
          const double c =
              field.image(g.grid.index(i, j), 0)[row.texel * g.lattice.width + column.texel];
          const double half_u = 0.5 * (column.end - column.begin),
                       half_v = 0.5 * (row.end - row.begin);
          for (int a = 0; a < 8; ++a)
            for (int b = 0; b < 8; ++b) {
              const double u = column.begin + half_u * (1 + (a < 4 ? node[a] : -node[a - 4]));
              const double v = row.begin + half_v * (1 + (b < 4 ? node[b] : -node[b - 4]));
              visit(scale * c * BasisByFormula(g.grid.basis, (u - u0) / h) *
                        BasisByFormula(g.grid.basis, (v - v0) / h) * weight[a % 4] * weight[b % 4] *
                        half_u * half_v,
                    lightfield::Vec3{u - p.x, v - p.y, -z});
            }
        }
    }
  }
}

// The light vector J(p) of channel 0 and, where the receiver's horizon cuts, sum of clipped
// integrand values.
struct BruteForce {
  lightfield::Vec3 j;
  double irradiance = 0;
};

inline BruteForce BruteForceIrradiance(const lightfield::LightField& field, lightfield::Vec3 p,
                                       lightfield::Vec3 n) {
  BruteForce sum;
  VisitLight(field, p, 1, [&](double flux, lightfield::Vec3 to_lamp) {
    sum.j = sum.j + flux * to_lamp;
    sum.irradiance += flux * std::max(0.0, Dot(n, to_lamp));
  });
  return sum;
}

// Radiance of channel 0 towards an eye: the same integral with f_r(w) (n.(u - p))+; `brdf` takes
// the unit direction to the light.
template <typename Brdf>
double BruteForceRadiance(const lightfield::LightField& field, lightfield::Vec3 p,
                          lightfield::Vec3 n, int splits, const Brdf& brdf) {
  double sum = 0;
  VisitLight(field, p, splits, [&](double flux, lightfield::Vec3 to_lamp) {
    const double cosine = Dot(n, to_lamp);
    if (cosine > 0 && flux != 0) sum += flux * cosine * brdf(Normalized(to_lamp));
  });
  return sum;
}

}  // namespace luxfield::render
