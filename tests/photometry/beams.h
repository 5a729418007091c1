// Headlamps of a given beam: one filter of 1 mm half a metre before I, so that intensity by H and V is
// what is asked for but for a blur of 0.1 degrees.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>

#include "luxfield/core/random.h"
#include "luxfield/photometry/cut_off.h"
#include "tests/photometry/lamps.h"

namespace luxfield::photometry {

using Beam = std::function<double(double h_deg, double v_deg)>;

constexpr double kDeltaOfBeam = 0.5, kSpacingOfBeam = 1e-3;
// A whole part of the filter, over which the steps of texels are even.
constexpr double kFineTexel = kSpacingOfBeam / 5;

// Of directions up to so many degrees to either side, and from `low` to `high`; texels of 0.07 degrees.
inline lightfield::LightField FieldOf(const Beam& beam, double wide_deg = 12, double low_deg = -6,
                                      double high_deg = 5, double texel_m = 6e-4) {
  constexpr double kDegree = std::numbers::pi / 180;
  lightfield::LuminaireGeometry g;
  g.delta_m = kDeltaOfBeam;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBox), 1,
                                          1, kSpacingOfBeam);
  const double half = kDeltaOfBeam * std::tan(wide_deg * kDegree) + kSpacingOfBeam,
               top = kDeltaOfBeam * std::tan(high_deg * kDegree) * 1.1,
               bottom = kDeltaOfBeam * std::tan(low_deg * kDegree) * 1.1;
  const int width = static_cast<int>(std::ceil(2 * half / texel_m)),
            height = static_cast<int>(std::ceil((top - bottom) / texel_m));
  g.lattice = {width, height, -half, top, texel_m, texel_m};
  g.unit = lightfield::FluxUnit::kLumen;
  lightfield::LightField field(g);
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const auto s = g.lattice.centre(row, column);
      const double h = std::atan2(-s.x, kDeltaOfBeam) / kDegree,
                   v = std::atan2(s.y, std::hypot(s.x, kDeltaOfBeam)) / kDegree;
      const double cosine = lightfield::CosTheta(kDeltaOfBeam, {0, 0}, s);
      field.data[std::size_t(row) * width + column] =
          static_cast<float>(beam(h, v) * cosine * cosine * cosine /
                             (kDeltaOfBeam * kDeltaOfBeam * kSpacingOfBeam * kSpacingOfBeam));
    }
  return field;
}

// A passing beam: bright below a cut-off that is level to the left of `elbow_h` and rises by 15
// degrees to its right, with G about 0.1 / 0.55 deg x contrast.
struct PassingBeam {
  double elbow_h = 0, level_v = -0.57, width_deg = 0.1, bright = 20000, dark = 200;

  double CutOffAt(double h) const {
    return h < elbow_h ? level_v : level_v + std::tan(std::numbers::pi / 12) * (h - elbow_h);
  }
  double operator()(double h, double v) const {
    return dark + bright / (1 + std::exp((v - CutOffAt(h)) / width_deg));
  }
};

// The known beam's largest gradient, on a fine lattice, its logarithm that of the mean over what the
// lamp and the receiver blur: 0.07 (receiver), 0.07 (texel) and 0.11 (filter) degrees.
inline CutOff KnownCutOff(const PassingBeam& beam, double h) {
  const auto blurred = [&](double v) {
    double sum = 0;
    constexpr int kNodes = 9;
    for (int a = 0; a < kNodes; ++a)
      for (int b = 0; b < kNodes; ++b)
        for (int c = 0; c < kNodes; ++c) {
          const auto at = [](int k, double width) { return width * ((k + 0.5) / kNodes - 0.5); };
          sum += beam(h, v + at(a, 0.0688) + at(b, 0.0688) + at(c, 0.1146));
        }
    return sum;
  };
  CutOff best;
  for (double v = -2; v < 1; v += 0.005) {
    const double g = std::log10(blurred(v) / blurred(v + 0.1));
    if (g > best.gradient) best = {{h, v + 0.05}, g, {h, v}};
  }
  return best;
}

// Standard deviations that are a share of C, and a little in the dark.
inline lightfield::LightField SigmaOf(const lightfield::LightField& field, double share) {
  lightfield::LightField sigma = field;
  float largest = 0;
  for (const float c : field.data) largest = std::max(largest, c);
  for (float& c : sigma.data) c = static_cast<float>(share * (std::abs(c) + 1e-4 * largest));
  return sigma;
}
inline lightfield::LightField Drawn(lightfield::LightField field,
                                    const lightfield::LightField& sigma, core::Random& random) {
  for (std::size_t k = 0; k < field.data.size(); ++k)
    field.data[k] += static_cast<float>(sigma.data[k] * random.Normal());
  return field;
}
inline Lamp WithSigma(const lightfield::LightField& field, const lightfield::LightField& sigma) {
  Lamp lamp = LampOfField(field);
  const std::vector<lightfield::PosedLightField> sigmas = {{"", {}, sigma}};
  const std::vector<SolveMaps> maps(1);
  SetNoise(lamp, sigmas, maps, "sigma");
  return lamp;
}

}  // namespace luxfield::photometry
