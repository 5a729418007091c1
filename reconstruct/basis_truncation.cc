#include "reconstruct/basis_truncation.h"

#include <Eigen/Dense>

namespace luxfield::reconstruct {
namespace {

using Eigen::MatrixXd;
using lightfield::BasisKind;

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

// The projection of one axis, count x count; empty where there is none.
MatrixXd Projection(const lightfield::Basis& basis, int count) {
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
  const std::vector<double> entries = lightfield::GramMatrix(basis, count, 1);
  const Eigen::Map<const MatrixXd> gram(entries.data(), count, count);  // symmetric
  const MatrixXd normal = refine.transpose() * gram * refine;
  return refine * normal.ldlt().solve(refine.transpose() * gram);
}

}  // namespace

std::optional<lightfield::LightField> Coarsened(const lightfield::LightField& field) {
  const auto& grid = field.geometry.grid;
  const MatrixXd u = Projection(grid.basis, grid.width), v = Projection(grid.basis, grid.height);
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
  lightfield::LightField result(field.geometry);
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

}  // namespace luxfield::reconstruct
