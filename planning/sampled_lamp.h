// The lamp of a simulated lab as plans are judged by it: its irradiance without any model, and
// samples of its light that every filter can be laid over.
#pragma once

#include <vector>

#include "luxfield/hal/sim/lamp.h"
#include "luxfield/lightfield/geometry.h"
#include "luxfield/preprocess/light_vector_volume.h"

namespace luxfield::planning {

struct Rectangle {
  double x0 = 0, x1 = 0, y0 = 0, y1 = 0;
};

// The part of `search` on F that sends light through the lattice: whole cells of a sixty-fourth of
// its sides, and one more around, for light that passes between the middles of cells. Throws
// InputError if none does.
Rectangle LitRectangle(const hal::sim::Lamp& lamp, double delta_m, const Rectangle& search,
                       const lightfield::Lattice& lattice);

// Irradiance of every receiver straight from the lamp's radiance, of its first channel:
//
//   E = integral over F of L(u->p) max(0, n.(u-p)) z / |u-p|^4 du
//
// by the midpoint rule on nodes x nodes cells of `lit`, in double. It knows no basis, no lattice
// and no light vector. Lamps have edges: the error falls about as 1 / nodes^1.5.
std::vector<double> LampIrradiance(const hal::sim::Lamp& lamp, double delta_m, const Rectangle& lit,
                                   const std::vector<preprocess::Receiver>& receivers, int nodes);

// E(u->s) = L cos^4(theta) / delta^2 in square cells of F by texels of I, from the middle of one to
// the middle of the other: edges fall differently for every cell, so that filters average over
// them.
struct SampledLamp {
  double delta_m = 0, cell_m = 0;
  Rectangle lit;  // its lower corner is that of cell (0, 0)
  int cells_u = 0, cells_v = 0;
  lightfield::Lattice lattice;
  std::vector<float> flux_density;  // [texel][cell v][cell u], W m^-4 (or lm, or relative)

  const float* of_texel(std::size_t texel) const {
    return flux_density.data() + texel * static_cast<std::size_t>(cells_u) * cells_v;
  }
};

// `cells` along the longer side of `lit`. 4 bytes a cell and texel.
SampledLamp SampleLamp(const hal::sim::Lamp& lamp, double delta_m, const Rectangle& lit, int cells,
                       const lightfield::Lattice& lattice);

// What the samples light the receivers with: LampIrradiance with the radiance of the nearest
// sample.
std::vector<double> SampledIrradiance(const SampledLamp& samples,
                                      const std::vector<preprocess::Receiver>& receivers);

}  // namespace luxfield::planning
