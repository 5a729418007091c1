// A camera that develops its pictures, for tests of responses: written for them alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "luxfield/core/random.h"
#include "luxfield/reconstruct/calibrate/response/picture_stack.h"

namespace luxfield::reconstruct {

struct TestCamera {
  std::uint64_t seed = 1;
  int bits = 8;
  double full_e = 20000;  // electrons of exposure 1, which saturates
  double read_noise_e = 6;
  // Share of exposure 1 -> share of the largest code, and back; both 0 to 1, rising.
  std::function<double(double)> develop = [](double x) { return std::pow(x, 1 / 2.2); };
  std::function<double(double)> expose = [](double v) { return std::pow(v, 2.2); };

  double full_code() const { return std::ldexp(1.0, bits) - 1; }
  // ln I of a code, 0 at the reference.
  double LogExposure(double code, double reference) const {
    return std::log(expose(code / full_code()) / expose(reference / full_code()));
  }

  // `radiance` in exposures 1 per second.
  StackPicture Take(const std::vector<double>& radiance, double exposure_s,
                    std::uint64_t stream) const {
    StackPicture picture{exposure_s, std::vector<std::uint16_t>(radiance.size())};
    for (std::size_t p = 0; p < radiance.size(); ++p) {
      core::Random random(seed, stream, static_cast<std::uint32_t>(p));
      double electrons = random.Poisson(full_e * exposure_s * radiance[p]);
      electrons += read_noise_e * random.Normal();
      const double share = std::clamp(electrons / full_e, 0.0, 1.0);
      picture.code[p] = static_cast<std::uint16_t>(std::round(full_code() * develop(share)));
    }
    return picture;
  }
};

// A camera's own tone curve: a power with a toe and a shoulder, v = x^p / (x^p + k (1 - x^p)).
inline TestCamera CurvedCamera(std::uint64_t seed) {
  constexpr double kPower = 0.6, kBend = 0.45;
  TestCamera camera;
  camera.seed = seed;
  camera.develop = [](double x) {
    const double y = std::pow(x, kPower);
    return y / (y + kBend * (1 - y));
  };
  camera.expose = [](double v) { return std::pow(kBend * v / (1 - v + kBend * v), 1 / kPower); };
  return camera;
}

// Grey; radiance rises by `decades` from left to right and waves a little from row to row.
inline std::vector<double> TestScene(int width, int height, double least, double decades) {
  std::vector<double> radiance;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column)
      radiance.push_back(least * std::pow(10.0, decades * (column + 0.5) / width) *
                         (1 + 0.1 * std::sin(0.37 * row)));
  return radiance;
}

inline PictureStack TakeStack(const TestCamera& camera, const std::vector<double>& radiance,
                              int width, const std::vector<double>& exposures_s) {
  PictureStack stack{width, static_cast<int>(radiance.size()) / width, 1, camera.bits, {}};
  for (std::size_t k = 0; k < exposures_s.size(); ++k)
    stack.pictures.push_back(camera.Take(radiance, exposures_s[k], k));
  return stack;
}

}  // namespace luxfield::reconstruct
