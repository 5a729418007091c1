#include "luxfield/reconstruct/solve/general_solve.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"

namespace luxfield::reconstruct {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kMostMultiplications = 2e12;  // about ten minutes of one core

// (A^T w A)^-1 and its right-hand side pixel by pixel. The rows' weights are scaled by their
// largest so that small units stay inside the range of the factors.
// With moments kept, C = B C_0 + Y a^T E, B = 1 - Y A^T: as cov(C_0, E) = K A_rows^T for the
// covariance K of C_0, the covariance is B K B^T + B K c Y^T + Y (B K c)^T + Y a^T Sigma a Y^T,
// c = A_rows^T a.
void SolveWeighted(const RowMatrix& a, const PixelGroup& group, const PixelImages& images,
                   const MomentConstraint& kept) {
  std::vector<int> known;
  for (std::size_t r = 0; r < group.known.size(); ++r)
    if (group.known[r]) known.push_back(static_cast<int>(r));
  const RowMatrix rows = a(known, Eigen::all);
  const auto count = static_cast<Eigen::Index>(known.size()), coefficients = a.cols();
  const std::size_t total = group.pixels.size() * images.channels;
  const Eigen::Map<const RowMatrix> integrals(kept.integrals.data(), coefficients, kept.moments),
      step(kept.step.data(), coefficients, kept.moments),
      measured(kept.measured.data(), count, kept.moments);
  const RowMatrix rows_moments = rows.transpose() * measured;  // c
  core::ParallelFor(total, 16, [&](std::size_t begin, std::size_t end) {
    Eigen::VectorXd e(count), w(count);
    RowMatrix weighted(count, coefficients);
    for (std::size_t item = begin; item < end; ++item) {
      const std::size_t at =
          item / group.pixels.size() * images.pixels + group.pixels[item % group.pixels.size()];
      double least = std::numeric_limits<double>::infinity();
      for (Eigen::Index r = 0; r < count; ++r)
        least = std::min<double>(least, images.sigma[known[r]][at]);
      if (!(least > 0))
        throw InputError(
            "measurements: a standard deviation of 0 cannot weigh one measurement against another; "
            "merge the sessions again with the camera's noise model");
      for (Eigen::Index r = 0; r < count; ++r) {
        const double relative = least / images.sigma[known[r]][at];
        e(r) = images.irradiance[known[r]][at];
        w(r) = relative * relative;
      }
      weighted = w.asDiagonal() * rows;
      const Eigen::LLT<RowMatrix> normal(rows.transpose() * weighted);
      Eigen::VectorXd c = normal.solve(weighted.transpose() * e);
      const RowMatrix inverse = normal.solve(RowMatrix::Identity(coefficients, coefficients));
      Eigen::VectorXd variance = inverse.diagonal();
      if (kept.moments > 0) {
        c += step * (measured.transpose() * e - integrals.transpose() * c);
        const RowMatrix k_a = inverse * integrals, k_c = inverse * rows_moments,
                        cross = k_c - step * (integrals.transpose() * k_c),
                        own = integrals.transpose() * k_a +
                              measured.transpose() * w.cwiseInverse().asDiagonal() * measured;
        variance += (step.cwiseProduct(2 * (cross - k_a) + step * own)).rowwise().sum();
      }
      for (Eigen::Index m = 0; m < coefficients; ++m) {
        images.coefficients[m][at] = static_cast<float>(c(m));
        images.coefficient_sigma[m][at] = static_cast<float>(least * std::sqrt(variance(m)));
      }
    }
  });
}

PixelWeights InverseWeights(const FilterSystem& system, const MomentConstraint& kept) {
  PixelWeights weights;
  for (int r = 0; r < system.rows(); ++r) weights.known.push_back(r);
  weights.weights = kept.Map(system.PseudoInverse());
  weights.prior_share.assign(system.columns(), 0);
  weights.rank = system.columns();
  return weights;
}

}  // namespace

IncompletePixels SolveGeneral(const FilterSystem& system,
                              std::span<const std::uint32_t* const> unknown,
                              const PixelImages& images, const MomentConstraint& kept) {
  const int rows = system.rows(), columns = system.columns();
  const std::vector<double> dense = system.Dense();
  const std::vector<PixelGroup> groups = GroupPixels(unknown, images.pixels, true);
  const auto complete = [&](const PixelGroup& group) {
    return std::find(group.known.begin(), group.known.end(), false) == group.known.end();
  };
  IncompletePixels result;
  std::vector<const PixelGroup*> weighted, incomplete;
  double multiplications = 0;
  const double n = columns;
  for (const PixelGroup& group : groups) {
    const double values = static_cast<double>(group.pixels.size()) * images.channels;
    const auto known = std::count(group.known.begin(), group.known.end(), true);
    if (!complete(group)) result.incomplete += group.pixels.size();
    if (complete(group) && rows == columns) {
      ApplyWeights(InverseWeights(system, kept), group.pixels, images);
    } else if (known >= columns) {
      weighted.push_back(&group);
      multiplications += values * n * n * (n / 3 + static_cast<double>(known));
    } else if (known > 0) {
      incomplete.push_back(&group);
      multiplications += n * n * n + 2 * n * static_cast<double>(known) * values;
    } else {
      result.unknown = group.pixels.size();
    }
  }
  if (multiplications > kMostMultiplications)
    throw InputError(fmt::format(
        "the general solve of {} coefficients with {} measurements in {} different known sets "
        "would take {:.1e} multiplications, more than {:.0e}; use a smaller lattice",
        columns, rows, groups.size(), multiplications, kMostMultiplications));

  const Eigen::Map<const RowMatrix> a(dense.data(), rows, columns);
  for (const PixelGroup* group : weighted) {
    // Known measurements may be many and still leave a coefficient open.
    const PixelWeights weights =
        complete(*group) ? InverseWeights(system, kept) : MinimumNorm(dense, columns, group->known);
    if (weights.rank == columns)
      SolveWeighted(a, *group, images, complete(*group) ? kept : MomentConstraint{});
    else
      ApplyWeights(weights, group->pixels, images);
  }
  core::ParallelFor(incomplete.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t g = begin; g < end; ++g)
      ApplyWeights(MinimumNorm(dense, columns, incomplete[g]->known), incomplete[g]->pixels,
                   images);
  });
  for (const PixelGroup& group : groups)
    if (std::find(group.known.begin(), group.known.end(), true) == group.known.end())
      FillUnknown(group.pixels, images);
  return result;
}

void SolveKeeping(const FilterSystem& system, const MomentConstraint& kept,
                  std::span<const std::uint32_t* const> unknown, const PixelImages& images) {
  for (const PixelGroup& group : GroupPixels(unknown, images.pixels, true))
    if (std::find(group.known.begin(), group.known.end(), false) == group.known.end())
      ApplyWeights(InverseWeights(system, kept), group.pixels, images);
}

}  // namespace luxfield::reconstruct
