#include "luxfield/reconstruct/solve/separable_product.h"

#include <algorithm>

#include "luxfield/core/simd.h"

namespace luxfield::reconstruct {
namespace {

// out[row][lane] = sum over columns of matrix[row][column] in[column][lane]; strides in lanes
// blocks.
template <typename T, std::size_t kLanes>
LUXFIELD_INLINE void Multiply(const T* matrix, int rows, int columns, const T* in,
                              std::size_t in_stride, T* out, std::size_t out_stride) {
  for (int row = 0; row < rows; ++row) {
    T sum[kLanes] = {};
    for (int column = 0; column < columns; ++column) {
      const T weight = matrix[row * columns + column];
      const T* x = in + column * in_stride;
      for (std::size_t k = 0; k < kLanes; ++k) sum[k] += weight * x[k];
    }
    std::copy_n(sum, kLanes, out + row * out_stride);
  }
}

template <typename T>
LUXFIELD_INLINE void ApplyBlock(const T* a, int a_rows, int a_columns, const T* b, int b_rows,
                                int b_columns, const T* in, T* scratch, T* out) {
  constexpr std::size_t kLanes = SeparableProduct<T>::kLanes;
  for (int j = 0; j < b_columns; ++j)
    Multiply<T, kLanes>(a, a_rows, a_columns, in + static_cast<std::size_t>(j) * a_columns * kLanes,
                        kLanes, scratch + static_cast<std::size_t>(j) * a_rows * kLanes, kLanes);
  const std::size_t stride = static_cast<std::size_t>(a_rows) * kLanes;
  for (int i = 0; i < a_rows; ++i)
    Multiply<T, kLanes>(b, b_rows, b_columns, scratch + i * kLanes, stride, out + i * kLanes,
                        stride);
}

LUXFIELD_SIMD_CLONES void Entry(const float* a, int a_rows, int a_columns, const float* b,
                                int b_rows, int b_columns, const float* in, float* scratch,
                                float* out) {
  ApplyBlock(a, a_rows, a_columns, b, b_rows, b_columns, in, scratch, out);
}

LUXFIELD_SIMD_CLONES void Entry(const double* a, int a_rows, int a_columns, const double* b,
                                int b_rows, int b_columns, const double* in, double* scratch,
                                double* out) {
  ApplyBlock(a, a_rows, a_columns, b, b_rows, b_columns, in, scratch, out);
}

}  // namespace

template <typename T>
SeparableProduct<T>::SeparableProduct(const std::vector<double>& a, int a_rows, int a_columns,
                                      const std::vector<double>& b, int b_rows, int b_columns)
    : a_(a.begin(), a.end()),
      b_(b.begin(), b.end()),
      a_rows_(a_rows),
      a_columns_(a_columns),
      b_rows_(b_rows),
      b_columns_(b_columns) {}

template <typename T>
void SeparableProduct<T>::Apply(const T* in, T* scratch, T* out) const {
  Entry(a_.data(), a_rows_, a_columns_, b_.data(), b_rows_, b_columns_, in, scratch, out);
}

template class SeparableProduct<float>;
template class SeparableProduct<double>;

}  // namespace luxfield::reconstruct
