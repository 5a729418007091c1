#include "luxfield/photometry/distribution.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "luxfield/core/parallel.h"

namespace luxfield::photometry {
namespace {

using lightfield::Cross;
using lightfield::Dot;
using lightfield::LuminaireGeometry;
using lightfield::Normalized;
using lightfield::PosedLightField;
using lightfield::Vec3;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kNearest_m = 1e-3;

// x = dir_x / dir_z of a field's directions: where parallel rays from anywhere on F meet I.
struct Range {
  double lo = 0, hi = 0;
};
struct Slopes {
  Range x, y;                     // of directions that meet I from somewhere on F
  Range all_x, all_y;             // from everywhere on F; hi < lo where there are none
  double step_x = 0, step_y = 0;  // the scale on which intensity changes
};

Slopes SlopesOf(const LuminaireGeometry& g) {
  const auto& grid = g.grid;
  const double u0 = grid.u0_m, u1 = u0 + (grid.width + grid.basis.cells - 1) * grid.spacing_m;
  const double v0 = grid.v0_m, v1 = v0 + (grid.height + grid.basis.cells - 1) * grid.spacing_m;
  const double s0 = g.lattice.s0_m, s1 = s0 + g.lattice.extent_s_m();
  const double t1 = g.lattice.t1_m, t0 = t1 - g.lattice.extent_t_m();
  const auto over = [&](double lo, double hi) { return Range{lo / g.delta_m, hi / g.delta_m}; };
  return {over(s0 - u1, s1 - u0), over(t0 - v1, t1 - v0),     over(s0 - u0, s1 - u1),
          over(t0 - v0, t1 - v1), grid.spacing_m / g.delta_m, grid.spacing_m / g.delta_m};
}

// A field's directions on an even lattice of slopes, at most `most` along an axis, with the solid
// angle of each: d omega = cos^3 dx dy.
struct DirectionLattice {
  std::vector<Vec3> directions;  // unit, in the luminaire's frame
  std::vector<double> solid_angle;
  double step_x = 0, step_y = 0;
};

DirectionLattice LatticeOf(const PosedLightField& posed, int most) {
  const Slopes slopes = SlopesOf(posed.field.geometry);
  const auto count = [&](const Range& range, double step) {
    return std::clamp(static_cast<int>(std::ceil((range.hi - range.lo) / step)), 2, most);
  };
  const int nx = count(slopes.x, slopes.step_x), ny = count(slopes.y, slopes.step_y);
  DirectionLattice lattice;
  lattice.step_x = (slopes.x.hi - slopes.x.lo) / nx;
  lattice.step_y = (slopes.y.hi - slopes.y.lo) / ny;
  for (int b = 0; b < ny; ++b)
    for (int a = 0; a < nx; ++a) {
      const Vec3 d{slopes.x.lo + (a + 0.5) * lattice.step_x,
                   slopes.y.lo + (b + 0.5) * lattice.step_y, 1};
      const double length = Length(d);
      lattice.directions.push_back(posed.luminaire_from_field.Direction((1 / length) * d));
      lattice.solid_angle.push_back(lattice.step_x * lattice.step_y / (length * length * length));
    }
  return lattice;
}

std::vector<double> Intensities(const Lamp& lamp, const std::vector<Vec3>& directions) {
  std::vector<double> values(directions.size());
  core::ParallelFor(directions.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) values[k] = IntensityValue(lamp, directions[k]);
  });
  return values;
}

// Two unit vectors across d, the first along +u as far as it can be.
std::array<Vec3, 2> Across(Vec3 d) {
  const Vec3 u{1, 0, 0}, v{0, 1, 0};
  const Vec3 first =
      std::abs(d.x) < 0.999 ? Normalized(u - Dot(u, d) * d) : Normalized(v - Dot(v, d) * d);
  return {first, Cross(d, first)};
}

struct PeakFound {
  Vec3 direction{0, 0, 1};
  double intensity = 0;
};

// Uphill from a direction by steps to its four sides, halved where none is higher.
PeakFound Climb(const Lamp& lamp, PeakFound from, double step) {
  const double smallest = 1e-4 * step;
  while (step > smallest) {
    PeakFound best = from;
    for (const Vec3& side : Across(from.direction))
      for (const double sign : {-step, step}) {
        const Vec3 d = Normalized(from.direction + sign * side);
        const double value = IntensityValue(lamp, d);
        if (value > best.intensity) best = {d, value};
      }
    if (best.intensity > from.intensity)
      from = best;
    else
      step /= 2;
  }
  return from;
}

// Of a lattice as fine as intensity changes, the highest directions, each climbed from.
PeakFound FindPeak(const Lamp& lamp) {
  constexpr int kMost = 256;
  constexpr std::size_t kStarts = 4;
  PeakFound peak{{0, 0, 1}, IntensityValue(lamp, {0, 0, 1})};
  for (const PosedLightField& posed : lamp.fields) {
    const DirectionLattice lattice = LatticeOf(posed, kMost);
    const std::vector<double> values = Intensities(lamp, lattice.directions);
    std::vector<std::size_t> order(values.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    const std::size_t starts = std::min(kStarts, order.size());
    std::partial_sort(order.begin(), order.begin() + std::ptrdiff_t(starts), order.end(),
                      [&](std::size_t a, std::size_t b) { return values[a] > values[b]; });
    for (std::size_t k = 0; k < starts; ++k) {
      const PeakFound found = Climb(lamp, {lattice.directions[order[k]], values[order[k]]},
                                    std::max(lattice.step_x, lattice.step_y));
      if (found.intensity > peak.intensity) peak = found;
    }
  }
  return peak;
}

// Where intensity first falls to `level` going from the peak towards `side`, and how fast.
struct Edge {
  double angle = 0;  // radians
  double slope = 0;  // dI / d angle, below 0
  Vec3 direction;
};
std::optional<Edge> FindEdge(const Lamp& lamp, Vec3 peak, Vec3 side, double level) {
  const auto at = [&](double angle) { return std::cos(angle) * peak + std::sin(angle) * side; };
  const auto value = [&](double angle) { return IntensityValue(lamp, at(angle)); };
  const double step = std::clamp(FinestAngle(lamp) / 4, 0.02 * kDegree, 0.25 * kDegree);
  double above = 0, below = 0;
  for (double angle = step; below == 0 && angle < std::numbers::pi; angle += step) {
    if (value(angle) < level)
      below = angle;
    else
      above = angle;
  }
  if (below == 0) return {};
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (above + below);
    (value(middle) < level ? below : above) = middle;
  }
  const double angle = 0.5 * (above + below), d = 1e-3 * step;
  return Edge{angle, (value(angle + d) - value(angle - d)) / (2 * d), at(angle)};
}

// Angles of both planes from the peak and the edges' weights.
std::optional<BeamAngle> BeamAngleOf(const Lamp& lamp, const PeakFound& peak, double share) {
  if (!(peak.intensity > 0)) return {};
  const Functional peak_weights = IntensityTowards(lamp, peak.direction);
  const auto sides = Across(peak.direction);
  std::array<double, 2> angle{};
  std::vector<Functional> weights;
  std::array<std::vector<FunctionalTerm>, 2> terms;
  BeamAngle beam;
  std::array<std::vector<double>, 2> slopes;
  for (std::size_t plane = 0; plane < 2; ++plane)
    for (const double sign : {-1.0, 1.0}) {
      const auto edge = FindEdge(lamp, peak.direction, sign * sides[plane], share * peak.intensity);
      if (!edge) return {};
      angle[plane] += edge->angle / kDegree;
      beam.limited = beam.limited || !IsCovered(lamp, edge->direction);
      if (!lamp.noise.empty()) weights.push_back(IntensityTowards(lamp, edge->direction));
      slopes[plane].push_back(edge->slope * kDegree);
    }
  const auto uncertainty = [&](std::span<const std::size_t> planes) -> std::optional<double> {
    if (lamp.noise.empty()) return {};
    std::vector<FunctionalTerm> sum;
    double of_peak = 0;
    for (const std::size_t plane : planes)
      for (std::size_t k = 0; k < 2; ++k) {
        const double factor = -1 / slopes[plane][k] / static_cast<double>(planes.size());
        sum.push_back({factor, &weights[2 * plane + k]});
        of_peak -= share * factor;
      }
    sum.push_back({of_peak, &peak_weights});
    return Uncertainty(lamp, Sum(sum));
  };
  constexpr std::array<std::size_t, 2> kBoth = {0, 1};
  beam.along_c0_deg = {angle[0], uncertainty(std::span(kBoth).first(1))};
  beam.along_c90_deg = {angle[1], uncertainty(std::span(kBoth).last(1))};
  beam.mean_deg = {0.5 * (angle[0] + angle[1]), uncertainty(kBoth)};
  return beam;
}

// Q / flux, with its weights' own uncertainty.
std::optional<Estimate> ShareOf(const Lamp& lamp, const Functional& part, const Functional& flux,
                                double flux_value) {
  if (!(flux_value > 0)) return {};
  const double share = Value(lamp, part) / flux_value;
  Estimate estimate{share, {}};
  if (!lamp.noise.empty())
    estimate.u = Uncertainty(lamp, Sum({{1 / flux_value, &part}, {-share / flux_value, &flux}}));
  return estimate;
}

bool ShinesDownOnly(const Lamp& lamp) {
  return std::all_of(lamp.fields.begin(), lamp.fields.end(), [](const PosedLightField& posed) {
    const Vec3 n = posed.luminaire_from_field.InverseDirection({0, 0, 1});
    return n.x == 0 && n.y == 0 && n.z > 0;
  });
}

void FindShares(const Lamp& lamp, const Functional& flux, Distribution* out) {
  if (!(out->flux.value > 0)) return;
  if (ShinesDownOnly(lamp)) {
    const auto none = lamp.noise.empty() ? std::nullopt : std::optional(0.0);
    out->downward_share = Estimate{1, none};
    out->upward_share = Estimate{0, none};
    return;
  }
  out->downward_share = ShareOf(lamp, FluxTowards(lamp, {0, 0, 1}), flux, out->flux.value);
  out->upward_share = Estimate{1 - out->downward_share->value, out->downward_share->u};
}

// Directions that share the sphere among them.
DirectionLattice AllDirections(const Lamp& lamp) {
  constexpr int kMost = 64, kPlanes = 72, kAngles = 90;
  if (lamp.fields.size() == 1) return LatticeOf(lamp.fields[0], kMost);
  DirectionLattice lattice;
  for (int c = 0; c < kPlanes; ++c)
    for (int a = 0; a < kAngles; ++a) {
      const double gamma = (a + 0.5) * 180 / kAngles, half = 90.0 / kAngles;
      lattice.directions.push_back(VectorOf({(c + 0.5) * 360 / kPlanes, gamma}));
      lattice.solid_angle.push_back(
          2 * std::numbers::pi / kPlanes *
          (std::cos((gamma - half) * kDegree) - std::cos((gamma + half) * kDegree)));
    }
  return lattice;
}

// How much larger noise makes |x| on average, noise of standard deviation s:
//
//   s sqrt(2 / pi) exp(-x^2 / (2 s^2)) + x erf(x / (s sqrt(2))) - |x|
double GrowthByNoise(double x, double s) {
  if (!(s > 0)) return 0;
  const double t = x / (s * std::numbers::sqrt2);
  return s * std::sqrt(2 / std::numbers::pi) * std::exp(-t * t) + x * std::erf(t) - std::abs(x);
}

// Half the integral of |I - I mirrored| over that of I.
class Asymmetry {
 public:
  // own[k], mirrored[k]: intensities towards lattice.directions[k] and its mirror image.
  Asymmetry(const DirectionLattice& lattice, const std::vector<double>& own,
            const std::vector<double>& mirrored)
      : lattice_(lattice), own_(own), mirrored_(mirrored) {
    double apart = 0;
    for (std::size_t k = 0; k < own.size(); ++k) {
      apart += lattice.solid_angle[k] * std::abs(own[k] - mirrored[k]);
      all_ += lattice.solid_angle[k] * own[k];
    }
    value_ = 0.5 * apart / all_;
  }

  template <typename Mirror>
  std::optional<Estimate> With(const Lamp& lamp, Mirror&& mirror) const {
    if (!(all_ > 0)) return {};
    Estimate estimate{value_, {}};
    if (lamp.noise.empty()) return estimate;
    const auto u = Uncertainty(lamp, Linearised(lamp, mirror));
    constexpr double kOfUncertainty = 0.5;
    if (Growth(lamp, mirror) <= kOfUncertainty * *u) estimate.u = u;
    return estimate;
  }

 private:
  template <typename Mirror>
  Functional Linearised(const Lamp& lamp, Mirror&& mirror) const {
    std::vector<WeighedDirection> weighed;
    for (std::size_t k = 0; k < own_.size(); ++k) {
      const double apart = own_[k] - mirrored_[k], share = lattice_.solid_angle[k] / all_,
                   half = apart > 0   ? 0.5 * share
                          : apart < 0 ? -0.5 * share
                                      : 0;
      weighed.push_back({half - value_ * share, lattice_.directions[k]});
      if (half != 0) weighed.push_back({-half, mirror(lattice_.directions[k])});
    }
    return IntensitySum(lamp, weighed);
  }
  // What noise adds to the value on average: of some directions that stand for all, spread by the golden
  // ratio.
  template <typename Mirror>
  double Growth(const Lamp& lamp, Mirror&& mirror) const {
    constexpr double kDirections = 64, kGolden = 0.6180339887498949;
    const double share = std::min(1.0, kDirections / static_cast<double>(own_.size()));
    double sum = 0;
    for (std::size_t k = 0; k < own_.size(); ++k) {
      const double turns = kGolden * static_cast<double>(k);
      if (turns - std::floor(turns) >= share) continue;
      const Vec3 d = lattice_.directions[k];
      const double u = IntensityEstimate(lamp, d).u.value_or(0),
                   of_mirrored = IntensityEstimate(lamp, mirror(d)).u.value_or(0);
      sum += lattice_.solid_angle[k] *
             GrowthByNoise(own_[k] - mirrored_[k], std::hypot(u, of_mirrored));
    }
    return 0.5 * sum / share / all_;
  }

  const DirectionLattice& lattice_;
  const std::vector<double>&own_, &mirrored_;
  double all_ = 0, value_ = 0;
};

void FindAsymmetry(const Lamp& lamp, Distribution* out) {
  if (!(out->flux.value > 0)) return;
  const DirectionLattice lattice = AllDirections(lamp);
  const std::vector<double> own = Intensities(lamp, lattice.directions);
  const auto with = [&](auto&& mirror) {
    std::vector<Vec3> directions = lattice.directions;
    for (Vec3& d : directions) d = mirror(d);
    const std::vector<double> mirrored = Intensities(lamp, directions);
    return Asymmetry(lattice, own, mirrored).With(lamp, mirror);
  };
  out->asymmetry_c0_c180 = with([](Vec3 d) { return Vec3{d.x, -d.y, d.z}; });
  out->asymmetry_c90_c270 = with([](Vec3 d) { return Vec3{-d.x, d.y, d.z}; });
}

double SizeOf(const Lamp& lamp) {
  double size = 0;
  for (const PosedLightField& posed : lamp.fields) {
    const auto& g = posed.field.geometry;
    const double u = std::abs(g.grid.u0_m) + (g.grid.width + 3) * g.grid.spacing_m,
                 v = std::abs(g.grid.v0_m) + (g.grid.height + 3) * g.grid.spacing_m;
    size = std::max(size, std::hypot(u, v) + g.delta_m +
                              lightfield::Length(posed.luminaire_from_field.translation_m));
  }
  return size;
}

// E r^2 / I - 1 at r along d.
double Departure(const Lamp& lamp, Vec3 d, double r, double intensity) {
  return IlluminanceValue(lamp, r * d, -1 * d) * r * r / intensity - 1;
}

// How a maximum of intensity moves with C: sides across it, and the weights of its turn towards each,
// radians. To first order, with g and H the gradient and the Hessian of intensity by the turn,
//
//   turn = -H^-1 sum dg/dC dC
//
struct Turn {
  std::array<Vec3, 2> sides;
  std::array<Functional, 2> weights;
};
// Absent without noise, and where intensity is no hill.
std::optional<Turn> TurnOf(const Lamp& lamp, Vec3 d) {
  if (lamp.noise.empty()) return {};
  const double h = 0.1 * FinestAngle(lamp);
  Turn turn{Across(d), {}};
  const auto at = [&](double a, double b) {
    return Normalized(d + h * a * turn.sides[0] + h * b * turn.sides[1]);
  };
  const auto value = [&](double a, double b) { return IntensityValue(lamp, at(a, b)); };
  const double middle = value(0, 0), h00 = value(1, 0) - 2 * middle + value(-1, 0),
               h11 = value(0, 1) - 2 * middle + value(0, -1),
               h01 = (value(1, 1) - value(1, -1) - value(-1, 1) + value(-1, -1)) / 4;
  const double determinant = h00 * h11 - h01 * h01;
  if (!(h00 < 0 && determinant > 0)) return {};
  const Functional a1 = IntensityTowards(lamp, at(1, 0)), a0 = IntensityTowards(lamp, at(-1, 0)),
                   b1 = IntensityTowards(lamp, at(0, 1)), b0 = IntensityTowards(lamp, at(0, -1));
  const double half = 0.5 * h / determinant;
  turn.weights[0] =
      Sum({{-half * h11, &a1}, {half * h11, &a0}, {half * h01, &b1}, {-half * h01, &b0}});
  turn.weights[1] =
      Sum({{half * h01, &a1}, {-half * h01, &a0}, {-half * h00, &b1}, {half * h00, &b0}});
  return turn;
}

// Of a turn that noise keeps well within the angle over which intensity changes, so that it is of this
// hill.
std::optional<DirectionUncertainty> UncertaintyOf(const Lamp& lamp, Vec3 d,
                                                  const std::optional<Turn>& turn) {
  constexpr double kFromPole = 4;
  if (!turn) return {};
  const double along = *Uncertainty(lamp, turn->weights[0]),
               across = *Uncertainty(lamp, turn->weights[1]);
  if (!(std::hypot(along, across) < FinestAngle(lamp))) return {};
  DirectionUncertainty u{along / kDegree, across / kDegree, {}, {}};
  const double sine = std::hypot(d.x, d.y);
  if (!(sine > kFromPole * std::hypot(along, across))) return u;
  const Vec3 with_gamma{d.x / sine * d.z, d.y / sine * d.z, -sine},
      with_c{d.y / sine, -d.x / sine, 0};
  const auto towards = [&](Vec3 way) {
    return *Uncertainty(lamp, Sum({{Dot(way, turn->sides[0]), &turn->weights[0]},
                                   {Dot(way, turn->sides[1]), &turn->weights[1]}}));
  };
  u.gamma_deg = towards(with_gamma) / kDegree;
  u.c_deg = towards(with_c) / sine / kDegree;
  return u;
}

// Uncertainty of the distance r where the departure has reached a tolerance; the direction turns.
std::optional<double> DistanceUncertainty(const Lamp& lamp, Vec3 d, double r, double intensity,
                                          const std::optional<Turn>& turn) {
  if (lamp.noise.empty()) return {};
  const double ratio = 1 + Departure(lamp, d, r, intensity), step = 1e-4 * r;
  const double slope =
      (Departure(lamp, d, r + step, intensity) - Departure(lamp, d, r - step, intensity)) /
      (2 * step);
  const Functional e = IlluminanceAt(lamp, r * d, -1 * d), i = IntensityTowards(lamp, d);
  std::vector<FunctionalTerm> terms{{-r * r / intensity / slope, &e},
                                    {ratio / intensity / slope, &i}};
  if (turn) {
    const double small = 0.1 * FinestAngle(lamp);
    for (int k = 0; k < 2; ++k) {
      const auto turned = [&](double angle) {
        const Vec3 to = Normalized(d + angle * turn->sides[k]);
        return Departure(lamp, to, r, IntensityValue(lamp, to));
      };
      terms.push_back({-(turned(small) - turned(-small)) / (2 * small) / slope, &turn->weights[k]});
    }
  }
  return Uncertainty(lamp, Sum(terms));
}

// Inwards from far away to where the departure first exceeds each tolerance, the smallest first.
InverseSquare InverseSquareAlong(const Lamp& lamp, Vec3 d, double intensity,
                                 const std::optional<Turn>& turn) {
  constexpr double kRatio = 1.03, kFarthestSizes = 1e5;
  InverseSquare found{d, {}};
  if (!(intensity > 0)) return found;
  double good = kFarthestSizes * SizeOf(lamp);
  for (std::size_t k = 0; k < kInverseSquarePercent.size(); ++k) {
    const double tolerance = kInverseSquarePercent[k] / 100.0;
    const auto beyond = [&](double r) {
      return std::abs(Departure(lamp, d, r, intensity)) > tolerance;
    };
    if (beyond(good)) continue;
    double bad = good / kRatio;
    while (bad > kNearest_m && !beyond(bad)) good = bad, bad /= kRatio;
    if (bad <= kNearest_m) {
      found.distance_m[k] =
          Estimate{kNearest_m, lamp.noise.empty() ? std::nullopt : std::optional(0.0)};
      continue;
    }
    double inner = bad, outer = good;
    for (int step = 0; step < 50; ++step) {
      const double middle = 0.5 * (outer + inner);
      (beyond(middle) ? inner : outer) = middle;
    }
    found.distance_m[k] = Estimate{outer, DistanceUncertainty(lamp, d, outer, intensity, turn)};
  }
  return found;
}

std::optional<Estimate> CoveredGamma(const Lamp& lamp) {
  if (lamp.fields.size() != 1 || !ShinesDownOnly(lamp)) return {};
  const Slopes slopes = SlopesOf(lamp.fields[0].field.geometry);
  const double least = std::min(std::min(-slopes.all_x.lo, slopes.all_x.hi),
                                std::min(-slopes.all_y.lo, slopes.all_y.hi));
  return Estimate{least > 0 ? std::atan(least) / kDegree : 0,
                  lamp.noise.empty() ? std::nullopt : std::optional(0.0)};
}

void AddRemarks(const Lamp& lamp, Distribution* out) {
  if (!(out->flux.value > 0) || !(out->peak.value > 0))
    out->remarks.push_back(
        "there is no light to speak of: flux or largest intensity is not above "
        "0, and what would be divided by them is left out");
  const auto limited = [&](const std::optional<BeamAngle>& angle, const char* name) {
    if (angle && angle->limited)
      out->remarks.push_back(fmt::format(
          "the {} reaches to where the light field ends, beyond gamma = {:.1f} degrees: it is that "
          "of what was measured",
          name, out->covered_gamma_deg ? out->covered_gamma_deg->value : 0));
  };
  limited(out->beam, "beam angle");
  limited(out->field, "field angle");
  std::size_t independent = 0;
  for (const CoefficientNoise& noise : lamp.noise) independent += noise.independent_texels();
  if (independent > 0)
    out->remarks.push_back(fmt::format(
        "in {} texels sigma is not that of a solve of all positions; their coefficients are taken "
        "as independent, which overstates the uncertainty of sums",
        independent));
}

}  // namespace

Direction DirectionOf(Vec3 d) {
  const double across = std::hypot(d.x, d.y);
  double c = across > 0 ? std::atan2(-d.y, d.x) / kDegree : 0;
  if (c < 0) c += 360;
  return {c >= 360 ? 0 : c, std::atan2(across, d.z) / kDegree};
}

Vec3 VectorOf(Direction direction) {
  const double c = direction.c_deg * kDegree, gamma = direction.gamma_deg * kDegree;
  return {std::sin(gamma) * std::cos(c), -std::sin(gamma) * std::sin(c), std::cos(gamma)};
}

Distribution DistributionOf(const Lamp& lamp) {
  Distribution out;
  out.unit = lamp.unit;
  const Functional flux = FluxOf(lamp);
  out.flux = Evaluate(lamp, flux);
  out.axis = IntensityEstimate(lamp, {0, 0, 1});
  const PeakFound peak = FindPeak(lamp);
  out.peak_direction = peak.direction;
  out.peak = IntensityEstimate(lamp, peak.direction);
  out.beam = BeamAngleOf(lamp, peak, 0.5);
  out.field = BeamAngleOf(lamp, peak, 0.1);
  FindShares(lamp, flux, &out);
  FindAsymmetry(lamp, &out);
  out.on_axis = InverseSquareAlong(lamp, {0, 0, 1}, out.axis.value, {});
  const auto turn = TurnOf(lamp, peak.direction);
  out.peak_direction_u = UncertaintyOf(lamp, peak.direction, turn);
  out.towards_peak = InverseSquareAlong(lamp, peak.direction, peak.intensity, turn);
  out.covered_gamma_deg = CoveredGamma(lamp);
  AddRemarks(lamp, &out);
  return out;
}

double EdgeGammaOf(const Distribution& d) {
  constexpr double kUsual_deg = 60;
  if (!d.field) return kUsual_deg;
  return DirectionOf(d.peak_direction).gamma_deg +
         0.5 * std::max(d.field->along_c0_deg.value, d.field->along_c90_deg.value);
}

Vec3 PeakDirectionOf(const Lamp& lamp) { return FindPeak(lamp).direction; }

bool IsCovered(const Lamp& lamp, Vec3 direction) {
  if (lamp.fields.size() != 1) return true;  // others may show it
  const Vec3 d = lamp.fields[0].luminaire_from_field.InverseDirection(direction);
  const Slopes slopes = SlopesOf(lamp.fields[0].field.geometry);
  if (!(d.z > 0)) return false;
  const double x = d.x / d.z, y = d.y / d.z;
  return x >= slopes.all_x.lo && x <= slopes.all_x.hi && y >= slopes.all_y.lo &&
         y <= slopes.all_y.hi;
}

double FinestAngle(const Lamp& lamp) {
  double finest = 1;
  for (const PosedLightField& posed : lamp.fields)
    finest = std::min(finest, SlopesOf(posed.field.geometry).step_x);
  return finest;
}

IntensityTable TableOf(const Lamp& lamp, double c_step_deg, double gamma_step_deg) {
  IntensityTable table;
  const int planes = std::max(1, static_cast<int>(std::lround(360 / c_step_deg)));
  const double most = ShinesDownOnly(lamp) ? 90 : 180;
  const int angles = std::max(1, static_cast<int>(std::lround(most / gamma_step_deg)));
  for (int c = 0; c < planes; ++c) table.c_deg.push_back(360.0 * c / planes);
  for (int a = 0; a <= angles; ++a) table.gamma_deg.push_back(most * a / angles);
  table.intensity.resize(table.c_deg.size() * table.gamma_deg.size());
  core::ParallelFor(table.intensity.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Vec3 d = VectorOf(
          {table.c_deg[k / table.gamma_deg.size()], table.gamma_deg[k % table.gamma_deg.size()]});
      table.intensity[k] = IntensityEstimate(lamp, d);
    }
  });
  return table;
}

}  // namespace luxfield::photometry
