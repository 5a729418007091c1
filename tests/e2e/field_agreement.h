// Two measurements of one light field, each with its standard deviation: do they agree within the
// noise?
#pragma once

#include <cmath>
#include <cstddef>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::e2e {

struct Field {
  lightfield::LightField value, sigma;
};

// The mean of their squared difference over its variance, and how many values that is the mean of.
struct Agreement {
  double chi_squared = 0;  // per degree of freedom
  int degrees = 0;
  double scatter() const { return std::sqrt(2.0 / degrees); }  // of chi_squared
};

inline Agreement Compare(const Field& a, const Field& b) {
  Agreement agreement;
  for (std::size_t k = 0; k < a.value.data.size(); ++k) {
    const double variance =
        std::pow(double(a.sigma.data[k]), 2) + std::pow(double(b.sigma.data[k]), 2);
    if (!(variance > 0)) continue;
    agreement.chi_squared +=
        std::pow(double(a.value.data[k]) - double(b.value.data[k]), 2) / variance;
    ++agreement.degrees;
  }
  agreement.chi_squared /= agreement.degrees;
  return agreement;
}

}  // namespace luxfield::e2e
