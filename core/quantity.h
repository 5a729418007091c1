// A measured number with its standard error.
#pragma once

namespace luxfield::core {

struct Quantity {
  double value = 0;
  double sigma = 0;  // standard error
};

}  // namespace luxfield::core
