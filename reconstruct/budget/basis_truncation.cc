#include "luxfield/reconstruct/budget/basis_truncation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"

namespace luxfield::reconstruct {
namespace {

using Eigen::MatrixXd;
using lightfield::BasisGrid;
using lightfield::Lattice;
using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::Weights;

// Fine functions a spacing: a spot is at least as wide as their distance.
int Finer(const BasisGrid& grid, double smallest_m) {
  constexpr int kMostFilters = 1000, kMostPlaces = 400;
  const double finer = std::max(4.0, std::ceil(grid.spacing_m / smallest_m - 1e-9));
  const int cells = std::max(grid.width, grid.height) + grid.basis.cells - 1;
  if (grid.count() > kMostFilters || finer * cells > kMostPlaces)
    throw InputError(fmt::format(
        "smallest_spot_m = {}: {} x {} filters and {:.0f} spots along an axis are more than the {} "
        "filters and {} spots for which the basis' share is worked out; state a larger spot or "
        "leave it out",
        smallest_m, grid.width, grid.height, finer * cells, kMostFilters, kMostPlaces));
  return static_cast<int>(finer);
}

Lattice Pooled(const Lattice& lattice) {
  constexpr int kMostTexels = 8;
  Lattice pooled = lattice;
  pooled.width = std::min(lattice.width, kMostTexels);
  pooled.height = std::min(lattice.height, kMostTexels);
  pooled.ds_m = lattice.extent_s_m() / pooled.width;
  pooled.dt_m = lattice.extent_t_m() / pooled.height;
  return pooled;
}

// That of the pooled texel, to a whole texel.
int FirstTexel(int of_pooled, int pooled, int texels) {
  return static_cast<int>(std::int64_t{of_pooled} * texels / pooled);
}

double LuminanceAt(const std::vector<float>& planar, const LuminaireGeometry& g, std::size_t start,
                   std::size_t texel) {
  if (g.channels == 1) return planar[start + texel];
  const std::size_t plane = g.plane_size();
  return core::Luminance(
      {planar[start + texel], planar[start + plane + texel], planar[start + 2 * plane + texel]});
}

// The form's part of one texel, as the model has it: one row per function along u.
MatrixXd PartOf(const Weights& weights, const BasisGrid& grid, std::size_t texel,
                std::size_t texels) {
  MatrixXd part(grid.width, grid.height);
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      part(i, j) = weights[static_cast<std::size_t>(grid.index(i, j)) * texels + texel];
  return part;
}

void Add(const Weights& weights, double factor, Weights* sum) {
  sum->resize(weights.size(), 0.0);
  for (std::size_t k = 0; k < weights.size(); ++k) (*sum)[k] += factor * weights[k];
}

}  // namespace

BasisTruncation::BasisTruncation(const LightField& field, lightfield::FilterKind filter,
                                 const TruncationOptions& options)
    : field_(field),
      options_(options),
      finer_(Finer(field.geometry.grid, options.smallest_spot_m)),
      u_(field.geometry.grid.basis, filter, field.geometry.grid.width, finer_,
         options.smallest_spot_m / field.geometry.grid.spacing_m),
      v_(field.geometry.grid.basis, filter, field.geometry.grid.height, finer_,
         options.smallest_spot_m / field.geometry.grid.spacing_m),
      pooled_(Pooled(field.geometry.lattice)),
      posteriors_(static_cast<std::size_t>(pooled_.width) * pooled_.height) {
  const Lattice& lattice = field.geometry.lattice;
  core::ParallelFor(posteriors_.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const int row = static_cast<int>(k) / pooled_.width,
                column = static_cast<int>(k) % pooled_.width;
      posteriors_[k] = Posterior({FirstTexel(row, pooled_.height, lattice.height),
                                  FirstTexel(row + 1, pooled_.height, lattice.height),
                                  FirstTexel(column, pooled_.width, lattice.width),
                                  FirstTexel(column + 1, pooled_.width, lattice.width)});
    }
  });
}

std::optional<SpotPosterior> BasisTruncation::Posterior(const Texels& texels) const {
  const LuminaireGeometry& g = field_.geometry;
  const BasisGrid& grid = g.grid;
  const double count = double(texels.row1 - texels.row0) * (texels.column1 - texels.column0),
               area_m2 = grid.spacing_m * grid.spacing_m;
  MatrixXd c = MatrixXd::Zero(grid.width, grid.height), noise = c, unseen = c;
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      const int m = grid.index(i, j);
      const std::size_t start = static_cast<std::size_t>(m) * g.channels * g.plane_size();
      for (int row = texels.row0; row < texels.row1; ++row)
        for (int column = texels.column0; column < texels.column1; ++column) {
          const auto texel = static_cast<std::size_t>(row) * g.lattice.width + column;
          c(i, j) += LuminanceAt(field_.data, g, start, texel) / count;
          if (!options_.measurements) continue;
          // Of three channels as if their errors were one: the shares' sum of squares is less.
          const auto& position = options_.measurements->positions[static_cast<std::size_t>(m)];
          noise(i, j) += std::pow(LuminanceAt(position.sigma, g, 0, texel) / (count * area_m2), 2);
          if (position.mask[texel] & lightfield::kUnknownMask) unseen(i, j) += 1 / count;
        }
    }
  if (c.isZero(0)) return {};
  const MatrixXd e = u_.overlap * c * v_.overlap.transpose();
  noise += (options_.relative_noise * e).cwiseAbs2();
  // Where a position is missing, e is what C says and not what a filter saw.
  noise += unseen.cwiseAbs2() * (e.squaredNorm() / static_cast<double>(e.size()));
  return SpotPosterior(u_, v_, c, noise);
}

LuminaireGeometry BasisTruncation::Own(const Lattice& lattice) const {
  LuminaireGeometry own = field_.geometry;
  own.lattice = lattice;
  own.channels = 1;
  return own;
}

LuminaireGeometry BasisTruncation::Fine(const Lattice& lattice) const {
  LuminaireGeometry fine = Own(lattice);
  fine.grid.basis = lightfield::Basis::Make(lightfield::BasisKind::kBspline2);
  fine.grid.width = static_cast<int>(u_.seen.cols());
  fine.grid.height = static_cast<int>(v_.seen.cols());
  fine.grid.spacing_m /= finer_;
  return fine;
}

Moments BasisTruncation::MomentsOf(const SpotPosterior& posterior, const Form& form,
                                   std::size_t texel, std::size_t texels) const {
  const MatrixXd own = PartOf(form.own, field_.geometry.grid, texel, texels);
  return posterior.Of(PartOf(form.fine, Fine({}).grid, texel, texels) -
                      u_.resolved.transpose() * own * v_.resolved);
}

double BasisTruncation::Sigma(const std::vector<Term>& terms) const {
  double mean = 0, deviation = 0;
  const auto add = [&](const SpotPosterior& posterior, const Form& form, std::size_t texel,
                       std::size_t texels) {
    const Moments here = MomentsOf(posterior, form, texel, texels);
    mean += here.mean;
    deviation += std::sqrt(here.variance);
  };
  Form pooled;
  for (const auto& [factor, form] : terms) {
    if (!form.through_m) {
      Add(form.weights(Fine(pooled_)), factor, &pooled.fine);
      Add(form.weights(Own(pooled_)), factor, &pooled.own);
      continue;
    }
    Lattice one = field_.geometry.lattice;
    const double column = std::floor(one.column_of_s(form.through_m->x)),
                 row = std::floor(one.row_of_t(form.through_m->y));
    if (!(column >= 0 && column < one.width && row >= 0 && row < one.height)) continue;
    const auto posterior = Posterior({static_cast<int>(row), static_cast<int>(row) + 1,
                                      static_cast<int>(column), static_cast<int>(column) + 1});
    if (!posterior) continue;
    // All of I as one texel, so that the ray is within it whatever rounding says of its own's
    // edges.
    one.ds_m = one.extent_s_m();
    one.dt_m = one.extent_t_m();
    one.width = one.height = 1;
    Form ray;
    Add(form.weights(Fine(one)), factor, &ray.fine);
    Add(form.weights(Own(one)), factor, &ray.own);
    add(*posterior, ray, 0, 1);
  }
  if (!pooled.own.empty())
    for (std::size_t k = 0; k < posteriors_.size(); ++k)
      if (posteriors_[k]) add(*posteriors_[k], pooled, k, posteriors_.size());
  return std::hypot(mean, deviation);
}

}  // namespace luxfield::reconstruct
