// Gauss-Legendre nodes for polynomials of the degrees that occur here: exact up to rounding, and
// without the cancellation that differences of antiderivatives have on short intervals. Abramowitz
// & Stegun 25.4.30.
#pragma once

namespace luxfield::lightfield {

// Integral of f over [x0, x1]; exact for polynomials up to degree 3.
template <typename F>
double Gauss2(double x0, double x1, F&& f) {
  constexpr double kNode = 0.57735026918962576451;  // 1 / sqrt(3)
  const double middle = 0.5 * (x0 + x1), half = 0.5 * (x1 - x0);
  return half * (f(middle - kNode * half) + f(middle + kNode * half));
}

// The same up to degree 5.
template <typename F>
double Gauss3(double x0, double x1, F&& f) {
  constexpr double kNode = 0.77459666924148337704;  // sqrt(3 / 5)
  const double middle = 0.5 * (x0 + x1), half = 0.5 * (x1 - x0);
  return half * (8.0 / 9.0 * f(middle) +
                 5.0 / 9.0 * (f(middle - kNode * half) + f(middle + kNode * half)));
}

}  // namespace luxfield::lightfield
