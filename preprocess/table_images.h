// Sampling tables (tables.h) image by image.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "luxfield/preprocess/tables.h"

namespace luxfield::preprocess {

// MagnitudeSum (summed_area.h) of image m whose planes, [channel][row][column], lie apart from the
// others.
double MagnitudeSum(const lightfield::LuminaireGeometry& geometry, std::span<const float> planes,
                    const std::string& name, int m, std::span<float> magnitude);

// The exponent that BuildSummedArea (summed_area.h) takes for that sum.
int SummedAreaExponent(double sum);

// Where both CDFs of an image are 1/2, on I.
struct MedianPoint {
  bool lit = false;
  double s_m = 0, t_m = 0;
};
// `sat` as Tables::image.
MedianPoint FindMedianPoint(const std::uint64_t* sat, const lightfield::Lattice& lattice);

// Tables without images: sizes and hash, exponents of 0.
Tables TablesWithoutImages(const lightfield::LuminaireGeometry& geometry,
                           const std::string& sha256);

// Tables::reference from the median points of all images.
std::vector<ReferencePosition> ReferencePositions(const Tables& tables,
                                                  std::span<const MedianPoint> points);

}  // namespace luxfield::preprocess
