// What many lamps cost: the time of a picture against their number, at equal error.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchLampsOptions {
  std::vector<int> lamps{1, 200, 1000};
  int width = 512, height = 384;
  int samples_per_pixel = 16;
  int runs = 3;  // of different seeds
  bool shadows = true;
  std::filesystem::path folder;  // scratch: the lamp's file
  std::string device;            // as --device
  int threads = 0;               // of an OpenCL CPU device, 0: all
};

struct LampsFigures {
  int lamps = 0;
  std::vector<double> core_s;    // of each picture
  double samples_per_pixel = 0;  // of pixels that hit something, mean
  double relative_variance =
      0;  // of a picture's luminance over its squared mean, from pairs of runs
};

// Lamps of 5 x 5 images of 128^2 (render/accuracy/car2.h), one file, hang 30 m above a square of
// 20 m x 20 m with 60 boxes on it, evenly, and shine down: each reaches all of it. Traced shadows or
// none, the default estimator. Needs two runs. Throws InputError, DeviceError.
std::vector<LampsFigures> BenchLamps(const BenchLampsOptions& options);

// What a picture costs: median core-seconds, and those times the relative variance, the core-seconds
// to a relative variance of 1.
double CostOf(const LampsFigures& figures);
double CostAtEqualError(const LampsFigures& figures);

// Slope of log cost over log number of lamps, by least squares; NaN of a single number.
double ExponentOf(const std::vector<LampsFigures>& all, double (*cost)(const LampsFigures&));

}  // namespace luxfield::bench
