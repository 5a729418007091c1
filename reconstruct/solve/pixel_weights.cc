#include "luxfield/reconstruct/solve/pixel_weights.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>

#include "luxfield/core/parallel.h"
#include "luxfield/reconstruct/solve/separable_product.h"

namespace luxfield::reconstruct {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kRankTolerance = 1e-9;

}  // namespace

std::vector<PixelGroup> GroupPixels(std::span<const std::uint32_t* const> unknown,
                                    std::size_t pixels, bool with_complete) {
  std::unordered_map<std::string, std::size_t> index;
  std::vector<PixelGroup> groups;
  std::string key(unknown.size(), '0');
  std::vector<std::uint32_t> gaps(pixels, 0);  // of each pixel, 0 where it is complete
  for (const std::uint32_t* row : unknown)
    for (std::size_t p = 0; p < pixels; ++p) gaps[p] |= row[p];
  for (std::size_t p = 0; p < pixels; ++p) {
    if (gaps[p] == 0 && !with_complete) continue;
    for (std::size_t r = 0; r < unknown.size(); ++r) key[r] = unknown[r][p] != 0 ? '0' : '1';
    const auto [entry, inserted] = index.try_emplace(key, groups.size());
    if (inserted) {
      PixelGroup& group = groups.emplace_back();
      for (const char c : key) group.known.push_back(c == '1');
    }
    groups[entry->second].pixels.push_back(static_cast<std::uint32_t>(p));
  }
  return groups;
}

PixelWeights MinimumNorm(std::span<const double> a, int coefficients,
                         const std::vector<bool>& known) {
  PixelWeights result;
  for (std::size_t r = 0; r < known.size(); ++r)
    if (known[r]) result.known.push_back(static_cast<int>(r));
  const Eigen::Map<const RowMatrix> all(a.data(), static_cast<Eigen::Index>(known.size()),
                                        coefficients);
  const auto count = static_cast<Eigen::Index>(result.known.size());
  RowMatrix weights(coefficients, count);
  if (count > 0) {
    const RowMatrix rows = all(result.known, Eigen::all);
    bool solved = false;
    if (count <= coefficients) {
      const Eigen::LLT<RowMatrix> normal(rows * rows.transpose());
      // rcond of A A^T is the square of A's.
      if (normal.info() == Eigen::Success && normal.rcond() > 1e-10) {
        weights = normal.solve(rows).transpose();
        result.rank = static_cast<int>(count);
        solved = true;
      }
    }
    if (!solved) {
      Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
      decomposition.setThreshold(kRankTolerance);
      decomposition.compute(rows);
      weights = decomposition.pseudoInverse();
      result.rank = static_cast<int>(decomposition.rank());
    }
    const Eigen::VectorXd determined = (weights.array() * rows.transpose().array()).rowwise().sum();
    for (Eigen::Index m = 0; m < coefficients; ++m)
      result.prior_share.push_back(std::clamp(1 - determined(m), 0.0, 1.0));
  } else {
    result.prior_share.assign(coefficients, 1);
  }
  result.weights.assign(weights.data(), weights.data() + weights.size());
  return result;
}

void ApplyWeights(const PixelWeights& weights, std::span<const std::uint32_t> pixels,
                  const PixelImages& images) {
  using Product = SeparableProduct<double>;
  constexpr std::size_t kLanes = Product::kLanes;
  const std::size_t coefficients = weights.prior_share.size(), known = weights.known.size();
  std::vector<double> squared = weights.weights;
  for (double& x : squared) x *= x;
  // A dense matrix is a product whose other axis has one function.
  const auto dense = [&](const std::vector<double>& matrix) {
    return Product(matrix, static_cast<int>(coefficients), static_cast<int>(known), {1.0}, 1, 1);
  };
  const Product of_value = dense(weights.weights), of_variance = dense(squared);
  const std::size_t total = pixels.size() * images.channels;
  core::ParallelFor(total, 4 * kLanes, [&](std::size_t begin, std::size_t end) {
    std::vector<double> in(of_value.input_size()), scratch(of_value.scratch_size()),
        value(of_value.output_size()), variance(of_value.output_size());
    for (std::size_t first = begin; first < end; first += kLanes) {
      const std::size_t lanes = std::min(kLanes, end - first);
      const auto address = [&](std::size_t k) {
        const std::size_t item = first + k;
        return item / pixels.size() * images.pixels + pixels[item % pixels.size()];
      };
      const auto gather = [&](std::span<const float* const> from, bool square) {
        for (std::size_t r = 0; r < known; ++r)
          for (std::size_t k = 0; k < lanes; ++k) {
            const double x = from[weights.known[r]][address(k)];
            in[r * kLanes + k] = square ? x * x : x;
          }
      };
      gather(images.irradiance, false);
      of_value.Apply(in.data(), scratch.data(), value.data());
      gather(images.sigma, true);
      of_variance.Apply(in.data(), scratch.data(), variance.data());
      for (std::size_t k = 0; k < lanes; ++k) {
        double squares = 0;
        for (std::size_t m = 0; m < coefficients; ++m)
          squares += value[m * kLanes + k] * value[m * kLanes + k];
        const double tau2 = weights.rank > 0 ? squares / weights.rank : 0;
        const std::size_t at = address(k);
        for (std::size_t m = 0; m < coefficients; ++m) {
          images.coefficients[m][at] = static_cast<float>(value[m * kLanes + k]);
          images.coefficient_sigma[m][at] = static_cast<float>(
              std::sqrt(variance[m * kLanes + k] + tau2 * weights.prior_share[m]));
        }
      }
    }
  });
}

void FillUnknown(std::span<const std::uint32_t> pixels, const PixelImages& images) {
  if (pixels.empty()) return;
  std::vector<bool> known(images.pixels, true);
  for (const std::uint32_t pixel : pixels) known[pixel] = false;
  for (int channel = 0; channel < images.channels; ++channel) {
    const std::size_t offset = channel * images.pixels;
    double squares = 0;
    for (const float* image : images.coefficients)
      for (std::size_t p = 0; p < images.pixels; ++p)
        if (known[p]) squares += double{image[offset + p]} * image[offset + p];
    const double others = static_cast<double>((images.pixels - pixels.size())) *
                          static_cast<double>(images.coefficients.size());
    const auto sigma = static_cast<float>(others > 0 ? std::sqrt(squares / others) : 0);
    for (std::size_t m = 0; m < images.coefficients.size(); ++m)
      for (const std::uint32_t pixel : pixels) {
        images.coefficients[m][offset + pixel] = 0;
        images.coefficient_sigma[m][offset + pixel] = sigma;
      }
  }
}

}  // namespace luxfield::reconstruct
