#include "luxfield/reconstruct/solve/unknown_texels.h"

#include <cmath>

namespace luxfield::reconstruct {

std::vector<double> RowSquares(std::span<const std::uint32_t> unknown, std::size_t width,
                               const PixelImages& images) {
  std::vector<bool> known(images.pixels, true);
  for (const std::uint32_t pixel : unknown) known[pixel] = false;
  std::vector<double> sums;
  for (int channel = 0; channel < images.channels; ++channel)
    for (std::size_t row = 0; row < images.pixels; row += width) {
      double squares = 0;
      for (const float* image : images.coefficients) {
        const float* of_channel = image + channel * images.pixels;
        for (std::size_t p = row; p < row + width; ++p)
          if (known[p]) squares += double{of_channel[p]} * of_channel[p];
      }
      sums.push_back(squares);
    }
  return sums;
}

float RootMeanSquare(std::span<const double> row_squares, double count) {
  double squares = 0;
  for (const double of_row : row_squares) squares += of_row;
  return static_cast<float>(count > 0 ? std::sqrt(squares / count) : 0);
}

void FillUnknown(std::span<const std::uint32_t> unknown, std::span<const double> row_squares,
                 const PixelImages& images) {
  const std::size_t rows = row_squares.size() / images.channels;
  const double others = static_cast<double>(images.pixels - unknown.size()) *
                        static_cast<double>(images.coefficients.size());
  for (int channel = 0; channel < images.channels; ++channel) {
    const float sigma = RootMeanSquare(row_squares.subspan(channel * rows, rows), others);
    for (std::size_t m = 0; m < images.coefficients.size(); ++m)
      for (const std::uint32_t pixel : unknown) {
        images.coefficients[m][channel * images.pixels + pixel] = 0;
        images.coefficient_sigma[m][channel * images.pixels + pixel] = sigma;
      }
  }
}

}  // namespace luxfield::reconstruct
