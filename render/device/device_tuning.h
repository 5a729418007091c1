// How work is cut for a device: the one place where CPUs and GPUs differ.
//
// Kernels compute the same whatever is chosen: sampling estimators to the bit, sums of `exact` up
// to their rounding, places that rays hit up to theirs. Chosen by rule from what the device says of itself:
//
//                      CPU                                    GPU
//   group_size         32: enough to spread over threads;     64: a multiple of every wave in use
//                      1 on Intel's runtime, whose compiler
//                      gives wrong results in groups
//   pixels_per_item    32: reuse cached windows per channel   2
//   shared_loads       4 pixels lit from the same loads       2: registers are dearer than loads
//   lanes              as wide as its vectors: 4, 8 or 16     8: fewer, longer loads
//   exact_divide       wherever the device offers it: quotients equal on all devices
//   host_rays          rays traced by Embree in packets       by a kernel
//
// No kernel uses double: what float32 cannot hold is a pair of floats or 64-bit fixed point.
#pragma once

#include <cstddef>
#include <string>

namespace luxfield::render {

struct DeviceInfo;

struct DeviceTuning {
  int group_size = 32;  // work-items of a one-dimensional group; a kernel's own limit bounds it
  int pixels_per_item = 32;   // `exact`: a multiple of shared_loads
  int shared_loads = 4;       // `exact`: 1, 2 or 4
  int lanes = 8;              // texels at once in closed forms: 4, 8 or 16
  bool exact_divide = false;  // correctly rounded division
  bool host_rays = true;      // scene/ray_scene.h

  bool operator==(const DeviceTuning&) const = default;

  // For clBuildProgram: the language, which some drivers take to be OpenCL C 3.0 otherwise, where the
  // kernels' private pointers are generic ones; -D PIXELS, SHARED and LANES, and the division.
  std::string BuildOptions() const;
  // "group=64,pixels=32,shared=4,lanes=8,divide=1,rays=1", as ParseTuning reads it.
  std::string Text() const;
};

DeviceTuning TuningOf(const DeviceInfo& info);

// `base` with what `text` changes: "group=1" or "pixels=1,shared=1" ... InputError names
// what it does not understand or what cannot be.
DeviceTuning ParseTuning(const std::string& text, const DeviceTuning& base);

}  // namespace luxfield::render
