// `luxfield bench spacing`: what the filters' spacing and the distance of the planes leave of a
// lamp, before any noise.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchSpacingOptions {
  std::filesystem::path lab = "data/labs/headlight.toml", plan = "data/plans/demo.toml",
                        scene = "data/scenes/demo.toml";
  std::filesystem::path folder;                                         // scratch
  std::vector<double> spacings_mm = {49.5, 33, 24.75, 16.5, 11, 8.25};  // at the plan's delta
  std::vector<double> deltas_m = {0.3, 0.6, 1.2, 2.4, 4.8};             // at the plan's spacing
  int texels = 0;                 // along each side of the images; 0: the plan's
  int width = 160, height = 120;  // of the scene's pictures
  std::string device;
  int threads = 0;
};

// Of every spacing and distance the smallest grid of the plan's basis whose interior cells hold the
// lamp, images of as many texels over the directions that the plan's images hold (sides grow with
// delta), measured by ideal filters and solved as `reconstruct` does:
//   vary        "spacing" or "delta"
//   spacing_mm, delta_m, positions, texel_mm
//   flux_error  relative, against the lamp's
//   rel_rmse, rel_l2, mean_lab   of the scene's irradiance and picture without shadows, against
//               those of the lamp itself (lamp_picture.h)
// Throws InputError for lamps that are light fields: they have one distance of the planes.
nlohmann::json BenchSpacing(const BenchSpacingOptions& options);

}  // namespace luxfield::bench
