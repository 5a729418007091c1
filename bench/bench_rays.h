// Rays a device traces a second, beside Embree's.
#pragma once

#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchRaysOptions {
  int triangles = 375000;
  int width = 1024, height = 768;  // of the picture whose pixels send rays
  int runs = 3;
  std::string device;  // as --device
  int threads = 0;     // of an OpenCL CPU device, 0: all
};

// Millions of rays in a core-second, on a GPU in a second; an entry for each run.
struct RaySpeed {
  std::string rays;
  std::vector<double> device, embree_single, embree_packets;
  double device_hits = 0, embree_hits = 0;  // shares of the rays
};

// Over a mesh of hills (bench/hill_mesh.h):
//
//   closest               first hits of the pixels' rays
//   occlusion, sky        a ray from each hit into the half space above it, in proportion to the
//                         cosine: neighbours go different ways
//   occlusion, area light a ray from each hit to a random point of a rectangle of 2 m x 2 m
//
// Embree in robust mode, single rays and packets of 16, the same rays, threads and run; the time of
// building is in none. Throws InputError, DeviceError.
std::vector<RaySpeed> BenchRays(const BenchRaysOptions& options = {});

}  // namespace luxfield::bench
