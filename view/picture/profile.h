// Values along a line through a picture.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "luxfield/view/picture/reading.h"

namespace luxfield::view {

// What a picture says at its pixels from one place to another, both ends included: one pixel for
// each column or row that the line crosses, whichever are more. Empty where an end lies outside.
std::vector<Reading> ProfileOf(const render::Frame& frame, PicturePlace from, PicturePlace to);

// A table for other programs: a line of names with units, then one for each reading; columns with
// nothing in them where that is not known. Separated by tabs.
std::string TableOf(const std::vector<Reading>& profile, lightfield::FluxUnit unit);

}  // namespace luxfield::view
