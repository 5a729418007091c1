// What the basis may lose of a lamp, from the data alone.
//
// A session cannot see what lies outside the span of its basis, but what a grid of twice the
// spacing would lose of the light that the session did see. Such a grid's filters are laid over the
// reconstructed light, four times, a spacing of the finer grid apart along either axis, and beyond
// its supports on all sides, where it is dark; they are solved as a session is. The change of a
// quantity Q
//
//   d^2 = mean over the four places of (Q_2h - Q_h)^2
//
// is the loss at 2 h less that at h. Of a basis whose losses fall as h^p (Richardson 1911, "The
// approximate arithmetical solution by finite differences")
//
//   sigma = d / (2^p - 1)
//
// with p as irradiances of Lambertian lamps with edges have it: 2 for bspline2, 1 for the others.
// Noise of Q is in d too. What the solve gets wrong at the edge of the grid is not (docs/theory.md
// 13).
#pragma once

#include <optional>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/budget/basis_truncation.h"

namespace luxfield::reconstruct {

// Of every quantity, a sum of terms of the field; nothing for one that cannot be asked of the
// coarser grids: a receiver's horizon cuts their supports.
std::vector<std::optional<double>> CoarserGridSigmas(
    const lightfield::LightField& field, lightfield::FilterKind filter,
    const std::vector<const std::vector<Term>*>& quantities);

}  // namespace luxfield::reconstruct
