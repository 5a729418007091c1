// Lamps whose photometry has closed forms, and noise for them.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "luxfield/core/random.h"
#include "luxfield/photometry/lamp.h"

namespace luxfield::photometry {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline Lamp LampOfField(lightfield::LightField field) {
  const std::vector<lightfield::PosedLightField> fields = {{"", {}, std::move(field)}};
  return LampOf(fields);
}

// A Lambertian square of radiance 1e6 cd/m^2 in the middle of F. What a line from F to I sees of
// values at the middles of cells and texels is their mean over (s - u), even over both; values less
// half its variance times the Laplacian of f = cos^4 are right on average:
//
//   f = (1 + r^2)^-2,   Laplacian = -8 (1 + r^2)^-3 + 24 r^2 (1 + r^2)^-4,   r = |s - u| / delta
struct LambertianSquare {
  static constexpr double kSide = 0.01, kRadiance = 1e6, kDelta = 0.05;

  static double Intensity(double cosine) { return kRadiance * kSide * kSide * cosine; }
  // Illuminance at distance d on the axis, four times that of a quarter at whose corner the receiver
  // stands (Howell, Menguc and Siegel, Thermal Radiation Heat Transfer, configuration factor B-3).
  static double AxialIlluminance(double d) {
    const double x = 0.5 * kSide / d, root = std::sqrt(1 + x * x);
    return 4 * kRadiance * x / root * std::atan(x / root);
  }
  // So many cells and texels along the square's side, texels over 2 half_width of I.
  static lightfield::LightField Field(int cells, int texels, double half_width) {
    lightfield::LuminaireGeometry g;
    g.delta_m = kDelta;
    const double cell = kSide / cells, texel = kSide / texels;
    g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBox),
                                            cells, cells, cell);
    const int size = static_cast<int>(std::lround(2 * half_width / texel));
    g.lattice = {size, size, -half_width, half_width, texel, texel};
    g.unit = lightfield::FluxUnit::kLumen;
    lightfield::LightField field(g);
    const double variance = (cell * cell + texel * texel) / 12 / kDelta / kDelta;
    for (int m = 0; m < g.grid.count(); ++m)
      for (int row = 0; row < size; ++row)
        for (int column = 0; column < size; ++column) {
          const auto u = g.grid.centre(m % cells, m / cells), s = g.lattice.centre(row, column);
          const double x = (s.x - u.x) / kDelta, y = (s.y - u.y) / kDelta;
          const double c = 1 / (1 + x * x + y * y), laplacian = c * c * c * (-8 + 24 * (1 - c));
          field.image(m, 0)[std::size_t(row) * size + column] = static_cast<float>(
              kRadiance / (kDelta * kDelta) * (c * c - 0.5 * variance * laplacian));
        }
    return field;
  }
  static constexpr double kWidest = 0.6;  // gamma of 85 degrees
  static lightfield::LightField Wide() { return Field(4, 7, kWidest); }
  static lightfield::LightField Fine() { return Field(16, 25, 0.03); }
};

// Cells of F are bright and dark in turn.
inline lightfield::LightField Checkerboard(lightfield::LightField field) {
  const int width = field.geometry.grid.width;
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    if ((m % width + m / width) % 2)
      for (float& c : field.image(m, 0)) c = 0;
  return field;
}

// `bspline2`, no two lengths alike, brightest off the axis.
inline lightfield::LightField SmoothField(int channels = 1) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.31;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                                          4, 3, 0.023);
  g.grid.u0_m += 0.004;
  g.lattice = {17, 15, -0.31, 0.29, 0.037, 0.041};
  g.channels = channels;
  g.unit = lightfield::FluxUnit::kLumen;
  lightfield::LightField field(g);
  for (int m = 0; m < g.grid.count(); ++m)
    for (int channel = 0; channel < channels; ++channel)
      for (int row = 0; row < g.lattice.height; ++row)
        for (int column = 0; column < g.lattice.width; ++column) {
          const auto s = g.lattice.centre(row, column);
          const double x = (s.x - 0.03) / 0.09, y = (s.y + 0.05) / 0.07;
          field.image(m, channel)[std::size_t(row) * g.lattice.width + column] =
              static_cast<float>(1e5 * (1 + 0.2 * m + channel) * std::exp(-0.5 * (x * x + y * y)));
        }
  return field;
}

// G^-1 of one axis: what the plain solve is (docs/theory.md 4).
inline std::vector<double> InverseGram(const lightfield::BasisGrid& grid, int count) {
  const auto gram = lightfield::GramMatrix(grid.basis, count, grid.spacing_m);
  const Matrix inverse = Eigen::Map<const Matrix>(gram.data(), count, count).inverse();
  return {inverse.data(), inverse.data() + inverse.size()};
}

inline SolveMaps PlainMaps(const lightfield::BasisGrid& grid) {
  return {InverseGram(grid, grid.width), InverseGram(grid, grid.height)};
}

// Standard deviations of E, uneven from filter to filter and texel to texel; maps bring them to C.
class NoisyField {
 public:
  NoisyField(lightfield::LightField field, SolveMaps maps, double relative)
      : field_(std::move(field)), maps_(std::move(maps)) {
    const auto& g = field_.geometry;
    const double h2 = g.grid.spacing_m * g.grid.spacing_m;
    for (std::size_t k = 0; k < field_.data.size(); ++k)
      sigma_e_.push_back(relative * h2 * 1e5 * (1 + double(k * 7919 % 13)) / 7);
  }
  const lightfield::LightField& field() const { return field_; }
  const SolveMaps& maps() const { return maps_; }

  lightfield::LightField SigmaOfC() const {
    lightfield::LightField sigma(field_.geometry);
    ForTexels([&](std::size_t offset) {
      const Matrix variance = U().cwiseProduct(U()), of_v = V().cwiseProduct(V());
      const Matrix e = At(sigma_e_, offset);
      Put(sigma, offset, (of_v * e.cwiseProduct(e) * variance.transpose()).cwiseSqrt());
    });
    return sigma;
  }
  lightfield::LightField Draw(core::Random& random) const {
    lightfield::LightField drawn = field_;
    const std::vector<double> c(field_.data.begin(), field_.data.end());
    ForTexels([&](std::size_t offset) {
      Matrix e = At(sigma_e_, offset);
      for (double* x = e.data(); x != e.data() + e.size(); ++x) *x *= random.Normal();
      Put(drawn, offset, At(c, offset) + V() * e * U().transpose());
    });
    return drawn;
  }

 private:
  Matrix U() const { return Square(maps_.u, field_.geometry.grid.width); }
  Matrix V() const { return Square(maps_.v, field_.geometry.grid.height); }
  static Matrix Square(const std::vector<double>& map, int n) {
    return map.empty() ? Matrix(Matrix::Identity(n, n))
                       : Matrix(Eigen::Map<const Matrix>(map.data(), n, n));
  }
  // of(offset of a texel and channel in image 0).
  template <typename F>
  void ForTexels(F&& of) const {
    for (std::size_t k = 0; k < field_.geometry.plane_size() * field_.geometry.channels; ++k) of(k);
  }
  std::size_t Place(int m, std::size_t offset) const {
    return std::size_t(m) * field_.geometry.plane_size() * field_.geometry.channels + offset;
  }
  Matrix At(const std::vector<double>& values, std::size_t offset) const {
    const auto& grid = field_.geometry.grid;
    Matrix at(grid.height, grid.width);
    for (int m = 0; m < grid.count(); ++m)
      at(m / grid.width, m % grid.width) = values[Place(m, offset)];
    return at;
  }
  void Put(lightfield::LightField& into, std::size_t offset, const Matrix& values) const {
    const auto& grid = field_.geometry.grid;
    for (int m = 0; m < grid.count(); ++m)
      into.data[Place(m, offset)] = static_cast<float>(values(m / grid.width, m % grid.width));
  }

  lightfield::LightField field_;
  SolveMaps maps_;
  std::vector<double> sigma_e_;
};

}  // namespace luxfield::photometry
