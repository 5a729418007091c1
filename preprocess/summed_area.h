// What all sampling tables are made with: magnitudes of coefficient images, and summed-area tables
// in 64-bit fixed point.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::preprocess {

// What a texel weighs where images are drawn from: |C|, or the luminance of |R|, |G| and |B|,
// rounded to float32. It is the texel's luminance where C >= 0, and 0 only where all of C is 0.
float TexelMagnitude(const lightfield::LightField& field, int m, std::size_t texel);

// Writes TexelMagnitude of every texel of image m and returns their sum. Throws InputError naming
// the file `name`, image and texel for a NaN or infinite C, and for an image whose sum exceeds
// float32.
double MagnitudeSum(const lightfield::LightField& field, const std::string& name, int m,
                    std::span<float> magnitude);

// Their sum, in another order than theirs.
double Sum(const float* values, std::size_t size);
double Sum(const double* values, std::size_t size);

// Fills sat[r (width + 1) + c] = sum of the values of rows < r and columns < c in units of
// 2^-exponent, each value rounded to the nearest quantum, and returns the exponent: `sum`, that of
// all values, lies in [2^61, 2^62) units. Values are not negative; a sum of 0 gives zeros. T is
// float or double.
template <typename T>
int BuildSummedArea(std::span<const T> values, double sum, int width, int height,
                    std::uint64_t* sat);

}  // namespace luxfield::preprocess
