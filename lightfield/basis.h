// Reconstruction bases on the filter plane F: piecewise polynomials on n cells of width h
// (docs/theory.md 2).
//
// One basis is one table of n x 3 polynomial coefficients; everything else here, and the OpenCL
// kernels, read that table. x is in units of the spacing h throughout; multiply integrals by h (h^2
// in 2-D).
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::lightfield {

enum class BasisKind { kBox, kBilinear, kQuadratic, kBspline2 };

// B(x) = c[k][0] + c[k][1] f + c[k][2] f^2 on cell k = floor(x), f = x - k, 0 <= k < n; 0 outside
// [0, n).
struct Basis {
  static constexpr int kMaxCells = 3;

  BasisKind kind = BasisKind::kBspline2;
  int cells = 3;  // n
  std::array<std::array<double, 3>, kMaxCells> c{};
  double a = 0;  // the shape parameter of `quadratic`, else 0

  // `a` is read for kQuadratic only: (1 - |x|)(1 - a|x|), a in [-1, 1] (Goesele et al. 2003;
  // default 1/2). InputError if that a is outside [-1, 1].
  static Basis Make(BasisKind kind, double a = 0.5);
  static Basis FromName(const std::string& name, double a = 0.5);  // InputError on unknown names
  std::string name() const;  // "box", "bilinear", "quadratic", "bspline2"

  double Value(double x) const;
  // The polynomial of cell k at f = x - k, any f.
  double CellValue(int cell, double f) const {
    const auto& p = c[static_cast<std::size_t>(cell)];
    return p[0] + f * (p[1] + f * p[2]);
  }
  // Integral of B over [x0, x1], x0 <= x1, any reals; exact up to rounding.
  double Integral(double x0, double x1) const;
  // Integral of (x - origin) B(x) over [x0, x1].
  double FirstMoment(double x0, double x1, double origin) const;
  double TotalIntegral() const {
    return Integral(0, cells);
  }                     // 1 for bspline2, 1 - a/3 for quadratic
  double Peak() const;  // largest value: 1, 1, 1, 3/4

  // <B(. - 0), B(. - offset)> = integral of B(x) B(x - offset), any real offset; exact (piecewise
  // Gauss-Legendre of sufficient order on the merged knots). bspline2: 11/20, 13/60, 1/120 at 0,
  // 1, 2.
  double Gram(double offset) const;
  // The same restricted to x in [lo, hi]: supports clipped by the border of F.
  double GramClipped(double offset, double lo, double hi) const;

  // The dual filter of the family (1 - |x|)(1 - a|x|) on [-1, 1] (Goesele), x from the centre of
  // the support, in [-1, 1]:
  //
  //   Phi*(x) = 3 (1 - |x|)(1 - b|x|),   b = (10 - 5a) / (5 - 2a),   <Phi*_i, Phi_m> = delta_im
  //
  // Only for kBilinear (a = 0) and kQuadratic; InputError otherwise.
  double DualValue(double x_from_centre) const;
  // Largest value of +Phi* and of -Phi* in 2-D, the scales of the two dual prints (9 and 0.919 at
  // a = 1/2):
  //
  //   T(+-) = max(+-Phi*, 0) / peak(+-),   E = peak(+) E(+) - peak(-) E(-)
  std::array<double, 2> DualPeaks() const;

  bool operator==(const Basis&) const = default;
};

// W x H basis functions on F: Phi_ij(u) = B((u - u0)/h - i) B((v - v0)/h - j). The support of basis
// i is [u0 + i h, u0 + (i + n) h]. Image index m = j * W + i everywhere.
struct BasisGrid {
  Basis basis = Basis::Make(BasisKind::kBspline2);
  int width = 0, height = 0;  // W along u, H along v
  double u0_m = 0, v0_m = 0;  // lower support corner of basis 00
  double spacing_m = 0;       // h

  int count() const { return width * height; }
  int index(int i, int j) const { return j * width + i; }
  Vec2 centre(int i, int j) const {  // c_ij: the middle of the support
    return {u0_m + (i + 0.5 * basis.cells) * spacing_m, v0_m + (j + 0.5 * basis.cells) * spacing_m};
  }
  double Phi(int i, int j, Vec2 u) const {
    return basis.Value((u.x - u0_m) / spacing_m - i) * basis.Value((u.y - v0_m) / spacing_m - j);
  }
  // Integral of Phi_ij over F, m^2.
  double PhiIntegral() const {
    const double one = basis.TotalIntegral() * spacing_m;
    return one * one;
  }
  // The grid whose whole support is centred on the luminaire's axis.
  static BasisGrid Centred(const Basis& basis, int width, int height, double spacing_m);

  bool operator==(const BasisGrid&) const = default;
};

// 1-D Gram matrix, count x count row-major, in metres: G[i][m] = h <B(. - i), B(. - m)>.
std::vector<double> GramMatrix(const Basis& basis, int count, double spacing_m);
// The same with every support clipped to [lo_m, hi_m] (coordinates measured from u0).
std::vector<double> GramMatrixClipped(const Basis& basis, int count, double spacing_m, double lo_m,
                                      double hi_m);

}  // namespace luxfield::lightfield
