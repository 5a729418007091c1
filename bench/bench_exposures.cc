#include "luxfield/bench/bench_exposures.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/bracket/merge_exposures.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;
using rig::SensorModel;
using session::RawFrame;

constexpr int kExposures = 8;
constexpr double kLeast_e_per_s = 30;

double Exposure_s(int index) { return std::ldexp(4.0, -2 * index); }

struct Camera {
  const char* name;
  SensorModel model;
};

std::vector<Camera> Cameras() {
  SensorModel fine;  // like that of Hanji et al. 2020
  fine.bits = 14;
  fine.gain_dn_per_e = 0.42;
  fine.read_noise_dn = 3.34;
  fine.black_dn = 512;
  fine.saturation_dn = 16383;
  SensorModel coarse = fine;
  coarse.bits = 12;
  coarse.gain_dn_per_e = 0.05;
  coarse.read_noise_dn = 0.1;
  coarse.black_dn = 64;
  coarse.saturation_dn = 4095;
  SensorModel low_black = fine;
  low_black.black_dn = 4;
  return {{"14 bit", fine}, {"coarse ADC", coarse}, {"low black", low_black}};
}

double Clipped(const SensorModel& sensor, double dn) {
  return std::clamp(std::round(dn), 0.0, sensor.saturation_dn);
}

// Pixels before equal light, every one with noise of its own; in rows far from square, so that
// few share a neighbour.
RawFrame Expose(const SensorModel& sensor, double mean_e, std::uint64_t seed,
                std::uint64_t stream) {
  RawFrame frame{sensor.width, sensor.height, {}, {}};
  frame.dn.resize(frame.size());
  core::ParallelFor(frame.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      core::Random random(seed, stream, static_cast<std::uint32_t>(p));
      const double electrons = random.Poisson(mean_e);
      frame.dn[p] = static_cast<std::uint16_t>(
          Clipped(sensor, sensor.black_dn + sensor.gain_dn_per_e * electrons +
                              sensor.read_noise_dn * random.Normal()));
    }
  });
  return frame;
}

reconstruct::MergedFrame Merge(const SensorModel& sensor, std::span<const RawFrame> frames) {
  std::vector<reconstruct::Exposure> exposures;
  for (int n = 0; n < kExposures; ++n)
    exposures.push_back({&frames[n], Exposure_s(n), 1, 1, nullptr});
  return reconstruct::MergeExposures(sensor, exposures);
}

reconstruct::MergedFrame Simulate(const SensorModel& sensor, double e_per_s, std::uint64_t seed,
                                  std::uint64_t stream) {
  std::vector<RawFrame> frames;
  for (int n = 0; n < kExposures; ++n)
    frames.push_back(Expose(sensor, Exposure_s(n) * e_per_s, seed,
                            kExposures * stream + static_cast<std::uint64_t>(n)));
  return Merge(sensor, frames);
}

json Row(const Camera& camera, double x, const reconstruct::MergedFrame& merged) {
  double n = 0, sum = 0, squares = 0, variances = 0;
  for (std::size_t p = 0; p < merged.mask.size(); ++p) {
    if (merged.mask[p] & lightfield::kUnknownMask) continue;
    const double off = merged.rate_e_per_s[p] - x, sigma = merged.sigma_e_per_s[p];
    ++n;
    sum += off;
    squares += off * off;
    variances += sigma * sigma;
  }
  json row = {{"sensor", camera.name},
              {"e_per_s", x},
              {"used", n / static_cast<double>(merged.mask.size())}};
  if (n < 2) return row;
  const double spread = std::sqrt((squares - sum * sum / n) / (n - 1));
  double information = 0;
  for (int e = 0; e < kExposures; ++e) {
    const double t = Exposure_s(e);
    information += t * t * FisherInformation(camera.model, t * x);
  }
  row["bias"] = sum / n / x;
  row["bias_se"] = spread / std::sqrt(n) / x;
  row["spread_ratio"] = spread * std::sqrt(information);
  row["sigma_ratio"] = spread / std::sqrt(variances / n);
  return row;
}

json FlagRow(const char* sensor, const char* name, const reconstruct::MergedFrame& merged) {
  double flagged = 0, no_number = 0;
  for (std::size_t p = 0; p < merged.mask.size(); ++p) {
    flagged += merged.mask[p] != 0;
    no_number += !merged.Number(p);
  }
  const double n = static_cast<double>(merged.mask.size());
  return {
      {"sensor", sensor}, {"case", name}, {"flagged", flagged / n}, {"no_number", no_number / n}};
}

// What the mean is off `x` per standard deviation of a pixel, if the estimates of pixels that are
// too dark enter, 0 in their place, or nothing.
void AddDarkBias(const reconstruct::MergedFrame& merged, double x, json* row) {
  double kept = 0, bright = 0, n = 0, bright_n = 0, variance = 0;
  for (std::size_t p = 0; p < merged.mask.size(); ++p) {
    if (merged.mask[p] & lightfield::kUnknownMask) continue;
    kept += merged.rate_e_per_s[p];
    variance += std::pow(merged.sigma_e_per_s[p], 2);
    ++n;
    const std::optional<float> number = merged.Number(p);
    bright += number.value_or(0);
    bright_n += number.has_value();
  }
  if (n == 0) return;  // no number at all
  const double sigma = std::sqrt(variance / n);
  (*row)["bias_kept"] = (kept / n - x) / sigma;
  (*row)["bias_zeroed"] = (bright / n - x) / sigma;
  (*row)["bias_dropped"] = bright_n > 0 ? json((bright / bright_n - x) / sigma) : json();
}

// Every pixel has exactly `electrons` in the longest exposure and none in the others.
reconstruct::MergedFrame Exactly(const SensorModel& sensor, double electrons) {
  std::vector<RawFrame> frames;
  for (int n = 0; n < kExposures; ++n) {
    RawFrame& frame = frames.emplace_back(RawFrame{sensor.width, sensor.height, {}, {}});
    const double e = n == 0 || electrons > 1e6 ? electrons : 0;
    frame.dn.assign(frame.size(), static_cast<std::uint16_t>(
                                      Clipped(sensor, sensor.black_dn + sensor.gain_dn_per_e * e)));
  }
  return Merge(sensor, frames);
}

// The camera's offset drifted so low that the ADC reads 0 everywhere.
reconstruct::MergedFrame BlackAboveSignal(const SensorModel& sensor) {
  std::vector<RawFrame> frames(kExposures, RawFrame{sensor.width, sensor.height, {}, {}});
  for (RawFrame& frame : frames) frame.dn.assign(frame.size(), 0);
  return Merge(sensor, frames);
}

}  // namespace

double FisherInformation(const SensorModel& sensor, double mean_e) {
  constexpr double kReach = 9;  // standard deviations
  const double g = sensor.gain_dn_per_e, reach_e = kReach * std::sqrt(mean_e) + 40;
  const auto first_e = static_cast<long>(std::max(0.0, std::floor(mean_e - reach_e)));
  const auto last_e = static_cast<long>(std::ceil(mean_e + reach_e));
  const double reach_dn = kReach * sensor.read_noise_dn + 1;
  const auto clip = [&](double dn) { return static_cast<long>(Clipped(sensor, dn)); };
  const long first = clip(sensor.black_dn + g * static_cast<double>(first_e) - reach_dn);
  const long last = clip(sensor.black_dn + g * static_cast<double>(last_e) + reach_dn);
  const long full = static_cast<long>(sensor.saturation_dn);
  std::vector<double> p(last - first + 1, 0.0), slope(p.size(), 0.0);
  // Share of the noise below the upper border of y.
  const auto below = [&](long y, double mean_dn) {
    if (y >= full) return 1.0;
    return 0.5 * std::erfc((mean_dn - (static_cast<double>(y) + 0.5)) /
                           (std::sqrt(2.0) * sensor.read_noise_dn));
  };
  const auto poisson = [&](long n) {
    if (n < 0) return 0.0;
    const auto count = static_cast<double>(n);
    return std::exp(count * std::log(mean_e) - mean_e - std::lgamma(count + 1));
  };
  double before = poisson(first_e - 1);
  for (long n = first_e; n <= last_e; ++n) {
    const double here = poisson(n), mean_dn = sensor.black_dn + g * static_cast<double>(n);
    const long from = clip(mean_dn - reach_dn), to = clip(mean_dn + reach_dn);
    double lower = from == 0 ? 0 : below(from - 1, mean_dn);
    for (long y = from; y <= to; ++y) {
      const double upper = below(y, mean_dn);
      p[y - first] += here * (upper - lower);
      slope[y - first] += (before - here) * (upper - lower);
      lower = upper;
    }
    before = here;
  }
  double information = 0;
  for (std::size_t y = 0; y < p.size(); ++y)
    if (p[y] > 1e-300) information += slope[y] * slope[y] / p[y];
  return information;
}

json BenchExposures(const BenchExposuresOptions& options) {
  if (std::min({options.pixels, options.stops, options.per_stop}) < 1)
    throw InputError("bench exposures: pixels, stops and levels per stop must be at least 1");
  const int levels = options.stops * options.per_stop + 1;
  std::vector<Camera> cameras = Cameras();
  json rows = json::array();
  core::Progress progress("bench exposures", cameras.size() * static_cast<std::size_t>(levels));
  std::uint64_t stream = 0;
  for (Camera& camera : cameras) {
    camera.model.width = std::min(options.pixels, 1024);
    camera.model.height = std::max(1, options.pixels / camera.model.width);
    const auto level = [&](double x) {
      core::ThrowIfInterrupted();
      rows.push_back(Row(camera, x, Simulate(camera.model, x, options.seed, ++stream)));
    };
    for (int n = 0; n < levels; ++n) {
      level(kLeast_e_per_s * std::exp2(static_cast<double>(n) / options.per_stop));
      progress.Advance();
    }
    for (const double x : {300.0, 3e4}) level(x);
    // One electron per pixel in the longest exposure on average, noise and all; then exactly one.
    const double photon = 1 / Exposure_s(0);
    const auto dim = Simulate(camera.model, photon, options.seed, ++stream);
    rows.push_back(FlagRow(camera.name, "one photon, noisy", dim));
    AddDarkBias(dim, photon, &rows.back());
    rows.push_back(FlagRow(camera.name, "one photon, exactly", Exactly(camera.model, 1)));
    rows.push_back(FlagRow(camera.name, "all saturated", Exactly(camera.model, 1e9)));
    rows.push_back(FlagRow(camera.name, "black above signal", BlackAboveSignal(camera.model)));
  }
  return rows;
}

}  // namespace luxfield::bench
