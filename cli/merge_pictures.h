// What `merge` does with pictures instead of a session.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/core/json.h"

namespace luxfield::cli {

struct MergePicturesOptions {
  std::vector<std::filesystem::path> images;
  std::vector<double> exposures_s;  // empty: Exif
  std::filesystem::path calibration, output;
  bool estimate_exposures = false;
};

core::Json MergePictures(const MergePicturesOptions& options);

}  // namespace luxfield::cli
