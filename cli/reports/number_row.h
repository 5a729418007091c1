// A number of a report with what it is of: a line of CSV.
#pragma once

#include <string>

#include "luxfield/photometry/functional.h"

namespace luxfield::cli {

struct NumberRow {
  std::string quantity, where, unit;
  photometry::Estimate value;
  bool rating = false;  // a unified glare rating, which people read from kLeastRating on
};

}  // namespace luxfield::cli
