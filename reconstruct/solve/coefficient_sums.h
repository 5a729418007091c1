// Statistics (report.h) of coefficients that come in bands of rows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "luxfield/reconstruct/solve/report.h"

namespace luxfield::reconstruct {

class CoefficientSums {
 public:
  CoefficientSums();

  // `without`, per texel, empty for none: those that are left out.
  void Add(const lightfield::LightField& coefficients, const lightfield::LightField& sigma,
           const std::vector<bool>& without = {});
  void AddDark(std::size_t count, float sigma);  // so many with C = 0
  void Add(const CoefficientSums& more);
  // The median of sigma is interpolated in steps of a thousandth of it.
  CoefficientStatistics Find() const;

 private:
  // Standard deviations that differ by less than 2^-10 of themselves.
  struct Bin {
    std::uint64_t count = 0;
    float least = 0, largest = 0;
    void Add(float value, std::uint64_t times);
  };

  void AddSigma(float sigma, std::uint64_t times);

  double positive_ = 0, negative_ = 0, squares_ = 0, variances_ = 0;
  float min_ = 0, max_ = 0;
  std::uint64_t count_ = 0, sigmas_ = 0;
  std::vector<Bin> bins_;
};

}  // namespace luxfield::reconstruct
