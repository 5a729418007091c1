// The standard deviation of texels of which nothing is known: the root mean square of C over all others
// of their channel, summed row by row, so that rows that are solved apart give the same sum.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "luxfield/reconstruct/solve/pixel_weights.h"

namespace luxfield::reconstruct {

// [channel][row of `width` pixels]: the sum of C^2 over the coefficients and the row's pixels, without
// those of `unknown`.
std::vector<double> RowSquares(std::span<const std::uint32_t> unknown, std::size_t width,
                               const PixelImages& images);

// The root mean square of `count` values from one channel's RowSquares, added in their order; 0 of
// none.
float RootMeanSquare(std::span<const double> row_squares, double count);

// C = 0 and that sigma in the pixels of `unknown`, from the RowSquares without them.
void FillUnknown(std::span<const std::uint32_t> unknown, std::span<const double> row_squares,
                 const PixelImages& images);

}  // namespace luxfield::reconstruct
