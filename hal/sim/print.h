// The printed filter: what its transmittance really is.
#pragma once

#include <cstdint>

#include "luxfield/rig/filter_sheet.h"

namespace luxfield::hal::sim {

using lightfield::Vec2;

struct PrintErrors {
  Vec2 shift_m;                // registration: the print sits off the filter's axis by this much
  double rotation_rad = 0;     // about the axis
  double density = 0;          // relative error of transmittance, T -> T (1 + density)
  double density_gamma = 0;    // tone curve of the printer, T -> T^(1 + density_gamma)
  double grain = 0;            // rms relative transmittance noise of the print ...
  double grain_size_m = 1e-3;  // ... with this correlation length
};

// A print of Phi (or of one part of the dual basis function) and of the sheet around it:
//   basis  T = scale B(x/h) B(y/h)
//   dual   T(+-) = max(+-Phi*, 0) / peak(+-)          (docs/theory.md 3, "Filters")
class FilterPrint {
 public:
  FilterPrint(const rig::FilterSheet& sheet, const PrintErrors& errors, std::uint64_t seed);

  const rig::FilterSheet& sheet() const { return sheet_; }
  // At an offset from the filter's axis; `print` 0 is the positive part, 1 the negative one. Opaque
  // beyond the filter: what stands in the luminaire's light. The grain is its mean over a square of
  // side patch_m about there, which is what a point of a quadrature stands for.
  double Transmittance(Vec2 offset_m, int print, double patch_m = 0) const;
  // Of the whole sheet, marks and wedge included: what a photograph shows.
  double SheetTransmittance(Vec2 offset_m, int print) const;
  // T of the filter is 0 further than this from the axis, per coordinate.
  double half_width_m() const;

 private:
  Vec2 OnSheet(Vec2 offset_m) const;
  double WithErrors(double ideal, Vec2 own, double patch_m) const;
  double Grain(Vec2 offset_m) const;
  double MeanGrain(Vec2 offset_m, double patch_m) const;

  rig::FilterSheet sheet_;
  PrintErrors errors_;
  std::uint64_t seed_;
};

}  // namespace luxfield::hal::sim
