// `luxfield bench noise`: whether the noise that pictures state of themselves is the scatter that
// they have over seeds.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchNoiseOptions {
  int seeds = 200;  // pictures of each case
  int width = 48, height = 36;
  int samples_per_pixel = 64;      // of a light
  std::vector<std::string> cases;  // names or what they start with; empty: all
  std::uint64_t seed = 1;          // of the first picture
  std::string device;              // as --device
  int threads = 0;                 // of an OpenCL CPU device, 0: all
};

// Three balls on a floor (bench/ball_scene.h) lit by a lamp through every estimator, by a sky, by
// area lights and by all of them, with and without shadow rays, surfaces Lambertian and glossy.
//
// Rows [{"case", "spp", "noise", "estimate", "ratio", "ratio_se", "as_independent", "four_passes",
// "scatter", "sigma"}, ...]: the RMS over pixels of the standard deviation over seeds over the mean
// luminance; the RMS over seeds of what the pictures estimate of it; the latter over the former
// with its standard error; the same ratio of what passes state of themselves, taking samples as
// independent; the noise of the same samples in four passes over that of one; how much a single
// estimate scatters, and how much it says that it does, both relative to it. Ratios are 0 where
// pictures of all seeds are alike. Throws InputError, DeviceError.
nlohmann::json BenchNoise(const BenchNoiseOptions& options = {});

}  // namespace luxfield::bench
