// What the basis does not resolve of a lamp.
//
// A session cannot see it: E determines C, and nothing is left over. But it can tell what a basis
// of twice the spacing would have lost, for its functions are sums of ours (two-scale relation: 1,
// 3, 3, 1 over 4 for `bspline2`), and details shrink from one spacing to the next unless the lamp
// has as much structure below the spacing as above it. So
//
//   |Q(C) - Q(Pi C)|,    Pi the least-squares projection on the coarser basis (L2 on F, per texel)
//
// stands for a bound of |Q(lamp) - Q(C)|. Noise of C enters it and makes it larger.
#pragma once

#include <optional>

#include "lightfield/light_field.h"

namespace luxfield::reconstruct {

// Pi C in the coefficients of the given field's own basis. Absent where no coarser basis lies in
// the span (`quadratic` with a above or below 0) or an axis has no more functions than the coarser
// basis would take (below 4 for `bspline2`).
std::optional<lightfield::LightField> Coarsened(const lightfield::LightField& field);

}  // namespace luxfield::reconstruct
