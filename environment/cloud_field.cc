#include "luxfield/environment/cloud_field.h"

#include <cmath>

#include "luxfield/core/random.h"

namespace luxfield::environment {
namespace {

// Weights of the quadratic B-spline at `x` for the three lattice points from `first` on, scaled so
// that their squares add up to 1: independent normal values stay of variance 1 everywhere.
struct Spline {
  std::int64_t first = 0;
  std::array<double, 3> weights{};
};
Spline SplineAt(double x) {
  const double nearest = std::round(x), f = x - nearest;
  Spline s{static_cast<std::int64_t>(nearest) - 1,
           {0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f)}};
  const auto& w = s.weights;
  const double scale = 1 / std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  for (double& weight : s.weights) weight *= scale;
  return s;
}

}  // namespace

CloudField::CloudField(std::uint64_t seed, double cell_m) {
  double energy = 0;
  for (int k = 0; k < kOctaves; ++k) {
    Octave& octave = octaves_[k];
    octave.cell_m = cell_m * std::exp2(-k);
    octave.amplitude = std::exp2(-k / 3.0);
    octave.cosine = std::cos(0.7 * k);
    octave.sine = std::sin(0.7 * k);
    energy += octave.amplitude * octave.amplitude;
    core::Random random(seed, k);
    octave.lattice.resize(kLattice * kLattice);
    for (float& value : octave.lattice) value = static_cast<float>(random.Normal());
  }
  for (Octave& octave : octaves_) octave.amplitude /= std::sqrt(energy);
}

CloudField::Value CloudField::At(lightfield::Vec2 p, double width_m) const {
  Value value;
  double lost = 0;
  for (const Octave& octave : octaves_) {
    // What a square leaves of a wave of 3 cells, about the noise's own.
    const double cells = width_m / octave.cell_m;
    const double pass = std::exp(-0.18 * cells * cells), amplitude = pass * octave.amplitude;
    lost += (1 - pass * pass) * octave.amplitude * octave.amplitude;
    if (amplitude < 1e-3) continue;
    const Spline u = SplineAt((octave.cosine * p.x - octave.sine * p.y) / octave.cell_m);
    const Spline v = SplineAt((octave.sine * p.x + octave.cosine * p.y) / octave.cell_m);
    double sum = 0;
    for (int j = 0; j < 3; ++j) {
      const float* row = &octave.lattice[((v.first + j) & (kLattice - 1)) * kLattice];
      for (int i = 0; i < 3; ++i)
        sum += v.weights[j] * u.weights[i] * row[(u.first + i) & (kLattice - 1)];
    }
    value.mean += amplitude * sum;
  }
  value.sigma = std::sqrt(lost);
  return value;
}

}  // namespace luxfield::environment
