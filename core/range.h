// Ranges of numbers from files.
#pragma once

namespace luxfield::core {

// No quantity of any file is larger: a product of ten such numbers is still finite.
constexpr double kLargestNumber = 1e30;

struct Range {  // closed
  double min = -kLargestNumber;
  double max = kLargestNumber;

  bool Holds(double value) const { return value >= min && value <= max; }  // NaN: no
};

}  // namespace luxfield::core
