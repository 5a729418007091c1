#include "reconstruct/basis_truncation.h"

#include <Eigen/Dense>
#include <cmath>

#include "core/colour.h"
#include "lightfield/quadrature.h"
#include "reconstruct/filter_profile.h"

namespace luxfield::reconstruct {
namespace {

using Eigen::MatrixXd;
using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::FilterKind;
using lightfield::LightField;

// B(x / 2) = sum over k of these B(x - k).
std::vector<double> TwoScale(const lightfield::Basis& basis) {
  switch (basis.kind) {
    case BasisKind::kBox:
      return {1, 1};
    case BasisKind::kQuadratic:
      if (basis.a != 0) return {};
      [[fallthrough]];
    case BasisKind::kBilinear:
      return {0.5, 1, 0.5};
    case BasisKind::kBspline2:
      return {0.25, 0.75, 0.75, 0.25};
  }
  return {};
}

// What the coarser dual function, which begins at `from`, measures of the fine functions.
Eigen::RowVectorXd CoarseDual(const Basis& basis, int count, int from) {
  const FilterProfile dual(FilterKind::kDual, basis);
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(count);
  for (int i = 0; i < count; ++i)
    for (int cell = 0; cell < 2 * basis.cells; ++cell)
      row(i) += lightfield::Gauss3(cell, cell + 1, [&](double x) {
        return 0.5 * dual.Value(0.5 * x) * basis.Value(x + from - i);
      });
  return row;
}

// The projection of one axis, count x count; empty where there is none.
MatrixXd Projection(const Basis& basis, FilterKind filter, int count) {
  const std::vector<double> mask = TwoScale(basis);
  const int width = static_cast<int>(mask.size());
  if (width == 0) return {};
  // Coarse functions begin at even places from `first` on; those that reach over the border are
  // taken as far as there are fine ones.
  const int first = -((width - 1) / 2) * 2, coarse = (count - first + 1) / 2;
  if (coarse >= count) return {};
  MatrixXd refine = MatrixXd::Zero(count, coarse);
  for (int c = 0; c < coarse; ++c)
    for (int k = 0; k < width; ++k) {
      const int i = first + 2 * c + k;
      if (i >= 0 && i < count) refine(i, c) = mask[static_cast<std::size_t>(k)];
    }
  MatrixXd measure(coarse, count);
  if (filter == FilterKind::kDual) {
    for (int c = 0; c < coarse; ++c) measure.row(c) = CoarseDual(basis, count, first + 2 * c);
  } else {
    const std::vector<double> entries = lightfield::GramMatrix(basis, count, 1);
    measure =
        refine.transpose() * Eigen::Map<const MatrixXd>(entries.data(), count, count);  // symmetric
  }
  return refine * (measure * refine).partialPivLu().solve(measure);
}

}  // namespace

LightField KeepingEvenLamps(const LightField& field, FilterKind filter) {
  LightField smooth = field;
  Basis& basis = smooth.geometry.grid.basis;
  if (basis.kind != BasisKind::kQuadratic) return smooth;
  // An even lamp of 1 is seen as the profile's integral, and C times what all functions together
  // are seen as is that: C = integral / sum of overlaps, per axis. (Their support is two cells.)
  const FilterProfile profile(filter, basis);
  double even = 0, sum = 0;
  for (int cell = 0; cell < basis.cells; ++cell)
    even += lightfield::Gauss3(cell, cell + 1, [&](double x) { return profile.Value(x); });
  for (int offset = 1 - basis.cells; offset < basis.cells; ++offset) sum += profile.Overlap(offset);
  const double factor = std::pow(sum / even, 2);
  for (float& c : smooth.data) c = static_cast<float>(factor * c);
  basis = Basis::Make(BasisKind::kBilinear);
  return smooth;
}

std::optional<LightField> Coarsened(const LightField& field, FilterKind filter) {
  const auto& grid = field.geometry.grid;
  const MatrixXd u = Projection(grid.basis, filter, grid.width),
                 v = Projection(grid.basis, filter, grid.height);
  if (u.size() == 0 || v.size() == 0) return {};
  const std::size_t values = field.geometry.plane_size() * field.geometry.channels;
  // Double between the axes.
  std::vector<double> along_u(field.data.size(), 0.0), row(values);
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      double* out = along_u.data() + static_cast<std::size_t>(grid.index(i, j)) * values;
      for (int k = 0; k < grid.width; ++k) {
        const float* in = field.data.data() + static_cast<std::size_t>(grid.index(k, j)) * values;
        for (std::size_t p = 0; p < values; ++p) out[p] += u(i, k) * in[p];
      }
    }
  LightField result(field.geometry);
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      std::fill(row.begin(), row.end(), 0.0);
      for (int k = 0; k < grid.height; ++k) {
        const double* in = along_u.data() + static_cast<std::size_t>(grid.index(i, k)) * values;
        for (std::size_t p = 0; p < values; ++p) row[p] += v(j, k) * in[p];
      }
      float* out = result.data.data() + static_cast<std::size_t>(grid.index(i, j)) * values;
      for (std::size_t p = 0; p < values; ++p) out[p] = static_cast<float>(row[p]);
    }
  return result;
}

BasisTruncation::BasisTruncation(const LightField& field, FilterKind filter)
    : field_(field),
      smooth_(KeepingEvenLamps(field, filter)),
      coarse_(Coarsened(smooth_, filter)) {}

std::optional<double> BasisTruncation::Bound(const Quantity& quantity) const {
  if (!coarse_) return {};
  const double smooth = quantity(smooth_);
  return std::abs(quantity(field_) - smooth) + std::abs(smooth - quantity(*coarse_));
}

std::optional<double> BasisTruncation::BoundOfRay(lightfield::Vec2 u_m,
                                                  lightfield::Vec2 s_m) const {
  if (!coarse_) return {};
  constexpr int kHalf = 2;
  const double step_m = field_.geometry.grid.spacing_m / kHalf;
  double sum = 0;
  for (int y = -kHalf; y <= kHalf; ++y)
    for (int x = -kHalf; x <= kHalf; ++x)
      sum += std::pow(*Bound([&](const LightField& field) {
        const lightfield::Vec2 u = u_m + lightfield::Vec2{x * step_m, y * step_m};
        return core::Luminance(Radiance(field, u, s_m));
      }),
                      2);
  return std::sqrt(sum) / (2 * kHalf + 1);
}

}  // namespace luxfield::reconstruct
