#include "luxfield/reconstruct/solve/regularise.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"

namespace luxfield::reconstruct {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kMostMultiplications = 2e12;  // about ten minutes of one core

// D^T D.
MatrixXd Roughness(const lightfield::BasisGrid& grid) {
  MatrixXd result = MatrixXd::Zero(grid.count(), grid.count());
  const auto add = [&](int a, int b) {
    result(a, a) += 1;
    result(b, b) += 1;
    result(a, b) -= 1;
    result(b, a) -= 1;
  };
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      if (i + 1 < grid.width) add(grid.index(i, j), grid.index(i + 1, j));
      if (j + 1 < grid.height) add(grid.index(i, j), grid.index(i, j + 1));
    }
  return result;
}

// The generalised singular value decomposition of A and D: A T = W.
struct Modes {
  MatrixXd t, w;
  VectorXd gamma;

  Modes(const MatrixXd& a, const MatrixXd& roughness) {
    const Eigen::BDCSVD<MatrixXd> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const MatrixXd whitened = svd.matrixV() * svd.singularValues().cwiseInverse().asDiagonal();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(whitened.transpose() * roughness *
                                                        whitened);
    gamma = eigen.eigenvalues().cwiseMax(0);
    t = whitened * eigen.eigenvectors();
    w = svd.matrixU() * eigen.eigenvectors();
  }

  VectorXd Factors(double lambda) const {
    return (1 + lambda * lambda * gamma.array()).inverse().matrix();
  }
};

// Means over texels and channels of E / h^2: first and second moments, and of the noise's square.
struct Moments {
  VectorXd mean, noise;
  MatrixXd square;

  Moments(const std::vector<std::uint32_t>& texels, double h2, const PixelImages& images) {
    constexpr std::size_t kSlices = 8, kLanes = 64;  // slices: sums do not depend on the threads
    const auto count = static_cast<Index>(images.irradiance.size());
    const std::size_t total = texels.size() * images.channels;
    struct Sums {
      VectorXd mean, noise;
      MatrixXd square;
    };
    std::vector<Sums> slices(kSlices);
    core::ParallelFor(kSlices, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t slice = begin; slice < end; ++slice) {
        Sums& sums = slices[slice];
        sums = {VectorXd::Zero(count), VectorXd::Zero(count), MatrixXd::Zero(count, count)};
        MatrixXd e(count, kLanes);
        const std::size_t last = (slice + 1) * total / kSlices;
        for (std::size_t first = slice * total / kSlices; first < last; first += kLanes) {
          const auto lanes = static_cast<Index>(std::min(kLanes, last - first));
          for (Index r = 0; r < count; ++r)
            for (Index k = 0; k < lanes; ++k) {
              const std::size_t item = first + static_cast<std::size_t>(k),
                                at = item / texels.size() * images.pixels +
                                     texels[item % texels.size()];
              const double sigma = images.sigma[r][at] / h2;
              e(r, k) = images.irradiance[r][at] / h2;
              sums.noise[r] += sigma * sigma;
            }
          sums.mean += e.leftCols(lanes).rowwise().sum();
          sums.square.selfadjointView<Eigen::Lower>().rankUpdate(e.leftCols(lanes));
        }
      }
    });
    mean = noise = VectorXd::Zero(count);
    square = MatrixXd::Zero(count, count);
    const double share = 1 / static_cast<double>(total);
    for (const Sums& sums : slices) {
      mean += share * sums.mean;
      noise += share * sums.noise;
      square += share * sums.square;
    }
    square = MatrixXd(square.selfadjointView<Eigen::Lower>());
  }
};

// What moments that are kept do to the modes: P' = T' diag(f) W^T + L, T' = (1 - Y A^T) T.
struct KeptModes {
  MatrixXd t, lift;  // T', L = Y a^T

  KeptModes(const Modes& modes, const MomentConstraint& kept, double h2) : t(modes.t) {
    const Index count = t.rows();
    lift = MatrixXd::Zero(count, count);
    if (kept.moments == 0) return;
    const Eigen::Map<const RowMatrix> integrals(kept.integrals.data(), count, kept.moments),
        step(kept.step.data(), count, kept.moments),
        measured(kept.measured.data(), count, kept.moments);
    t -= step * (integrals.transpose() * modes.t);
    lift = h2 * (step * measured.transpose());  // of E / h^2
  }
};

// Mean squares over coefficients of what factors f of the modes do, in O(N^2).
class Errors {
 public:
  Errors(const Modes& modes, const KeptModes& kept, const Moments& moments) {
    const auto count = static_cast<double>(modes.t.rows());
    const MatrixXd overlap = kept.t.transpose() * kept.t / count;
    const MatrixXd noise = modes.w.transpose() * moments.noise.asDiagonal() * modes.w;
    const MatrixXd light = modes.w.transpose() * moments.square * modes.w - noise;
    noise_ = noise.cwiseProduct(overlap);
    light_ = light.cwiseProduct(overlap);
    signal_ = light.cwiseProduct(modes.t.transpose() * modes.t / count).sum();
    const MatrixXd noisy_lift = kept.lift * moments.noise.asDiagonal();
    crossed_ = 2 / count * (kept.t.transpose() * (noisy_lift * modes.w)).diagonal();
    lifted_ = noisy_lift.cwiseProduct(kept.lift).sum() / count;
  }

  double Noise(const VectorXd& f) const { return f.dot(noise_ * f) + crossed_.dot(f) + lifted_; }
  double Bias(const VectorXd& f) const {  // may come out below 0: it is an estimate
    const VectorXd lost = f.array() - 1;
    return lost.dot(light_ * lost);
  }
  double Signal() const { return signal_; }

 private:
  MatrixXd noise_, light_;
  VectorXd crossed_;
  double signal_ = 0, lifted_ = 0;
};

double LambdaOfLeastError(const Modes& modes, const Errors& errors) {
  constexpr int kPerDecade = 10, kLowest = -4 * kPerDecade, kHighest = 3 * kPerDecade;
  double best = 0, least = std::numeric_limits<double>::infinity();
  for (int step = kLowest; step <= kHighest; ++step) {
    const double lambda = std::pow(10, static_cast<double>(step) / kPerDecade);
    const VectorXd f = modes.Factors(lambda);
    const double error = errors.Noise(f) + errors.Bias(f);
    if (error < least) {
      least = error;
      best = lambda;
    }
  }
  return best;
}

void CheckCost(int columns, std::size_t values) {
  const double n = columns, multiplications = 30 * n * n * n + 4 * n * n * double(values);
  if (multiplications > kMostMultiplications)
    throw InputError(
        fmt::format("--regularise: {} coefficients of {} texels and channels would take {:.1e} "
                    "multiplications, more than {:.0e}; use a smaller lattice",
                    columns, values, multiplications, kMostMultiplications));
}

}  // namespace

RegularisationSummary Regularise(const FilterSystem& system, const lightfield::BasisGrid& grid,
                                 std::optional<double> lambda,
                                 std::span<const std::uint32_t* const> unknown,
                                 const PixelImages& images, const MomentConstraint& kept) {
  if (lambda && !(*lambda > 0 && std::isfinite(*lambda)))
    throw InputError(fmt::format(
        "--regularise {}: lambda must be above 0; leave the option out for none", *lambda));
  if (system.rows() != system.columns())
    throw InputError(
        "--regularise: several measurements are weighed against each other, which has no bias; "
        "reconstruct them together without it");
  if (grid.count() < 2)
    throw InputError("--regularise: a single filter has no neighbour to be as smooth as");
  std::vector<std::uint32_t> texels;
  for (std::size_t p = 0; p < images.pixels; ++p)
    if (std::all_of(unknown.begin(), unknown.end(), [p](const auto* u) { return u[p] == 0; }))
      texels.push_back(static_cast<std::uint32_t>(p));
  if (texels.empty())
    throw InputError("--regularise: no texel knows all positions; capture what is missing");
  CheckCost(grid.count(), texels.size() * images.channels);

  const double h2 = grid.spacing_m * grid.spacing_m;
  const auto count = static_cast<Index>(grid.count());
  const std::vector<double> dense = system.Dense();
  const MatrixXd a = Eigen::Map<const RowMatrix>(dense.data(), count, count) / h2;
  const Modes modes(a, Roughness(grid));
  const Moments moments(texels, h2, images);
  const KeptModes kept_modes(modes, kept, h2);
  const Errors errors(modes, kept_modes, moments);
  const double signal = errors.Signal();
  if (!(signal > 0))
    throw InputError(
        "--regularise: the light does not show above its noise, so that no bias can be stated; "
        "expose longer");

  RegularisationSummary summary;
  summary.chosen = !lambda;
  summary.lambda = lambda ? *lambda : LambdaOfLeastError(modes, errors);
  summary.texels = texels.size();
  const VectorXd f = modes.Factors(summary.lambda), lost = f.array() - 1;
  const auto relative = [&](double square) { return std::sqrt(std::max(square, 0.0) / signal); };
  summary.noise_before = relative(errors.Noise(VectorXd::Ones(count)));
  summary.noise = relative(errors.Noise(f));
  summary.bias = relative(errors.Bias(f));
  const VectorXd flux = modes.t.colwise().sum().transpose(),
                 kept_flux = kept_modes.t.colwise().sum().transpose(),
                 light = modes.w.transpose() * moments.mean;
  summary.flux_bias = kept_flux.cwiseProduct(lost).dot(light) / flux.dot(light);
  const MatrixXd bias = kept_modes.t * lost.asDiagonal() * modes.w.transpose() * a;
  summary.worst_bias = std::sqrt(std::max(
      0.0, Eigen::SelfAdjointEigenSolver<MatrixXd>(bias.transpose() * bias, Eigen::EigenvaluesOnly)
               .eigenvalues()
               .maxCoeff()));

  const RowMatrix p = kept_modes.t * f.asDiagonal() * modes.w.transpose() + kept_modes.lift;
  summary.noise_gain = p.norm() / std::sqrt(static_cast<double>(count));
  PixelWeights weights;
  for (int r = 0; r < system.rows(); ++r) weights.known.push_back(r);
  const RowMatrix scaled = p / h2;
  weights.weights.assign(scaled.data(), scaled.data() + scaled.size());
  weights.prior_share.assign(static_cast<std::size_t>(count), 0);
  weights.rank = system.columns();
  ApplyWeights(weights, texels, images);
  return summary;
}

}  // namespace luxfield::reconstruct
