// A Gaussian random field over a plane, the shape of clouds: eight octaves of noise on lattices
// that are turned against each other, cell 2^-k of the first with amplitude 2^(-k/3), as a passive
// quantity in turbulent air has it (Obukhov 1949; structure function r^(2/3)). Lines of equal value
// have the fractal dimension (3 - 1/3) / 2 = 1.33 (Kondev and Henley 1995); clouds are seen to have
// 1.35 (Lovejoy, Science 216, 1982).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::environment {

class CloudField {
 public:
  // The same field for the same seed. `cell_m` is the first octave's; the field repeats itself
  // after 128 cells of each octave, which no two octaves do together.
  CloudField(std::uint64_t seed, double cell_m);

  // Mean over a square of side `width_m`, and the standard deviation of the field inside of it,
  // from 0 (a point) to 1. Of a point over all seeds: normal, mean 0, variance 1.
  struct Value {
    double mean = 0, sigma = 0;
  };
  Value At(lightfield::Vec2 position_m, double width_m) const;

 private:
  static constexpr int kOctaves = 8, kLattice = 128;
  struct Octave {
    double cell_m = 0, amplitude = 0;
    double cosine = 1, sine = 0;  // of its turn
    std::vector<float> lattice;   // kLattice^2 standard normal values
  };
  std::array<Octave, kOctaves> octaves_;
};

}  // namespace luxfield::environment
