// Bright discs on an opaque plane: finding them, and their centres in the plane's coordinates.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "luxfield/rig/filter_sheet.h"
#include "luxfield/rig/homography.h"

namespace luxfield::reconstruct {

// Row-major picture; NaN where unknown.
struct Picture {
  int width = 0, height = 0;
  std::span<const float> value;
  std::span<const float> sigma;
};

// From (column, row) with pixel edges at whole numbers: least squares over at least 4 pairs, both sides scaled to unit spread; the residuals are those of
// the plane. InputError if they do not fix one.
rig::Homography FitHomography(std::span<const lightfield::Vec2> sensor,
                              std::span<const lightfield::Vec2> plane);

// Sensor positions of the discs of `marks` in the picture of a bright square of side 2 * half_m
// with the discs around it, roughly upright: components brighter than a third of the picture's, by
// their size and nearest to where the square puts them. Absent where there is none. InputError
// without such a square.
std::vector<std::optional<lightfield::Vec2>> FindDiscs(
    const Picture& picture, double half_m, std::span<const rig::RegistrationMark> marks);

struct Centroid {
  lightfield::Vec2 centre_m;
  double sigma_m = 0;  // of either coordinate, from the picture's noise
  double light = 0;    // mean over the disc's area, above the dark around it
  double light_sigma = 0;
};

// Centroid of the light within two radii of `expected` less the mean between 1.6 and 2 radii,
// pixels weighed by their area on the plane: free of the bias of circles under perspective. A slope
// g of the light over the disc moves it by g r^2 / 4.
Centroid MeasureDisc(const Picture& picture, const rig::Homography& plane_from_sensor,
                     const rig::RegistrationMark& expected);

}  // namespace luxfield::reconstruct
