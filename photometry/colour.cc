#include "luxfield/photometry/colour.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/core/parallel.h"
#include "luxfield/core/primaries.h"

namespace luxfield::photometry {
namespace {

using core::Rgb;
using lightfield::PosedLightField;
using lightfield::Vec3;

std::vector<PosedLightField> ChannelOf(std::span<const PosedLightField> fields, int channel) {
  std::vector<PosedLightField> one;
  for (const PosedLightField& posed : fields) {
    auto geometry = posed.field.geometry;
    geometry.channels = 1;
    lightfield::LightField field(geometry);
    field.provenance = posed.field.provenance;
    for (int m = 0; m < geometry.grid.count(); ++m)
      std::ranges::copy(posed.field.image(m, channel), field.image(m, 0).begin());
    one.push_back({posed.name, posed.luminaire_from_field, std::move(field)});
  }
  return one;
}

Rgb XyzOf(const Rgb& rgb) {
  static const core::Matrix3 matrix = core::XyzFromRgb(core::kRec709);
  return core::Apply(matrix, rgb);
}

struct UvPrime {
  double u = 0, v = 0;
};
UvPrime UvOf(const Rgb& rgb) {
  const auto [x, y, z] = XyzOf(rgb);
  const double sum = x + 15 * y + 3 * z;
  return {4 * x / sum, 9 * y / sum};
}

// Slopes of f by the channels.
Rgb SlopeOf(const Rgb& rgb, const std::function<double(const Rgb&)>& f) {
  constexpr double kStep = 1e-5;
  const double step = kStep * std::max({std::abs(rgb[0]), std::abs(rgb[1]), std::abs(rgb[2])});
  Rgb slope{};
  for (std::size_t k = 0; k < 3; ++k) {
    Rgb more = rgb, less = rgb;
    more[k] += step;
    less[k] -= step;
    slope[k] = (f(more) - f(less)) / (2 * step);
  }
  return slope;
}

// f of three measured channels, with what follows from their standard uncertainties.
Estimate OfChannels(const Rgb& rgb, const std::optional<Rgb>& u,
                    const std::function<double(const Rgb&)>& f) {
  Estimate estimate{f(rgb), {}};
  if (!u) return estimate;
  const Rgb slope = SlopeOf(rgb, f);
  double variance = 0;
  for (std::size_t k = 0; k < 3; ++k) variance += slope[k] * slope[k] * (*u)[k] * (*u)[k];
  estimate.u = std::sqrt(variance);
  return estimate;
}

// The black body's place in CIE 1960 u, v, rational approximations of the whole locus.
struct Uv1960 {
  double u = 0, v = 0;
};
Uv1960 BlackBody(double t) {
  return {(0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t) /
              (1 + 8.42420235e-4 * t + 7.08145163e-7 * t * t),
          (0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t) /
              (1 - 2.89741816e-5 * t + 1.61456053e-7 * t * t)};
}

struct Measured {
  Rgb value{};
  std::optional<Rgb> u;
};
Measured Measure(const ColourLamp& lamp, const Functional& functional) {
  Measured measured;
  for (std::size_t k = 0; k < 3; ++k) {
    const Estimate estimate = Evaluate(lamp.channels[k], functional);
    measured.value[k] = estimate.value;
    if (estimate.u) {
      if (!measured.u) measured.u.emplace();
      (*measured.u)[k] = *estimate.u;
    }
  }
  return measured;
}

bool HasColour(const Rgb& rgb) {
  const auto [x, y, z] = XyzOf(rgb);
  return y > 0 && x + y + z > 0 && x + 15 * y + 3 * z > 0;
}

std::optional<Colour> ColourOfChannels(const Measured& measured) {
  const Rgb& rgb = measured.value;
  if (!HasColour(rgb)) return {};
  const auto of = [&](auto&& f) { return OfChannels(rgb, measured.u, f); };
  Colour colour;
  colour.x = of([](const Rgb& c) {
    const auto [x, y, z] = XyzOf(c);
    return x / (x + y + z);
  });
  colour.y = of([](const Rgb& c) {
    const auto [x, y, z] = XyzOf(c);
    return y / (x + y + z);
  });
  colour.u = of([](const Rgb& c) { return UvOf(c).u; });
  colour.v = of([](const Rgb& c) { return UvOf(c).v; });
  if (!ColourTemperatureOf(colour.u.value, colour.v.value)) return colour;
  const auto temperature = [](const Rgb& c) {
    const auto [u, v] = UvOf(c);
    return ColourTemperatureOf(u, v).value_or(ColourTemperature{});
  };
  colour.kelvin = of([&](const Rgb& c) { return temperature(c).kelvin; });
  colour.duv = of([&](const Rgb& c) { return temperature(c).duv; });
  return colour;
}

// In u', v'.
double SquaredDistance(const Rgb& a, const Rgb& b) {
  const UvPrime at = UvOf(a), from = UvOf(b);
  return (at.u - from.u) * (at.u - from.u) + (at.v - from.v) * (at.v - from.v);
}

// Of u' and of v' together; 0 where there is no noise.
double VarianceOfUv(const Measured& one) {
  const double
      u = OfChannels(one.value, one.u, [](const Rgb& c) { return UvOf(c).u; }).u.value_or(0),
      v = OfChannels(one.value, one.u, [](const Rgb& c) { return UvOf(c).v; }).u.value_or(0);
  return u * u + v * v;
}

// A direction whose colour counts, and the solid angle that it stands for.
struct Deviating {
  Vec3 direction;
  double solid_angle = 0;
  Measured measured;
};

// sqrt(D), the mean of squared distances weighed by luminous intensity Y omega,
//
//   D = sum Y omega d^2 / sum Y omega
//
// to first order of all channels, also of those of the mean colour. Noise adds to D, on average, the mean
// of the variances of u' and v'.
std::optional<Estimate> RmsDeviation(const ColourLamp& lamp, const Rgb& mean,
                                     const std::vector<Deviating>& all) {
  constexpr double kOfUncertainty = 0.5;
  double squares = 0, weights = 0, noise = 0;
  for (const auto& [direction, omega, one] : all) {
    const double weight = omega * core::Luminance(one.value);
    squares += weight * SquaredDistance(one.value, mean);
    weights += weight;
    noise += weight * VarianceOfUv(one);
  }
  if (!(weights > 0)) return {};
  const double square = squares / weights;
  Estimate rms{std::sqrt(square), {}};
  if (!(square > 0) || lamp.channels[0].noise.empty()) return rms;
  const Functional flux = FluxOf(lamp.channels[0]);
  double variance = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<WeighedDirection> weighed;
    double by_mean = 0;
    for (const Deviating& one : all) {
      const Rgb& here = one.measured.value;
      const double share = one.solid_angle / weights;
      const auto part = [&](const Rgb& c) {
        return core::Luminance(c) * (SquaredDistance(c, mean) - square);
      };
      const auto from_mean = [&](const Rgb& c) { return SquaredDistance(here, c); };
      weighed.push_back({share * SlopeOf(here, part)[k], one.direction});
      by_mean += share * core::Luminance(here) * SlopeOf(mean, from_mean)[k];
    }
    const Functional own = IntensitySum(lamp.channels[0], weighed);
    const double u = *Uncertainty(lamp.channels[k], Sum({{1, &own}, {by_mean, &flux}}));
    variance += u * u;
  }
  const double u = std::sqrt(variance) / (2 * rms.value),
               growth = std::sqrt(square + noise / weights) - rms.value;
  if (growth <= kOfUncertainty * u) rms.u = u;
  return rms;
}

}  // namespace

std::optional<ColourLamp> ColourLampOf(std::span<const PosedLightField> fields,
                                       std::span<const PosedLightField> sigma,
                                       std::span<const SolveMaps> maps, const std::string& file) {
  if (fields.empty() || std::any_of(fields.begin(), fields.end(), [](const PosedLightField& one) {
        return one.field.geometry.channels != 3;
      }))
    return {};
  ColourLamp lamp;
  for (int channel = 0; channel < 3; ++channel) {
    lamp.channels[channel] = LampOf(ChannelOf(fields, channel));
    if (!sigma.empty()) SetNoise(lamp.channels[channel], ChannelOf(sigma, channel), maps, file);
  }
  return lamp;
}

std::optional<ColourTemperature> ColourTemperatureOf(double u_prime, double v_prime) {
  constexpr double kLowest = 1000, kHighest = 15000, kFarthest = 0.05;
  const double u = u_prime, v = v_prime / 1.5;
  const auto distance = [&](double t) {
    const auto [bu, bv] = BlackBody(t);
    return std::hypot(u - bu, v - bv);
  };
  // Along 1 / T, in which the locus is nearly even.
  constexpr int kSteps = 200;
  const auto at = [&](double k) {
    return 1 / (1 / kLowest + (1 / kHighest - 1 / kLowest) * k / kSteps);
  };
  int best = 0;
  for (int k = 1; k <= kSteps; ++k)
    if (distance(at(k)) < distance(at(best))) best = k;
  if (best == 0 || best == kSteps) return {};
  double lo = best - 1, hi = best + 1;
  constexpr double kThird = 1.0 / 3;
  for (int step = 0; step < 80; ++step) {
    const double a = lo + kThird * (hi - lo), b = hi - kThird * (hi - lo);
    (distance(at(a)) < distance(at(b)) ? hi : lo) = distance(at(a)) < distance(at(b)) ? b : a;
  }
  const double t = at(0.5 * (lo + hi));
  if (!(distance(t) <= kFarthest)) return {};
  return ColourTemperature{t, v >= BlackBody(t).v ? distance(t) : -distance(t)};
}

std::optional<Colour> ColourOf(const ColourLamp& lamp, const Functional& functional) {
  return ColourOfChannels(Measure(lamp, functional));
}

ColourDistribution ColourDistributionOf(const ColourLamp& lamp, const IntensityTable& table,
                                        Vec3 peak) {
  constexpr double kDegree = std::numbers::pi / 180;
  constexpr double kOfBeam = 0.1, kOfTable = 0.01;
  const auto towards = [&](Vec3 d) { return IntensityTowards(lamp.channels[0], d); };
  ColourDistribution out;
  out.mean = ColourOf(lamp, FluxOf(lamp.channels[0]));
  out.axis = ColourOf(lamp, towards({0, 0, 1}));
  out.peak = ColourOf(lamp, towards(peak));
  out.c_deg = table.c_deg;
  out.gamma_deg = table.gamma_deg;
  const std::size_t angles = table.gamma_deg.size();
  std::vector<Measured> measured(table.intensity.size());
  core::ParallelFor(measured.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      measured[k] =
          Measure(lamp, towards(VectorOf({table.c_deg[k / angles], table.gamma_deg[k % angles]})));
  });
  double largest = 0;
  for (const Measured& one : measured) largest = std::max(largest, core::Luminance(one.value));
  out.table.resize(measured.size());
  for (std::size_t k = 0; k < measured.size(); ++k)
    if (core::Luminance(measured[k].value) > kOfTable * largest)
      out.table[k] = ColourOfChannels(measured[k]);
  if (!out.mean || !(largest > 0)) return out;
  const Rgb mean = Measure(lamp, FluxOf(lamp.channels[0])).value;
  const double step = angles > 1 ? table.gamma_deg[1] - table.gamma_deg[0] : 1;
  std::vector<Deviating> deviating;
  for (std::size_t k = 0; k < measured.size(); ++k) {
    const double intensity = core::Luminance(measured[k].value);
    if (!(intensity >= kOfBeam * largest) || !HasColour(measured[k].value)) continue;
    const double gamma = table.gamma_deg[k % angles],
                 omega = std::cos(std::max(0.0, gamma - step / 2) * kDegree) -
                         std::cos(std::min(180.0, gamma + step / 2) * kDegree);
    const Direction at{table.c_deg[k / angles], gamma};
    deviating.push_back({VectorOf(at), omega, measured[k]});
    const auto distance = [&](const Rgb& rgb) { return std::sqrt(SquaredDistance(rgb, mean)); };
    if (out.largest_deviation && distance(measured[k].value) <= out.largest_deviation->value)
      continue;
    out.largest_deviation = OfChannels(measured[k].value, measured[k].u, distance);
    out.largest_at = at;
  }
  out.rms_deviation = RmsDeviation(lamp, mean, deviating);
  return out;
}

}  // namespace luxfield::photometry
