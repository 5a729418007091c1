// The printed filter: what its transmittance really is.
#pragma once

#include <array>
#include <cstdint>

#include "lightfield/basis.h"

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

// Transmittance of a print of Phi (or of one part of the dual basis function) about its axis:
//   basis  T = scale B(x/h) B(y/h)
//   dual   T(+-) = max(+-Phi*, 0) / peak(+-)          (THEORY 3)
class FilterPrint {
 public:
  FilterPrint(const lightfield::Basis& basis, double spacing_m, double scale, bool dual,
              const PrintErrors& errors, std::uint64_t seed);

  // At an offset from the filter's axis; `print` 0 is the positive part, 1 the negative one.
  double Transmittance(Vec2 offset_m, int print) const;
  // T is 0 further than this from the axis, per coordinate.
  double half_width_m() const;

 private:
  double Ideal(Vec2 offset_m, int print) const;
  double Grain(Vec2 offset_m) const;

  lightfield::Basis basis_;
  double spacing_m_, scale_;
  bool dual_;
  PrintErrors errors_;
  std::uint64_t seed_;
  std::array<double, 2> peak_{1, 1};
};

}  // namespace luxfield::hal::sim
