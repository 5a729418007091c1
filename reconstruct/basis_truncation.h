// What the basis does not resolve of a lamp.
//
// A session cannot see it: E determines C, and nothing is left over. But it can tell what a basis
// of twice the spacing would have lost, for its functions are sums of ours (two-scale relation: 1,
// 3, 3, 1 over 4 for `bspline2`), and details shrink from one spacing to the next unless the lamp
// has as much structure below the spacing as above it. With Pi what filters of the coarser basis
// would have made of the lamp (the least-squares projection, L2 on F, per texel; behind dual
// filters the oblique one along the coarser dual functions)
//
//   |Q(C) - Q(S)| + |Q(S) - Q(Pi S)|
//
// stands for a bound of |Q(lamp) - Q(C)|. S = C but for `quadratic` with a above or below 0, which
// cannot be even and loses of an even lamp the same share at any spacing (a = 1/2: 12 % of its flux
// behind dual filters): S is what the same measurements give in `bilinear`, which can. Noise of C
// enters the bound and makes it larger.
#pragma once

#include <functional>
#include <optional>

#include "lightfield/light_field.h"
#include "lightfield/measurements.h"

namespace luxfield::reconstruct {

// S: C times the factor that makes an even lamp's coefficients 1, in a basis that sums up to 1.
lightfield::LightField KeepingEvenLamps(const lightfield::LightField& field,
                                        lightfield::FilterKind filter);

// Pi C in the coefficients of the given field's own basis. Absent where no coarser basis lies in
// the span (`quadratic` with a above or below 0) or an axis has no more functions than the coarser
// basis would take (below 4 for `bspline2`).
std::optional<lightfield::LightField> Coarsened(const lightfield::LightField& field,
                                                lightfield::FilterKind filter);

class BasisTruncation {
 public:
  // `field` must outlive this.
  BasisTruncation(const lightfield::LightField& field, lightfield::FilterKind filter);

  using Quantity = std::function<double(const lightfield::LightField&)>;
  // Absent where Pi S is.
  std::optional<double> Bound(const Quantity& quantity) const;
  // Of the radiance (of three channels its luminance): root mean square over 5 x 5 rays within a
  // spacing on F, for one ray may lie where the fields happen to agree.
  std::optional<double> BoundOfRay(lightfield::Vec2 u_m, lightfield::Vec2 s_m) const;

 private:
  const lightfield::LightField& field_;
  lightfield::LightField smooth_;
  std::optional<lightfield::LightField> coarse_;
};

}  // namespace luxfield::reconstruct
