#include "luxfield/hal/sim/sensor.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/rig/cfa.h"

namespace luxfield::hal::sim {
namespace {

// Streams of the fixed patterns; exposures use streams from kFirstExposure on.
constexpr std::uint64_t kPrnuStream = 1, kHotStream = 2, kFirstExposure = 16;

}  // namespace

Sensor::Sensor(const SimulatedSensor& model, std::uint64_t seed) : model_(model), seed_(seed) {
  const std::size_t count = static_cast<std::size_t>(model.width) * model.height;
  sensitivity_.resize(count);
  dark_.assign(count, static_cast<float>(model.dark_current_e_per_s));
  core::ParallelFor(count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const auto row = static_cast<int>(k / model_.width),
                 column = static_cast<int>(k % model_.width);
      double value = VignettingAt(row, column);
      if (model_.prnu > 0)
        value *= 1 + model_.prnu *
                         core::Random(seed_, kPrnuStream, static_cast<std::uint32_t>(k)).Normal();
      sensitivity_[k] = static_cast<float>(value);
    }
  });
  core::Random random(seed, kHotStream);
  std::set<std::size_t> chosen;
  while (chosen.size() < std::min<std::size_t>(model.hot_pixels, count))
    chosen.insert(static_cast<std::size_t>(random.Uniform() * static_cast<double>(count)));
  for (const std::size_t k : chosen) {
    dark_[k] += static_cast<float>(model.hot_current_e_per_s);
    hot_.emplace_back(static_cast<int>(k / model.width), static_cast<int>(k % model.width));
  }
}

double Sensor::VignettingAt(int row, int column) const {
  const double x = 2 * (column + 0.5) / model_.width - 1, y = 2 * (row + 0.5) / model_.height - 1;
  return 1 - model_.corner_loss * 0.5 * (x * x + y * y);
}

std::vector<float> Sensor::Vignetting() const {
  std::vector<float> sensitivity;
  sensitivity.reserve(static_cast<std::size_t>(model_.width) * model_.height);
  for (int row = 0; row < model_.height; ++row)
    for (int column = 0; column < model_.width; ++column)
      sensitivity.push_back(static_cast<float>(VignettingAt(row, column)));
  return sensitivity;
}

session::RawFrame Sensor::Expose(const std::vector<float>& irradiance, double lamp_factor,
                                 int channel, double exposure_s, std::uint64_t stream) const {
  session::RawFrame frame;
  frame.width = model_.width;
  frame.height = model_.height;
  const bool adc = model_.bits != 32;
  if (adc)
    frame.dn.resize(frame.size());
  else
    frame.value.resize(frame.size());
  const double exposure_factor = exposure_s * lamp_factor;
  const auto responsivity = [&](std::size_t k) {
    const int seen = model_.cfa.empty()
                         ? channel
                         : rig::CfaChannel(model_.cfa, static_cast<int>(k / model_.width),
                                           static_cast<int>(k % model_.width));
    return model_.responsivity_e_per_s_per_w_m2[seen];
  };
  std::vector<double> collected(frame.size()), noise_dn(frame.size());
  core::ParallelFor(frame.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      double electrons = exposure_s * dark_[k];
      if (!irradiance.empty())
        electrons += exposure_factor * responsivity(k) * sensitivity_[k] * irradiance[k];
      core::Random random(seed_, kFirstExposure + stream, static_cast<std::uint32_t>(k));
      if (model_.photon_noise) electrons = random.Poisson(electrons);
      collected[k] = electrons;
      if (model_.read_noise_dn > 0) noise_dn[k] = model_.read_noise_dn * random.Normal();
    }
  });
  if (model_.blooming_share > 0) AddOverflow(collected);
  core::ParallelFor(frame.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const double dn =
          std::min(model_.gain_dn_per_e * collected[k] + model_.black_dn + noise_dn[k],
                   model_.saturation_dn);
      if (adc)
        frame.dn[k] = static_cast<std::uint16_t>(std::clamp(std::floor(dn + 0.5), 0.0, 65535.0));
      else
        frame.value[k] = static_cast<float>(dn);
    }
  });
  return frame;
}

void Sensor::AddOverflow(std::vector<double>& electrons) const {
  const double full = (model_.saturation_dn - model_.black_dn) / model_.gain_dn_per_e,
               q = std::exp(-1 / model_.blooming_px), first = 0.5 * model_.blooming_share * (1 - q);
  const std::vector<double> collected = electrons;
  for (int column = 0; column < model_.width; ++column)
    for (const int step : {1, -1}) {
      double passing = 0;
      for (int n = 0; n < model_.height; ++n) {
        const int row = step > 0 ? n : model_.height - 1 - n;
        const std::size_t k = static_cast<std::size_t>(row) * model_.width + column;
        electrons[k] += passing;
        passing = q * passing + first * std::max(collected[k] - full, 0.0);
      }
    }
}

}  // namespace luxfield::hal::sim
