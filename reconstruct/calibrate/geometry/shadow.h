// Where the mask's shadow falls, for any scalar (geometry_fit.h).
#pragma once

#include <array>
#include <cmath>

namespace luxfield::reconstruct {

// What is fitted. All lengths in one unit.
template <typename T>
struct ShadowParameters {
  const T* filter;  // delta, tilt a about s, then b about t
  const T* source;  // from the filter's centre
  const T* stage;   // a_u, then a_v
  const T* spacer;  // shift along both axes of the filter and turn of the mask on it
  const T* error;   // of the stage's arrival
};

// A point of the mask in a photograph.
struct MaskPoint {
  double x, y;      // on the mask
  double u, v;      // where the stage was sent
  double spacer_m;  // height of the spacer
  bool on_spacer;   // whether the mask lies on it
};

// q on I.
template <typename T>
std::array<T, 2> ShadowOnImage(const ShadowParameters<T>& p, const MaskPoint& point) {
  using std::cos;
  using std::sin;
  const T &delta = p.filter[0], ca = cos(p.filter[1]), sa = sin(p.filter[1]), cb = cos(p.filter[2]),
          sb = sin(p.filter[2]);
  const T ex[3] = {cb, T(0), -sb}, ey[3] = {sb * sa, ca, cb * sa}, n[3] = {sb * ca, -sa, cb * ca};
  T x = T(point.x), y = T(point.y), height = T(0);
  if (point.on_spacer) {
    const T c = cos(p.spacer[2]), s = sin(p.spacer[2]);
    x = c * point.x - s * point.y + p.spacer[0];
    y = s * point.x + c * point.y + p.spacer[1];
    height = T(-point.spacer_m);
  }
  T from[3], to[3];  // source and mask, from the filter's centre
  for (int k = 0; k < 3; ++k) {
    from[k] = p.source[k] - point.u * p.stage[k] - point.v * p.stage[3 + k];
    if (k < 2) from[k] -= p.error[k];
    to[k] = x * ex[k] + y * ey[k] + height * n[k];
  }
  const T way = (delta - from[2]) / (to[2] - from[2]);
  return {from[0] + way * (to[0] - from[0]), from[1] + way * (to[1] - from[1])};
}

}  // namespace luxfield::reconstruct
