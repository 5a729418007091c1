#include "luxfield/reconstruct/merge/filter_profile.h"

#include <algorithm>

#include "luxfield/lightfield/quadrature.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::FilterKind;

// Where the dual function, positive in the middle, changes its sign: distance from the middle.
double DualRoot(const Basis& basis) {
  double inside = 0, outside = 1;
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (inside + outside);
    (basis.DualValue(middle) > 0 ? inside : outside) = middle;
  }
  return outside;
}

}  // namespace

std::vector<double> PrintFactors(FilterKind filter, const Basis& basis) {
  if (filter == FilterKind::kBasis) return {1};
  const auto peaks = basis.DualPeaks();
  return {peaks[0], -peaks[1]};
}

FilterProfile::FilterProfile(FilterKind filter, const Basis& basis)
    : filter_(filter), basis_(basis) {
  for (int k = 0; k <= basis.cells; ++k) knots_.push_back(k);
  if (filter == FilterKind::kDual) {
    const double root = DualRoot(basis), middle = 0.5 * basis.cells;
    knots_.insert(knots_.end(), {middle - root, middle + root});
    std::sort(knots_.begin(), knots_.end());
  }
}

double FilterProfile::Value(double x) const {
  return filter_ == FilterKind::kBasis ? basis_.Value(x) : basis_.DualValue(x - 0.5 * basis_.cells);
}

// Gauss-Legendre between the knots of both functions: f B is of degree 5 at most there.
double FilterProfile::Integral(double offset, const std::function<double(double)>& f) const {
  std::vector<double> knots = knots_;
  for (int k = 0; k <= basis_.cells; ++k)
    if (offset + k > 0 && offset + k < basis_.cells) knots.push_back(offset + k);
  std::sort(knots.begin(), knots.end());
  double sum = 0;
  for (std::size_t k = 0; k + 1 < knots.size(); ++k)
    sum += lightfield::Gauss3(knots[k], knots[k + 1],
                              [&](double x) { return f(x) * basis_.Value(x - offset); });
  return sum;
}

double FilterProfile::Overlap(double offset) const {
  return Integral(offset, [&](double x) { return Value(x); });
}

double FilterProfile::Moment(double offset) const {
  return Integral(offset, [&](double x) { return (x - 0.5 * basis_.cells) * Value(x); });
}

double FilterProfile::PartOverlap(double sign, double offset) const {
  return Integral(offset, [&](double x) { return std::max(sign * Value(x), 0.0); });
}

}  // namespace luxfield::reconstruct
