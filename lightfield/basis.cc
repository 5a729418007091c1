#include "luxfield/lightfield/basis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/quadrature.h"

namespace luxfield::lightfield {
namespace {

constexpr const char* kNames[] = {"box", "bilinear", "quadratic", "bspline2"};

// Calls piece(cell, x0, x1) for the part of [x0, x1] in every cell of the support.
template <typename Piece>
void ForEachCell(const Basis& basis, double x0, double x1, Piece&& piece) {
  for (int cell = 0; cell < basis.cells; ++cell) {
    const double a = std::max<double>(x0, cell), b = std::min<double>(x1, cell + 1);
    if (a < b) piece(cell, a, b);
  }
}

}  // namespace

Basis Basis::Make(BasisKind kind, double a) {
  Basis basis;
  basis.kind = kind;
  switch (kind) {
    case BasisKind::kBox:
      basis.cells = 1;
      basis.c = {{{1, 0, 0}}};
      break;
    case BasisKind::kBilinear:
      basis.cells = 2;
      basis.c = {{{0, 1, 0}, {1, -1, 0}}};
      break;
    case BasisKind::kQuadratic:
      if (!(a >= -1 && a <= 1))
        throw InputError(fmt::format(
            "shape parameter a = {} of basis 'quadratic' is outside [-1, 1]; use 0.5", a));
      basis.cells = 2;
      basis.c = {{{0, 1 - a, a}, {1, -1 - a, a}}};
      basis.a = a;
      break;
    case BasisKind::kBspline2:
      basis.cells = 3;
      basis.c = {{{0, 0, 0.5}, {0.5, 1, -1}, {0.5, -1, 0.5}}};
      break;
  }
  return basis;
}

Basis Basis::FromName(const std::string& name, double a) {
  for (int kind = 0; kind < 4; ++kind)
    if (name == kNames[kind]) return Make(static_cast<BasisKind>(kind), a);
  throw InputError(
      fmt::format("unknown basis '{}'; use box, bilinear, quadratic or bspline2", name));
}

std::string Basis::name() const { return kNames[static_cast<int>(kind)]; }

double Basis::Value(double x) const {
  if (!(x >= 0 && x < cells)) return 0;
  const int cell = static_cast<int>(x);
  return CellValue(cell, x - cell);
}

double Basis::Integral(double x0, double x1) const {
  double sum = 0;
  ForEachCell(*this, x0, x1, [&](int cell, double from, double to) {
    sum += Gauss2(from, to, [&](double x) { return CellValue(cell, x - cell); });
  });
  return sum;
}

double Basis::FirstMoment(double x0, double x1, double origin) const {
  double sum = 0;
  ForEachCell(*this, x0, x1, [&](int cell, double from, double to) {
    sum += Gauss2(from, to, [&](double x) { return (x - origin) * CellValue(cell, x - cell); });
  });
  return sum;
}

double Basis::Peak() const {
  double peak = 0;
  for (int cell = 0; cell < cells; ++cell) {
    const auto& p = c[static_cast<std::size_t>(cell)];
    peak = std::max({peak, CellValue(cell, 0), CellValue(cell, 1)});
    const double vertex = p[2] != 0 ? -p[1] / (2 * p[2]) : 0;
    if (vertex > 0 && vertex < 1) peak = std::max(peak, CellValue(cell, vertex));
  }
  return peak;
}

double Basis::Gram(double offset) const { return GramClipped(offset, 0, cells); }

double Basis::GramClipped(double offset, double lo, double hi) const {
  double sum = 0;
  ForEachCell(*this, lo, hi, [&](int cell, double from, double to) {
    ForEachCell(*this, from - offset, to - offset, [&](int other, double from2, double to2) {
      sum += Gauss3(from2, to2, [&](double x) {
        return CellValue(cell, x + offset - cell) * CellValue(other, x - other);
      });
    });
  });
  return sum;
}

double Basis::DualValue(double x_from_centre) const {
  if (kind != BasisKind::kBilinear && kind != BasisKind::kQuadratic)
    throw InputError(
        fmt::format("basis '{}' has no dual filter here; use bilinear or quadratic", name()));
  const double x = std::abs(x_from_centre);
  if (!(x <= 1)) return 0;
  const double b = (10 - 5 * a) / (5 - 2 * a);
  return 3 * (1 - x) * (1 - b * x);
}

std::array<double, 2> Basis::DualPeaks() const {
  // Per axis the function is largest at its centre and lowest in the middle of its negative lobe
  // (1 - |x|)(1 - b|x|), |x| in (1/b, 1): at (1 + 1/b) / 2. The 2-D function is positive where both
  // factors agree in sign.
  const double high = DualValue(0);
  const double b = (10 - 5 * a) / (5 - 2 * a);
  const double low = b > 1 ? DualValue(0.5 * (1 + 1 / b)) : 0;
  return {std::max(high * high, low * low), -low * high};
}

BasisGrid BasisGrid::Centred(const Basis& basis, int width, int height, double spacing_m) {
  BasisGrid grid;
  grid.basis = basis;
  grid.width = width;
  grid.height = height;
  grid.spacing_m = spacing_m;
  grid.u0_m = -0.5 * (width + basis.cells - 1) * spacing_m;
  grid.v0_m = -0.5 * (height + basis.cells - 1) * spacing_m;
  return grid;
}

std::vector<double> GramMatrix(const Basis& basis, int count, double spacing_m) {
  std::vector<double> gram(static_cast<std::size_t>(count) * count);
  for (int i = 0; i < count; ++i)
    for (int m = 0; m < count; ++m)
      gram[static_cast<std::size_t>(i) * count + m] = spacing_m * basis.Gram(std::abs(m - i));
  return gram;
}

std::vector<double> GramMatrixClipped(const Basis& basis, int count, double spacing_m, double lo_m,
                                      double hi_m) {
  std::vector<double> gram(static_cast<std::size_t>(count) * count);
  for (int i = 0; i < count; ++i)
    for (int m = i; m < count; ++m) {
      const double value =
          spacing_m * basis.GramClipped(m - i, lo_m / spacing_m - i, hi_m / spacing_m - i);
      gram[static_cast<std::size_t>(i) * count + m] = value;
      gram[static_cast<std::size_t>(m) * count + i] = value;
    }
  return gram;
}

}  // namespace luxfield::lightfield
