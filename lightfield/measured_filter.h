// *.filter.exr: the transmittance a printed filter really has, about its axis (docs/theory.md 3,
// "Measured filters"; docs/formats/filter.md).
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "luxfield/lightfield/basis.h"
#include "luxfield/lightfield/geometry.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::lightfield {

// One print, row-major on the filter's lattice.
struct MeasuredPrint {
  std::vector<float> transmittance;  // mean over the texel
  std::vector<float> sigma;          // its standard deviation
};

struct MeasuredFilter {
  FilterKind filter = FilterKind::kBasis;
  Basis basis;
  double spacing_m = 0;     // h
  double filter_scale = 1;  // the print was meant to be filter_scale * Phi; 1 for dual filters
  // Offsets from the filter's axis, parallel to u (along s) and v (along t). Opaque beyond.
  Lattice lattice;
  std::vector<MeasuredPrint> prints;  // 1, or the positive and the negative part of a dual pair
  // Where the print's own registration marks sit about the axis: told, not needed, as the texels
  // are about the axis already.
  Vec2 shift_m;
  double rotation_rad = 0, shift_sigma_m = 0, rotation_sigma_rad = 0;
  // What the photographs leave uncertain for all texels together: their place about the axis, of
  // either coordinate; every entry of the linear map of their places about it; their level,
  // relative; and the standard deviation of sums over neighbouring texels, which share pixels, over
  // that of independent ones.
  double position_sigma_m = 0, stretch_sigma = 0, level_sigma = 0, sum_sigma_ratio = 1;
  // What the photographs' pixels blur T by, standard deviation along either axis; the texels' own
  // size is not in it.
  double blur_m = 0;
  Provenance provenance;

  // Phi* = sum over prints of factor * T: {1 / filter_scale}, or {peak(+), -peak(-)}.
  std::vector<double> factors() const;
  // Throws InputError naming `file` and the field.
  void Validate(const std::string& file) const;
};

// docs/formats/filter.md. Reading throws InputError for whatever that page refuses.
void WriteMeasuredFilter(const std::filesystem::path& path, const MeasuredFilter& filter);
MeasuredFilter ReadMeasuredFilter(const std::filesystem::path& path);

}  // namespace luxfield::lightfield
