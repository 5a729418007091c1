#include "luxfield/reconstruct/calibrate/response/fitted_response.h"

#include <fmt/format.h>

namespace luxfield::reconstruct {

InputError TooFewResponseSamples(const std::string& what, std::size_t samples) {
  return InputError(fmt::format(
      "{}: {} samples are neither black nor saturated in two pictures, but a curve takes {}; "
      "choose exposures closer to one another",
      what, samples, kLeastResponseSamples));
}

InputError NoRisingCurve(const std::string& what, double reference_code) {
  return InputError(fmt::format(
      "{}: no curve rises about code {}, half of saturation; check the exposure times, and add "
      "pictures in which the scene is neither dark nor bright",
      what, reference_code));
}

InputError NoSolution(const std::string& what) {
  return InputError(fmt::format(
      "{}: the least squares for its response curve have no solution; check the exposure times, "
      "and add pictures in which the scene is neither dark nor bright",
      what));
}

}  // namespace luxfield::reconstruct
