#include "luxfield/core/primaries.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"

namespace luxfield::core {
namespace {

constexpr Matrix3 kBradford = {
    {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};

Matrix3 Product(const Matrix3& a, const Matrix3& b) {
  Matrix3 product{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) product[i][j] += a[i][k] * b[k][j];
  return product;
}

double Cofactor(const Matrix3& m, std::size_t i, std::size_t j) {
  const std::size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
  return m[a][c] * m[b][d] - m[a][d] * m[b][c];
}

double Determinant(const Matrix3& m) {
  return m[0][0] * Cofactor(m, 0, 0) + m[0][1] * Cofactor(m, 0, 1) + m[0][2] * Cofactor(m, 0, 2);
}

Matrix3 Inverse(const Matrix3& m) {
  const double determinant = Determinant(m);
  Matrix3 inverse;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) inverse[j][i] = Cofactor(m, i, j) / determinant;
  return inverse;
}

Rgb WhiteXyz(Chromaticity c) { return {c.x / c.y, 1, (1 - c.x - c.y) / c.y}; }

// XYZ under one white to XYZ under another.
Matrix3 Adaptation(Chromaticity from, Chromaticity to) {
  const Rgb cones_from = Apply(kBradford, WhiteXyz(from)),
            cones_to = Apply(kBradford, WhiteXyz(to));
  Matrix3 scale{};
  for (std::size_t k = 0; k < 3; ++k) scale[k][k] = cones_to[k] / cones_from[k];
  return Product(Inverse(kBradford), Product(scale, kBradford));
}

}  // namespace

Rgb Apply(const Matrix3& m, const Rgb& v) {
  Rgb product{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) product[i] += m[i][k] * v[k];
  return product;
}

Matrix3 XyzFromRgb(const Primaries& p) {
  const Chromaticity corners[] = {p.red, p.green, p.blue};
  Matrix3 columns;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [x, y] = corners[k];
    columns[0][k] = x, columns[1][k] = y, columns[2][k] = 1 - x - y;
  }
  // NaN fails as well.
  if (!(p.white.y > 0) || !(std::abs(Determinant(columns)) > 1e-6))
    throw InputError(fmt::format(
        "primaries ({} {}), ({} {}), ({} {}) with white ({} {}) span no colours", p.red.x, p.red.y,
        p.green.x, p.green.y, p.blue.x, p.blue.y, p.white.x, p.white.y));
  const Rgb amount = Apply(Inverse(columns), WhiteXyz(p.white));
  for (auto& row : columns)
    for (std::size_t k = 0; k < 3; ++k) row[k] *= amount[k];
  return columns;
}

Matrix3 Rec709FromRgb(const Primaries& primaries) {
  return Product(Inverse(XyzFromRgb(kRec709)),
                 Product(Adaptation(primaries.white, kD65), XyzFromRgb(primaries)));
}

Rgb Rec709FromXyz(const Rgb& xyz) {
  static const Matrix3 matrix = Inverse(XyzFromRgb(kRec709));
  return Apply(matrix, xyz);
}

Rgb IntoGamut(const Rgb& rgb) {
  const double luminance = Luminance(rgb), least = *std::min_element(rgb.begin(), rgb.end());
  if (!(luminance > 0)) return {};
  if (least >= 0) return rgb;
  const double keep = luminance / (luminance - least);
  Rgb mixed;
  for (std::size_t k = 0; k < 3; ++k)
    mixed[k] = std::max(0.0, luminance + keep * (rgb[k] - luminance));
  return mixed;
}

}  // namespace luxfield::core
