// Each fast way to a picture beside the slow one that it stands for, as pictures to look at and as
// figures.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/core/measures.h"
#include "luxfield/render/renderer.h"

namespace luxfield::bench {

struct FastPicturesOptions {
  std::filesystem::path scene;        // scene.toml
  int width = 512, height = 384;      // pixels
  int samples_per_pixel = 64;         // of fast ways that sample
  int reference_samples = 1024;       // of references that sample
  double approximation_error = 2e-3;  // asked of `volume` and `gloss`
  std::uint64_t seed = 1;
  std::string device;  // as --device
  int threads = 0;     // of an OpenCL CPU device, 0: all
};

struct FastPicture {
  std::string name, how, reference_how;  // what it is called, and how both are lit
  render::Frame fast, reference;
  core::Difference difference;  // of the radiance
  // Expected relative RMSE of the luminance by what both state of their noise; 0 of pictures
  // without any, and of the same samples.
  double noise = 0;
};

// In the order below; those of which the scene has nothing are left out.
//
//   volume         the volume of light vectors              `exact`; both matt, without shadows
//   soft-maps      `volume` with soft shadow maps           `exact` with traced shadows; matt
//   gloss          `gloss` for the error asked for          `gloss` for a tenth of it; no shadows
//   cells          a few samples, traced shadows            many samples
//   windowed       a few samples, traced shadows            many samples of `cells`
//   drawn-lights   lights drawn by the tree over them       so many samples of each of them
//   ray-batches    rays traced by Embree in batches         by the kernel, the same samples
//
// Needs a luminaire; `gloss` a glossy surface, drawn-lights two lights or more, ray-batches a device
// that takes Embree's rays. Throws InputError, DeviceError.
std::vector<FastPicture> MakeFastPictures(const FastPicturesOptions& options);

}  // namespace luxfield::bench
