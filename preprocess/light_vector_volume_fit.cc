// A light-vector volume for an error target.
#include <fmt/format.h>

#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/preprocess/cubic_spline.h"
#include "luxfield/preprocess/light_vector_volume.h"

namespace luxfield::preprocess {
namespace {

using lightfield::FieldColumns;
using lightfield::LightField;
using lightfield::LuminaireGeometry;

struct VolumeErrors {
  double rms = 0, largest = 0;
};

// Of the RMSE over the mean that is asked for: what no receiver may be off by, relative to what it
// and the mean receiver see. Splines swing beside edges of the light, which an RMSE over a picture
// hardly counts where few pixels are so near the lamp.
constexpr double kLargestError = 3;
// For that a volume is built so many times more at most, each time with up to 1 / kFinest times the
// nodes along each axis.
constexpr int kMoreBuilds = 2;
constexpr double kFinest = 0.6;

// Those of the candidates that see images, dark still.
std::vector<JudgedReceiver> SeenOf(const LuminaireGeometry& geometry,
                                   std::span<const Receiver> candidates) {
  std::vector<JudgedReceiver> seen;
  for (const Receiver& receiver : candidates)
    if (SeesImages(geometry, receiver.p))
      seen.push_back({receiver,
                      VolumeLights(geometry, receiver, std::numeric_limits<double>::infinity()),
                      {}});
  return seen;
}

void AddLight(const LightField& group, std::vector<JudgedReceiver>& seen) {
  core::ParallelFor(seen.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const auto light = lightfield::ExactIrradiance(group, seen[k].receiver.p, seen[k].receiver.n);
      for (std::size_t channel = 0; channel < 3; ++channel)
        seen[k].irradiance[channel] += light[channel];
    }
  });
}

void DropDark(std::vector<JudgedReceiver>& seen) {
  std::erase_if(seen, [](const JudgedReceiver& one) {
    return !one.by_volume && one.irradiance == std::array<double, 3>{};
  });
}

struct Judge {
  std::vector<JudgedReceiver> lit, spread;
  bool has_volume = false;  // any of `lit` is by_volume
  double mean = 0;          // irradiance of `lit`

  Judge(const FieldColumns& field, std::span<const Receiver> receivers,
        std::span<const Receiver> spread_receivers = {})
      : lit(SeenOf(field.geometry(), receivers)),
        spread(SeenOf(field.geometry(), spread_receivers)) {
    field.ForEachGroup([&](const LightField& group, int) {
      AddLight(group, lit);
      AddLight(group, spread);
    });
    DropDark(lit);
    DropDark(spread);
    for (const JudgedReceiver& one : lit) {
      has_volume |= one.by_volume;
      for (const double irradiance : one.irradiance) mean += irradiance;
    }
    if (!lit.empty()) mean /= 3 * static_cast<double>(lit.size());
  }

  double Error(const LightVectorVolume& volume) const {
    double squares = 0, volume_sum = 0;
    std::size_t volume_count = 0;
    for (const auto& [receiver, by_volume, irradiance] : lit) {
      const auto vector = by_volume ? InterpolateLightVector(volume, receiver.p) : std::nullopt;
      if (!vector) continue;
      for (int channel = 0; channel < 3; ++channel) {
        const double error = Dot(receiver.n, vector->j[channel]) - irradiance[channel];
        squares += error * error;
        volume_sum += irradiance[channel];
        ++volume_count;
      }
    }
    if (!(squares > 0)) return 0;
    const double count = 3 * static_cast<double>(lit.size());
    return std::max(std::sqrt(squares / count) / std::abs(mean),
                    std::sqrt(squares * static_cast<double>(volume_count)) / std::abs(volume_sum));
  }

  // The largest |error| over what the receiver and the mean receiver see.
  double LargestError(const LightVectorVolume& volume) const {
    double largest = 0;
    for (const auto& [receiver, by_volume, irradiance] : spread) {
      const auto vector = by_volume ? InterpolateLightVector(volume, receiver.p) : std::nullopt;
      for (int channel = 0; vector && channel < 3; ++channel)
        largest =
            std::max(largest, Relative(Dot(receiver.n, vector->j[channel]) - irradiance[channel],
                                       irradiance[channel]));
    }
    return largest;
  }

  // Of two volumes: root of the sum of squared differences, and the largest as above.
  VolumeErrors Difference(const LightVectorVolume& a, const LightVectorVolume& b) const {
    VolumeErrors difference;
    const auto visit = [&](const std::vector<JudgedReceiver>& judges, auto&& add) {
      for (const auto& [receiver, by_volume, irradiance] : judges) {
        if (!by_volume) continue;
        const auto from_a = InterpolateLightVector(a, receiver.p),
                   from_b = InterpolateLightVector(b, receiver.p);
        if (!from_a || !from_b) continue;
        for (int channel = 0; channel < 3; ++channel)
          add(Dot(receiver.n, from_a->j[channel] - from_b->j[channel]), irradiance[channel]);
      }
    };
    visit(lit, [&](double error, double) { difference.rms += error * error; });
    difference.rms = std::sqrt(difference.rms);
    visit(spread, [&](double error, double irradiance) {
      difference.largest = std::max(difference.largest, Relative(error, irradiance));
    });
    return difference;
  }

 private:
  double Relative(double error, double irradiance) const {
    return std::abs(error) /
           std::max(std::abs(irradiance) + std::abs(mean), std::numeric_limits<double>::min());
  }
};

// Every second of an odd number of nodes. `outer` and `inner` as for SplineFromValues.
std::vector<float> LeaveOutNodes(const std::vector<float>& data, VolumeAxis& axis,
                                 std::size_t inner) {
  const std::size_t old = axis.coefficients(), outer = data.size() / old / inner;
  axis.nodes = (axis.nodes + 1) / 2;
  axis.spacing *= 2;
  const std::size_t left = axis.coefficients();
  std::vector<float> out(outer * left * inner, 0.0f);
  for (std::size_t o = 0; o < outer; ++o)
    for (std::size_t node = 0; node + 2 < left; ++node) {
      const float* c = data.data() + (o * old + 2 * node) * inner;
      float* value = out.data() + (o * left + node + 1) * inner;
      for (std::size_t k = 0; k < inner; ++k)
        value[k] = static_cast<float>(ValueAtNode(c[k], c[inner + k], c[2 * inner + k]));
    }
  SplineFromValues(out.data(), outer, axis.nodes, inner);
  return out;
}

LightVectorVolume CoarserInA(LightVectorVolume volume) {
  volume.coefficients = LeaveOutNodes(volume.coefficients, volume.a_x, 4);
  volume.coefficients =
      LeaveOutNodes(volume.coefficients, volume.a_y, 4 * volume.a_x.coefficients());
  return volume;
}

LightVectorVolume CoarserInTau(LightVectorVolume volume) {
  volume.coefficients = LeaveOutNodes(volume.coefficients, volume.tau,
                                      4 * volume.a_x.coefficients() * volume.a_y.coefficients());
  return volume;
}

struct Spacings {
  double a_m = 0, tau = 0;

  // Odd node counts, of at least 7: half of the nodes can be left out.
  VolumeResolution Resolution(const Reach& reach) const {
    const auto nodes = [](const Interval& range, double spacing) {
      const double cells = std::clamp(std::ceil((range.hi - range.lo) / spacing), 6.0, 1e6);
      return 2 * ((static_cast<int>(cells) + 1) / 2) + 1;
    };
    return {nodes(reach.a_x_m, a_m), nodes(reach.a_y_m, a_m), nodes(reach.tau, tau)};
  }
};

// What the axes do to an error.
struct Shares {
  double a = 0, tau = 0;
};

// What to multiply a spacing by so that its part of the error, here over its target, falls to 1 in
// fourth order. The axis with the worse part is made finer in any case.
double Refinement(double share, bool worse, double finest) {
  return std::clamp(std::pow(share, -0.25), finest, worse ? 0.8 : 1.0);
}

// Finer spacings for an `error` that is to be `target` at most, none below `finest` of what it is.
void Refine(const Shares& differences, double error, double target, double finest,
            Spacings& spacings) {
  // Nodes count twice in a, once in tau: the volume is smallest for these shares of the target,
  // a little below it for safety.
  const double scale = error / std::max(std::hypot(differences.a, differences.tau),
                                        std::numeric_limits<double>::min()),
               a = scale * differences.a / (0.85 * std::sqrt(2.0 / 3) * target),
               tau = scale * differences.tau / (0.85 * std::sqrt(1.0 / 3) * target);
  spacings.a_m *= Refinement(a, a > tau, finest);
  spacings.tau *= Refinement(tau, tau >= a, finest);
}

double CellOf(const Interval& range, int nodes) { return (range.hi - range.lo) / (nodes - 1); }

// At most `count` of the receivers that a volume over `reach` lights, as many of each sixteenth of
// its range of tau as there are.
std::vector<Receiver> SpreadOverTau(const LuminaireGeometry& geometry, const Reach& reach,
                                    std::span<const Receiver> receivers, std::size_t count,
                                    std::uint64_t seed) {
  constexpr std::size_t kBins = 16;
  std::vector<Receiver> spread;
  if (reach.empty()) return spread;
  std::array<std::vector<std::size_t>, kBins> bins;
  for (std::size_t k = 0; k < receivers.size(); ++k) {
    const double tau = CoordinatesOf(geometry, receivers[k].p).tau,
                 at = kBins * (tau - reach.tau.lo) / (reach.tau.hi - reach.tau.lo);
    if (at >= 0 && at <= kBins)
      bins[std::min(static_cast<std::size_t>(at), kBins - 1)].push_back(k);
  }
  core::Random random(seed, 1);
  for (const auto& bin : bins)
    for (std::size_t k = 0; k < std::min(bin.size(), count / kBins); ++k) {
      const auto at = static_cast<std::size_t>(random.Uniform() * static_cast<double>(bin.size()));
      spread.push_back(receivers[bin[at]]);
    }
  return spread;
}

}  // namespace

double VolumeError(const LightVectorVolume& volume, const FieldColumns& field,
                   std::span<const Receiver> receivers) {
  return Judge(field, receivers).Error(volume);
}

std::vector<Receiver> RandomReceivers(const LuminaireGeometry& geometry, const Reach& reach,
                                      std::size_t count, std::uint64_t seed) {
  std::vector<Receiver> receivers;
  if (reach.empty()) return receivers;
  const lightfield::Vec2 centre = SupportCentre(geometry);
  core::Random random(seed, 0);
  const auto draw = [&](const Interval& range) {
    return range.lo + random.Uniform() * (range.hi - range.lo);
  };
  for (std::size_t trial = 0; trial < 16 * count && receivers.size() < count; ++trial) {
    const double tau = draw(reach.tau), a_x = draw(reach.a_x_m), a_y = draw(reach.a_y_m);
    const Receiver receiver{{centre.x + a_x / tau, centre.y + a_y / tau, geometry.delta_m / tau},
                            {0, 0, -1}};
    if (SeesImages(geometry, receiver.p)) receivers.push_back(receiver);
  }
  return receivers;
}

VolumeForError BuildForError(const FieldColumns& field, const Reach& reach,
                             std::span<const Receiver> receivers, const VolumeOptions& options,
                             std::span<const Receiver> spread) {
  if (!(options.max_rel_error > 0))
    throw InputError(
        fmt::format("a light-vector volume for a relative error of {}; it must be "
                    "above 0",
                    options.max_rel_error));
  const LuminaireGeometry& g = field.geometry();
  const Judge judge(field, receivers, spread);
  VolumeForError result;
  result.volume.geometry = g;
  result.judges = judge.lit;
  result.met = true;
  if (reach.empty()) return result;
  if (!judge.has_volume)
    throw InputError("a light-vector volume needs receivers to measure its error at");
  const Reach wide = WidenNarrowAxes(g, reach);
  // A step in tau moves the light of the rim of F by as much as a step in a moves all of it.
  const lightfield::Vec2 centre = SupportCentre(g);
  const double rim_m = std::max(centre.x - g.grid.u0_m, centre.y - g.grid.v0_m);
  Spacings spacings{g.grid.spacing_m, g.grid.spacing_m / rim_m};
  bool met = false;
  for (int more_builds = 0;;) {
    const VolumeResolution resolution = spacings.Resolution(wide);
    if (const auto bytes = VolumeBytes(resolution, g.channels); bytes > options.max_bytes) {
      result.met = met;
      result.wanted_bytes = bytes;
      return result;
    }
    result.volume = {};  // its bytes are the next one's
    result.volume = BuildLightVectorVolume(field, reach, resolution);
    result.rel_error = judge.Error(result.volume);
    ++result.builds;
    met = result.rel_error <= options.max_rel_error;
    const double largest = judge.LargestError(result.volume),
                 max_largest = kLargestError * options.max_rel_error;
    if (met && (more_builds++ == kMoreBuilds || largest <= max_largest)) return result;
    const VolumeErrors a = judge.Difference(result.volume, CoarserInA(result.volume)),
                       tau = judge.Difference(result.volume, CoarserInTau(result.volume));
    spacings.a_m = std::min(spacings.a_m, CellOf(wide.a_x_m, resolution.a_x));
    spacings.tau = std::min(spacings.tau, CellOf(wide.tau, resolution.tau));
    if (met)
      Refine({a.largest, tau.largest}, largest, max_largest, kFinest, spacings);
    else
      Refine({a.rms, tau.rms}, result.rel_error, options.max_rel_error, 0.25, spacings);
  }
}

VolumeForError BuildForReceivers(const FieldColumns& field, std::span<const Receiver> receivers,
                                 const VolumeOptions& options, std::size_t sample,
                                 std::uint64_t seed) {
  const LuminaireGeometry& g = field.geometry();
  const Reach reach = ReachOf(g, receivers, MaxTau(g));
  std::vector<Receiver> seeing;
  for (const Receiver& receiver : receivers)
    if (SeesImages(g, receiver.p)) seeing.push_back(receiver);
  const std::vector<Receiver> spread = SpreadOverTau(g, reach, seeing, 2 * sample, seed);
  if (sample < seeing.size()) {
    core::Random random(seed, 0);
    for (std::size_t k = 0; k < sample; ++k)
      std::swap(seeing[k],
                seeing[k + static_cast<std::size_t>(random.Uniform() *
                                                    static_cast<double>(seeing.size() - k))]);
    seeing.resize(sample);
  }
  const bool by_volume = std::any_of(seeing.begin(), seeing.end(), [&](const Receiver& receiver) {
    return VolumeLights(g, receiver, MaxTau(g));
  });
  return BuildForError(field, by_volume ? reach : Reach{}, seeing, options, spread);
}

}  // namespace luxfield::preprocess
