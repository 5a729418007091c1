// Dense separable products over blocks of pixels: what propagated variances and minimum-norm solves
// need.
#pragma once

#include <cstddef>
#include <vector>

namespace luxfield::reconstruct {

// out = A in B^T for kLanes pixels at once, `in` and i along u, jn and j along v:
//
//   in[(jn * A.columns + in) * kLanes + k],   out[(j * A.rows + i) * kLanes + k]
//
// A is (u rows x u columns), B (v rows x v columns), both row-major.
template <typename T>
class SeparableProduct {
 public:
  static constexpr std::size_t kLanes = 64;

  SeparableProduct(const std::vector<double>& a, int a_rows, int a_columns,
                   const std::vector<double>& b, int b_rows, int b_columns);

  std::size_t input_size() const {
    return static_cast<std::size_t>(a_columns_) * b_columns_ * kLanes;
  }
  std::size_t output_size() const { return static_cast<std::size_t>(a_rows_) * b_rows_ * kLanes; }
  std::size_t scratch_size() const {
    return static_cast<std::size_t>(a_rows_) * b_columns_ * kLanes;
  }

  void Apply(const T* in, T* scratch, T* out) const;

 private:
  std::vector<T> a_, b_;
  int a_rows_, a_columns_, b_rows_, b_columns_;
};

}  // namespace luxfield::reconstruct
