// A filter's transmittance as a product of one function per axis (docs/theory.md 3, "Filters"):
//
//   Phi = B(x) B(y)        behind a basis filter
//   Phi* = B*(x) B*(y)     behind a dual pair, whose prints are its parts of either sign
//
// x in spacings from the support's lower corner.
#pragma once

#include <functional>
#include <vector>

#include "luxfield/lightfield/basis.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::reconstruct {

// E = sum over prints of factor times the print's irradiance over the filter's scale: {1}, or
// {peak(+), -peak(-)}.
std::vector<double> PrintFactors(lightfield::FilterKind filter, const lightfield::Basis& basis);

class FilterProfile {
 public:
  // Throws InputError for dual filters of a basis that has none.
  FilterProfile(lightfield::FilterKind filter, const lightfield::Basis& basis);

  double Value(double x) const;

  // What the filter sees of the basis function that lies `offset` spacings on: integrals of
  // Value(x) B(x - offset), of that times x from the support's middle, and of its part
  // max(sign Value(x), 0) alone. Exact up to rounding, any offset.
  double Overlap(double offset) const;
  double Moment(double offset) const;
  double PartOverlap(double sign, double offset) const;

 private:
  double Integral(double offset, const std::function<double(double)>& f) const;

  lightfield::FilterKind filter_;
  lightfield::Basis basis_;
  std::vector<double> knots_;  // between which Value is a polynomial of one sign
};

}  // namespace luxfield::reconstruct
