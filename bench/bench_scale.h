// `luxfield bench scale`: time and memory against the number of images, their resolution, the number
// of receivers and that of triangles, with fitted exponents.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchScaleOptions {
  std::vector<std::string> estimators;      // empty: all
  std::vector<int> grids{3, 5, 8, 12, 20};  // square grids: 9 to 400 images
  std::vector<int> sizes{64, 128, 256, 512, 1024};
  std::vector<double> megapixels{0.1, 0.3, 1, 3, 10};
  std::vector<int> triangles{10000, 100000, 1000000, 10000000};  // empty: none
  int samples_per_pixel = 16;
  std::string device;
  int threads = 0;
};

// Rows [{"what", "estimator", "size", "wall_s", "core_s", "build_core_s", "peak_mib", "exponent"}].
//
// `what`: "images" (n x n, 128^2 texels, 0.05 Mpixel; a lamp of more images is larger),
// "resolution" (texels along a side, 5 x 5 images, 0.05 Mpixel) or "receivers" (Mpixel, 5 x 5
// images of 128^2). size is the number varied. wall_s and core_s light the resident G-buffer;
// peak_mib is the largest resident set of the process while tables are built and pixels lit. Or
// "triangles", whatever the estimators, of a mesh of hills (bench/hill_mesh.h): "estimator" is
// "rays", core_s finds what 1024 x 768 pixels see, build_core_s uploads it and builds the hierarchy.
// exponent, the same in all rows of a what and estimator, is the slope of log core_s over log size
// by least squares; in the lower half of the sizes overheads flatten it. Throws InputError,
// DeviceError.
nlohmann::json BenchScale(const BenchScaleOptions& options = {});

}  // namespace luxfield::bench
