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

using lightfield::LightField;
using lightfield::LightVector;
using lightfield::LuminaireGeometry;

struct Judge {
  std::vector<JudgedReceiver> lit;
  bool has_volume = false;  // any by_volume

  Judge(const LightField& field, std::span<const Receiver> candidates) {
    std::vector<JudgedReceiver> seen(candidates.size());
    core::ParallelFor(candidates.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const Receiver& receiver = candidates[k];
        if (!SeesImages(field.geometry, receiver.p)) continue;
        seen[k] = {receiver,
                   VolumeLights(field.geometry, receiver, std::numeric_limits<double>::infinity()),
                   lightfield::ExactIrradiance(field, receiver.p, receiver.n)};
      }
    });
    for (const JudgedReceiver& one : seen)
      if (one.by_volume || one.irradiance != std::array<double, 3>{}) {
        lit.push_back(one);
        has_volume |= one.by_volume;
      }
  }

  double Error(const LightVectorVolume& volume) const {
    double squares = 0, sum = 0, volume_sum = 0;
    std::size_t count = 0, volume_count = 0;
    for (const auto& [receiver, by_volume, irradiance] : lit) {
      std::optional<LightVector> vector;
      if (by_volume) vector = InterpolateLightVector(volume, receiver.p);
      for (int channel = 0; channel < 3; ++channel) {
        sum += irradiance[channel];
        ++count;
        if (!vector) continue;
        const double error = Dot(receiver.n, vector->j[channel]) - irradiance[channel];
        squares += error * error;
        volume_sum += irradiance[channel];
        ++volume_count;
      }
    }
    if (!(squares > 0)) return 0;
    return std::max(std::sqrt(squares * static_cast<double>(count)) / std::abs(sum),
                    std::sqrt(squares * static_cast<double>(volume_count)) / std::abs(volume_sum));
  }

  // Mean square difference of two volumes.
  double Difference(const LightVectorVolume& a, const LightVectorVolume& b) const {
    double squares = 0;
    for (const auto& [receiver, by_volume, irradiance] : lit) {
      if (!by_volume) continue;
      const auto from_a = InterpolateLightVector(a, receiver.p),
                 from_b = InterpolateLightVector(b, receiver.p);
      if (!from_a || !from_b) continue;
      for (int channel = 0; channel < 3; ++channel) {
        const double error = Dot(receiver.n, from_a->j[channel] - from_b->j[channel]);
        squares += error * error;
      }
    }
    return std::sqrt(squares);
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

// What to multiply a spacing by so that its part of the error, here over its target, falls to 1 in
// fourth order. The axis with the worse part is made finer in any case.
double Refinement(double share, bool worse) {
  return std::clamp(std::pow(share, -0.25), 0.25, worse ? 0.8 : 1.0);
}

double CellOf(const Interval& range, int nodes) { return (range.hi - range.lo) / (nodes - 1); }

}  // namespace

double VolumeError(const LightVectorVolume& volume, const LightField& field,
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

VolumeForError BuildForError(const LightField& field, const Reach& reach,
                             std::span<const Receiver> receivers, const VolumeOptions& options) {
  if (!(options.max_rel_error > 0))
    throw InputError(
        fmt::format("a light-vector volume for a relative error of {}; it must be "
                    "above 0",
                    options.max_rel_error));
  const LuminaireGeometry& g = field.geometry;
  const Judge judge(field, receivers);
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
  // Nodes count twice in a, once in tau: the volume is smallest for these shares of the target,
  // a little below it for safety.
  const double target_a = 0.85 * std::sqrt(2.0 / 3) * options.max_rel_error,
               target_tau = 0.85 * std::sqrt(1.0 / 3) * options.max_rel_error;
  for (;;) {
    const VolumeResolution resolution = spacings.Resolution(wide);
    if (VolumeBytes(resolution, g.channels) > options.max_bytes) {
      result.met = false;
      return result;
    }
    result.volume = BuildLightVectorVolume(field, reach, resolution);
    result.rel_error = judge.Error(result.volume);
    ++result.builds;
    if (result.rel_error <= options.max_rel_error) return result;
    const double a = judge.Difference(result.volume, CoarserInA(result.volume)),
                 tau = judge.Difference(result.volume, CoarserInTau(result.volume));
    const double scale =
        result.rel_error / std::max(std::hypot(a, tau), std::numeric_limits<double>::min());
    const double share_a = scale * a / target_a, share_tau = scale * tau / target_tau;
    spacings.a_m = std::min(spacings.a_m, CellOf(wide.a_x_m, resolution.a_x));
    spacings.tau = std::min(spacings.tau, CellOf(wide.tau, resolution.tau));
    spacings.a_m *= Refinement(share_a, share_a > share_tau);
    spacings.tau *= Refinement(share_tau, share_tau >= share_a);
  }
}

VolumeForError BuildForReceivers(const LightField& field, std::span<const Receiver> receivers,
                                 const VolumeOptions& options, std::size_t sample,
                                 std::uint64_t seed) {
  const Reach reach = ReachOf(field.geometry, receivers, MaxTau(field.geometry));
  std::vector<Receiver> seeing;
  for (const Receiver& receiver : receivers)
    if (SeesImages(field.geometry, receiver.p)) seeing.push_back(receiver);
  if (sample < seeing.size()) {
    core::Random random(seed, 0);
    for (std::size_t k = 0; k < sample; ++k)
      std::swap(seeing[k],
                seeing[k + static_cast<std::size_t>(random.Uniform() *
                                                    static_cast<double>(seeing.size() - k))]);
    seeing.resize(sample);
  }
  const bool by_volume = std::any_of(seeing.begin(), seeing.end(), [&](const Receiver& receiver) {
    return VolumeLights(field.geometry, receiver, MaxTau(field.geometry));
  });
  return BuildForError(field, by_volume ? reach : Reach{}, seeing, options);
}

}  // namespace luxfield::preprocess
