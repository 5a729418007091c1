// Pixels whose known measurements are the same set share one linear estimator of their
// coefficients.
//
// Where the data leave C undetermined it takes a prior: all C of a pixel independent, mean 0, one
// variance tau^2. In the limit of noise far below tau the estimate is the C of smallest norm that
// fits what is known, C = P E, and its covariance
//
//   P diag(sigma^2) P^T + tau^2 (1 - P A_K),     tau^2 = |P E|^2 / rank(A_K)    per pixel
//
// (P A_K projects on what the data determine, so |P E|^2 is tau^2 rank on average; noise in E
// enters it and makes tau large rather than small.)
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace luxfield::reconstruct {

// Planes of measurements r and coefficients m; entry channel * pixels + pixel of each.
struct PixelImages {
  std::size_t pixels = 0;
  std::size_t width = 0;  // pixels of a row
  int channels = 1;
  std::span<const float* const> irradiance, sigma;
  std::span<float* const> coefficients, coefficient_sigma;
};

struct PixelGroup {
  std::vector<bool> known;  // per measurement
  std::vector<std::uint32_t> pixels;
};

// Pixels by which measurements they know: unknown[r][pixel] != 0 are the others. Pixels that know
// all of them come as a group only if asked for.
std::vector<PixelGroup> GroupPixels(std::span<const std::uint32_t* const> unknown,
                                    std::size_t pixels, bool with_complete);

struct PixelWeights {
  std::vector<int> known;           // measurements, the columns of P
  std::vector<double> weights;      // P, coefficients x known, row-major
  std::vector<double> prior_share;  // 1 - (P A_K)_mm: 0 where the data determine C_m
  int rank = 0;
};

// Smallest-norm weights from the rows A_K of the dense matrix `a` (measurements x coefficients);
// singular values below 1e-9 of the largest count as 0. No row known: all weights 0, all shares 1.
PixelWeights MinimumNorm(std::span<const double> a, int coefficients,
                         const std::vector<bool>& known);

// C and sigma(C) of the pixels, in double. What a pixel gets depends on no other pixel, to the bit.
void ApplyWeights(const PixelWeights& weights, std::span<const std::uint32_t> pixels,
                  const PixelImages& images);

// [channel][row]: the sum of C^2 over the coefficients and the row's pixels, without `pixels`.
std::vector<double> RowSquares(std::span<const std::uint32_t> pixels, const PixelImages& images);

// The root mean square of `count` values from one channel's RowSquares, added in their order; 0 of
// none.
float RootMeanSquare(std::span<const double> row_squares, double count);

// For pixels of which nothing is known: C = 0 and as its standard deviation the root mean square of
// C over the other pixels of the channel.
void FillUnknown(std::span<const std::uint32_t> pixels, const PixelImages& images);

}  // namespace luxfield::reconstruct
