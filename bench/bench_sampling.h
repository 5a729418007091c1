// `luxfield bench sampling`: what it costs to draw a light sample.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/bench/bench_nearfield.h"

namespace luxfield::bench {

struct BenchSamplingOptions {
  render::SyntheticCar2Options car2;
  int width = 512, height = 384;      // of the picture whose pixels draw
  int few = 50, many = 250;           // samples per pixel
  int repeats = 3;                    // the least time counts
  std::vector<std::string> samplers;  // by the rows' names; empty: all
  std::string device;                 // as --device
  int threads = 0;                    // of an OpenCL CPU device, 0: all
};

// Rows [{"scene", "sampler", "ns_per_sample", "shaded_ns_per_sample", "set_up_ns_per_pixel",
// "threads"}, ...] for car2 on the road. Times are CPU time where the device is a CPU, else wall
// time, so that ns_per_sample is per core there. From pictures at `few` and `many` samples per
// pixel: ns_per_sample is the slope of drawing samples and adding them up unshaded, and
// shaded_ns_per_sample that of the whole estimator; what is left at no samples, windows and their
// masses, is set_up_ns_per_pixel. "windowed" is drawn from C alone (knob basis-share=0),
// "windowed, mixed" is the estimator's default. Throws InputError, DeviceError.
nlohmann::json BenchSampling(const BenchSamplingOptions& options = {});

}  // namespace luxfield::bench
