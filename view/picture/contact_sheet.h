// The coefficient images of a light field side by side.
#pragma once

#include "luxfield/core/image.h"
#include "luxfield/lightfield/light_field.h"

namespace luxfield::view {

// As a grid of cells: image (i, j) in column i from the left and row j from below, as a viewer from
// behind the filter plane has u and v.
struct ContactSheet {
  core::Image values;  // one channel, row 0 on top: luminances of texels, or means of several
  int shrink = 1;      // texels along a side of a value
  int cell_width = 0, cell_height = 0;
};

// With the least shrinking that leaves at most `most_side` values along each side.
ContactSheet ContactSheetOf(const lightfield::LightField& field, int most_side = 2048);

// What a value of the sheet is of; the texel is the first of those it is the mean of.
struct SheetPlace {
  int i = 0, j = 0, column = 0, row = 0;
};
SheetPlace PlaceOn(const ContactSheet& sheet, const lightfield::LightField& field, int column,
                   int row);

// Of a texel: C, or its luminance.
double LuminanceOf(const lightfield::LightField& field, const SheetPlace& place);

}  // namespace luxfield::view
