// The thesis' flagship: a picture of two headlights with shadows, frame after frame.
#pragma once

#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchFlagshipOptions {
  int width = 1024, height = 768;
  int map_size = 192;                     // texels along each side of a shadow map
  int lab_width = 192, lab_height = 144;  // of the picture that is compared with the truth
  int truth_samples = 512;                // of each lamp and pixel, traced
  int runs = 3;
  std::string device;  // as --device
  int threads = 0;     // of an OpenCL CPU device, 0: all
};

struct Flagship {
  std::vector<double> core_s, wall_s;  // of a frame: primary visibility and lighting
  double maps_core_s = 0;              // of casting the shadow maps, once
  double mean_lab = 0;                 // against traced truth
};

// Two lamps of 11 x 9 images of 256^2 (render/accuracy/car2.h), 1.2 m apart, light
// bench/occluder_scene.h by `exact` behind shadow maps, cast once. The truth is `windowed`'s with a
// ray for each sample. Throws InputError, DeviceError.
Flagship BenchFlagship(const BenchFlagshipOptions& options = {});

}  // namespace luxfield::bench
