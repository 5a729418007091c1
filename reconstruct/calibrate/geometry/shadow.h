// Where the mask's shadow falls, for any scalar (geometry_fit.h).
#pragma once

#include <array>
#include <cmath>

namespace luxfield::reconstruct {

// Filter: delta, tilt a about s, then b about t. Source: from the filter's centre. Stage: a_u, then
// a_v. Spacer: shift along both axes of the filter and turn of the mask on it. Error: of the
// stage's arrival. All lengths in one unit; the result is q on I.
template <typename T>
std::array<T, 2> ShadowOnImage(const T* filter, const T* source, const T* stage, const T* spacer,
                               const T* error, double u, double v, bool on_spacer, double spacer_m,
                               double mask_x, double mask_y) {
  using std::cos;
  using std::sin;
  const T &delta = filter[0], ca = cos(filter[1]), sa = sin(filter[1]), cb = cos(filter[2]),
          sb = sin(filter[2]);
  const T ex[3] = {cb, T(0), -sb}, ey[3] = {sb * sa, ca, cb * sa}, n[3] = {sb * ca, -sa, cb * ca};
  T x = T(mask_x), y = T(mask_y), height = T(0);
  if (on_spacer) {
    const T c = cos(spacer[2]), s = sin(spacer[2]);
    x = c * mask_x - s * mask_y + spacer[0];
    y = s * mask_x + c * mask_y + spacer[1];
    height = T(-spacer_m);
  }
  T from[3], to[3];  // source and mask, from the filter's centre
  for (int k = 0; k < 3; ++k) {
    from[k] = source[k] - u * stage[k] - v * stage[3 + k];
    if (k < 2) from[k] -= error[k];
    to[k] = x * ex[k] + y * ey[k] + height * n[k];
  }
  const T way = (delta - from[2]) / (to[2] - from[2]);
  return {from[0] + way * (to[0] - from[0]), from[1] + way * (to[1] - from[1])};
}

}  // namespace luxfield::reconstruct
